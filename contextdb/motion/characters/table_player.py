"""A table that plays without a search: the picker picks a row, what plays is blended into it, and it plays as its row says.

A row is picked where nothing plays, where what plays has ended, or is no longer valid and does not say that it plays on to its end,
and when the game interrupts. What loops plays on while it is valid. Nothing is compared with a pose, so that there is no cost: what
is entered begins at the `start_s` of its row.

Source: the Chooser Player of Unreal's Animation Chooser.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from contextdb.cells.arguments import require_kind, require_mapping, require_real
from contextdb.cells.row_play import RowPlay
from contextdb.errors import Fault, MotionError, in_quotes, mend_for, some
from contextdb.motion.answers import Answer
from contextdb.motion.characters import tables as asking
from contextdb.motion.characters.tables import Facts, Table, Unknown
from contextdb.motion.clips.ground_place import OfBody, place_of
from contextdb.motion.output.stream import Pose, PoseState, PoseStream
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.chooser import Chooser
from contextdb.motion.selection.controller_settings import ControllerSettings
from contextdb.motion.selection.controller_state import ControllerState
from contextdb.motion.selection.decision import Action, Decision, Playing, Recorder, plays
from contextdb.motion.selection.root_motion import RootMotion
from contextdb.motion.selection.selector import Entry, Selector

PLAIN = RowPlay()
PlayerState = tuple[ControllerState, PoseState | None]


class Picks(Protocol):
    """A picker, such as `CompiledTable.picker()` gives."""

    def pick(self, matches: Any, /) -> Any:
        """One of the valid rows: `row`, None for the fallback, and `asset`, None for nothing."""


class TablePlayer:
    """Plays what a table picks.

    Parameters
    ----------
    table : compiled table, or a live context of one
    databases : mapping of str to MotionDatabase
        Whose clips play; the first that has an asset plays it.
    picker : Picker
        Of the table; the caller's, as it remembers what it picked.
    stream : PoseStream, optional
        Default: decisions alone, and no poses.
    unknown : {"error", "any", "never"}
        How the table treats missing facts.
    recorder : Recorder, optional
        Is handed every decision, such as a `Trace`.

    Attributes
    ----------
    table, picker, stream, unknown, recorder
        As given, and may be exchanged between updates.
    pose : Pose or None
        The last one.

    Raises
    ------
    ContextError
        An argument of another type.
    MotionError
        There is no database.
    """

    def __init__(
        self,
        table: Table,
        databases: Mapping[str, MotionDatabase],
        picker: Picks,
        stream: PoseStream | None = None,
        *,
        unknown: Unknown = "error",
        recorder: Recorder | None = None,
    ) -> None:
        named = dict(require_mapping(databases, "databases", "a mapping of names to MotionDatabase"))
        for each in named.values():
            require_kind(each, MotionDatabase, "one of databases", "a MotionDatabase")
        require_kind(stream, (PoseStream, type(None)), "stream", "a PoseStream")
        if not named:
            raise MotionError(Fault("there is no database.", "at least one"))
        asking.checked(table)
        self.table, self.picker, self.stream, self.unknown, self.recorder = table, picker, stream, unknown, recorder
        self.pose: Pose | None = None
        self._chooser = Chooser(Selector([Entry(name, database) for name, database in named.items()]), ControllerSettings())
        self._state = ControllerState()

    def __repr__(self) -> str:
        return f"<TablePlayer: {plays(self.playing)}>"

    @property
    def playing(self) -> Playing | None:
        """What plays now."""
        return self._state.playing

    @property
    def state(self) -> PlayerState:
        """Where it is, to come back to with `restore`; the picker is not in it."""
        return self._state, None if self.stream is None else self.stream.state

    def restore(self, state: PlayerState) -> None:
        """Go on from a state of this player."""
        self._state = state[0]
        if self.stream is not None and state[1] is not None:
            self.stream.restore(state[1])

    def update(
        self,
        dt: float,
        facts: Facts | None = None,
        body: OfBody | None = None,
        *,
        mirrored: bool = False,
        interrupt: bool = False,
    ) -> Decision:
        """Move what plays on, pick if it is time to, and make the pose.

        Parameters
        ----------
        dt : float
            Seconds since the last update.
        facts : mapping of str to fact, optional
            What the game knows, for the table.
        body : Steered or (x, z, heading), optional
            Where the game has the body; every root mode but "animation" needs it.
        mirrored : bool
            Whether what is picked now plays mirrored, where its row leaves that to the game.
        interrupt : bool
            Pick now, whatever plays.

        Raises
        ------
        ContextDBError
            Facts that the table refuses, an asset that no database has, or an argument that cannot be used. The player then stands
            where it stood, but for what the picker has picked.
        """
        dt, place = require_real(dt, "dt", 0.0), place_of(body)
        answer = asking.answer(self.table, {} if facts is None else facts, self.unknown)
        moved = self._chooser.move(self._chooser.encode(self._state), dt)[0][0].tolist()
        before, n_loops, is_ended = self._chooser.playing(moved[:4]), moved[4], moved[5] != 0.0
        motion = RootMotion(*moved[6:9])
        why = self._why_pick(answer, before, n_loops > 0.0, is_ended, interrupt)
        decision = self._on(dt, before, motion, n_loops > 0.0, is_ended)
        if why:
            decision = self._picked(decision, answer, mirrored, why)
        decision = replace(decision, context=facts, body=place)
        if self.stream is not None:
            self.pose = self.stream.update(decision, dt, body)
        self._state = ControllerState(
            tick=decision.tick + 1,
            time_s=decision.time_s,
            playing=decision.playing,
            play_rate=decision.play_rate,
            play=decision.play,
        )
        if self.recorder is not None:
            self.recorder.record(decision)
        return decision

    def _why_pick(self, answer: Answer, before: Playing | None, has_looped: bool, is_ended: bool, interrupt: bool) -> str:
        """Why a row is picked now, as a part of a sentence; empty where what plays goes on."""
        if before is None:
            return "nothing played"
        if interrupt:
            return "the game interrupts"
        if is_ended:
            return f"{before.asset} has ended"
        flags, assets = answer.flags, answer.table_assets
        if any(assets[row] == before.asset for row in np.flatnonzero(flags).tolist()):
            return ""
        waits = self._state.play is not None and self._state.play.until == "natural" and not has_looped
        return "" if waits else f"{before.asset} is not valid any more"

    def _on(self, dt: float, before: Playing | None, motion: RootMotion, has_looped: bool, is_ended: bool) -> Decision:
        """The decision that what plays goes on."""
        action = Action.NOTHING if before is None else Action.HOLD if is_ended else Action.LOOP if has_looped else Action.CONTINUE
        state, why = self._state, "nothing plays." if before is None else f"{before.asset} plays on."
        return Decision(
            state.tick, state.time_s + dt, action, why, False, before, before,
            root_motion=motion, root_weight=self._root_weight(before), play_rate=state.play_rate, play=state.play,
        )  # fmt: skip

    def _picked(self, on: Decision, answer: Answer, mirrored: bool, why: str) -> Decision:
        """The decision that a row is entered; the one that what plays goes on, where none is picked."""
        pick = self.picker.pick(answer)
        if pick.asset is None:
            return replace(on, why=f"{why}, and no row is valid.")
        rows = answer.plays
        how = None if rows is None else RowPlay.of(rows[-1 if pick.row is None else pick.row].tolist())
        asset = pick.asset if pick.row is None else answer.table_assets[pick.row]
        playing = self._entered(asset, how or PLAIN, mirrored)
        action = Action.START if on.before is None else Action.JUMP
        rate = (how or PLAIN).rate
        said = replace(on, action=action, why=f"{why}: {asset} is picked.", playing=playing, play_rate=rate, play=how)
        return replace(said, searched=True, root_weight=self._root_weight(playing))

    def _entered(self, asset: str, how: RowPlay, mirrored: bool) -> Playing:
        """The moment at which an asset is entered. Raises MotionError where no database has it."""
        wanted = mirrored if how.mirror in (None, "as asked") else how.mirror == "always"
        for d, database in enumerate(self._chooser.databases):
            assert database is not None, "all databases are there"
            ranges = [i for i, name in enumerate(database.assets) if name == asset and database.stops[i] > database.starts[i]]
            own = [i for i in ranges if bool(database.mirrored[i]) is wanted]
            if own:
                return self._at(d, database, own[0], how.start_s or 0.0)
            if ranges:
                wrong = f"{in_quotes(asset)} has no {'mirrored clip' if wanted else 'clip that is not mirrored'}."
                raise MotionError(Fault(wrong, "a database of mirrored clips too", "mirror in its [features]" if wanted else ""))
        known = {name for database in self._chooser.databases if database is not None for name in database.assets}
        raise MotionError(Fault(f"no database has the asset {in_quotes(asset)}.", some(known), mend_for(asset, known)))

    def _at(self, d: int, database: MotionDatabase, at: int, start_s: float) -> Playing:
        rate, start, last = self._chooser.rates[d], int(database.starts[at]), int(database.stops[at]) - 1
        frame = min(start + round(start_s * rate), last)
        playing = self._chooser.playing((d, at, frame, (frame - start) / rate))
        assert playing is not None, "a range of a database that is there"
        return playing

    def _root_weight(self, playing: Playing | None) -> float:
        """How much of the movement of what plays is the animation's, by its markup."""
        if playing is None:
            return 1.0
        database = self._chooser.selector.databases[playing.database]
        kind = int(database.marks.kinds[playing.frame]) if len(database.marks.kinds) else 0
        return float(database.marks.kind_root_weights[kind])
