"""A recorded session as the debugger reads it: its timeline, the search behind each moment repeated, its poses and measures."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb.errors import ContextDBError, plural
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.measuring import displayed, measure
from contextdb.motion.measuring.displayed import strips_of
from contextdb.motion.measuring.raw_clips import Clips
from contextdb.motion.output.bank import PoseBank
from contextdb.motion.output.settings import PoseSettings
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.decision import Decision
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.pose_files import open_or_build_poses, saved_poses
from contextdb.motion.trace.reasked import Reasked, why_not_asked
from contextdb.motion.trace.reasked_decision import ReaskedDecision
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.stats import SMALL_GAIN, gains_of
from contextdb.motion.trace.status import Status, status_of
from contextdb.motion.trace.stock import Stock
from contextdb.motion.trace.timeline import Timeline, timeline_of
from contextdb.tables.project import SCHEMA_FILE, Project

from .landscape import Landscape

MEASURES = {"accel": "acceleration m/s²", "skate": "skate cm/s", "error": "path error m"}
"""What is measured of the poses, with its unit."""


@dataclass(frozen=True)
class Turned:
    """Weights of channels and thresholds of databases that are not as they were recorded."""

    weights: Mapping[str, float] = field(default_factory=dict)
    thresholds: Mapping[str, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.weights or self.thresholds)

    def of(self, decision: ReaskedDecision) -> ReaskedDecision:
        """A decision with them."""
        for name, threshold in self.thresholds.items():
            decision = decision.with_threshold(name, threshold)
        return decision.with_weights(self.weights) if self.weights else decision


@dataclass(frozen=True)
class Figures:
    """How a session jumps: how often a second, how often forced, what a jump spares in the middle, and how many spare little.

    They are those of `Trace.stats`.
    """

    jumps: int
    forced: int
    jumps_per_s: float
    gain_median: float | None
    gain_small_share: float | None
    stay_s: float | None

    @classmethod
    def of(cls, line: Timeline) -> Figures:
        """Those of a timeline."""
        is_jump = line.jumped & (np.arange(len(line)) > 0) & (np.roll(line.playing, 1) >= 0)
        n, n_forced = int(is_jump.sum()), int(line.forced.sum())
        known = is_jump & ~line.forced & np.isfinite(line.continuing)
        gains = gains_of(line.continuing[known], line.costs[known])
        plays_s, n_entered = float(np.diff(line.times_s)[line.playing[:-1] >= 0].sum()), int(line.jumped.sum())
        return cls(
            n,
            n_forced,
            n / line.seconds if line.seconds > 0.0 else 0.0,
            float(np.median(gains)) if len(gains) else None,
            float((gains < SMALL_GAIN).mean()) if len(gains) else None,
            plays_s / n_entered if n_entered else None,
        )

    @property
    def text(self) -> str:
        text = f"{plural(self.jumps, 'jump')}, {self.jumps_per_s:.2f} a second, {self.forced:,} forced"
        if self.gain_median is not None and self.gain_small_share is not None:
            text += f" · gain median {self.gain_median:.0%}, {self.gain_small_share:.0%} under {SMALL_GAIN:.0%}"
        return text if self.stay_s is None else f"{text} · {self.stay_s:.2f} s in a clip"


class Watched(Sequence[Decision]):
    """Decisions that tell of each step that somebody goes through them."""

    def __init__(self, decisions: Sequence[Decision], on_step: Callable[[], None]) -> None:
        self._decisions, self._on_step = decisions, on_step

    def __getitem__(self, index: int | slice) -> Decision | Sequence[Decision]:  # type: ignore[override]
        return self._decisions[index]

    def __len__(self) -> int:
        return len(self._decisions)

    def __iter__(self) -> Iterator[Decision]:
        for each in self._decisions:
            self._on_step()
            yield each


class Recording:
    """A session, and what of its project there is.

    Parameters
    ----------
    file : str
        Its name.
    trace : Trace
        It holds an update at least.
    folder : str
        Of its project; "" where there is none.
    databases : mapping of name to MotionDatabase
        Those of the project.
    missing : str
        Why some searches cannot be repeated, in a sentence; "" when all can.
    """

    def __init__(self, file: str, trace: Trace, folder: str, databases: Mapping[str, MotionDatabase], missing: str) -> None:
        self.file, self.trace, self.folder = file, trace, folder
        self.databases: dict[str, MotionDatabase] = dict(databases)
        self.missing = missing
        self._decisions: list[Decision] | None = None
        self.displayed: Displayed | None = None
        """Its poses, once they are made."""
        self.measured: Mapping[str, Floats] = {}
        """And what is measured of them."""
        self.run_again: Mapping[str, float | None] | None = None
        """Its measures run again with nothing turned, once they are known."""
        """What its poses are made with in place of what the project says, in sentences."""
        self.refresh(missing)

    def refresh(self, missing: str) -> None:
        """Read the session again, which grew at its end, and may be forgotten at its start."""
        self.missing = missing
        self.line: Timeline = timeline_of(self.trace)
        self.figures = Figures.of(self.line)
        self.uses = self.line.uses()
        self.searches = np.flatnonzero(self.line.searched)
        self.jumps = np.flatnonzero(self.line.jumped)
        self.__dict__.pop("reasked", None)

    @property
    def name(self) -> str:
        return os.path.basename(self.file)

    def __len__(self) -> int:
        return len(self.line)

    def edited(self) -> None:
        """Read the project again, whose tables may have been edited."""
        for name in ("project", "config", "stock", "reasked"):
            self.__dict__.pop(name, None)

    # ---- moments

    def search_at(self, index: int) -> int | None:
        """Which update searched last, at a moment; None where none did yet."""
        at = int(np.searchsorted(self.searches, index, side="right")) - 1
        return None if at < 0 else int(self.searches[at])

    def status_at(self, index: int) -> Status:
        """Speeds and angles of an update."""
        last, known = self.trace[index - 1] if index else None, {} if self.missing else self.databases
        return status_of(self.trace[index], last, known, None if self.displayed is None else self.displayed.warps[index])

    def repeated(self, index: int) -> tuple[ReaskedDecision | None, str]:
        """The search of an update repeated, or why it cannot be."""
        decision = self.trace[index]
        why = why_not_asked(decision, self.trace.about, self.databases) if self.databases else self.missing
        return (None, self.missing or why) if why else (self.reasked.of(decision), "")

    @cached_property
    def reasked(self) -> Reasked:
        """The session repeated, of its tables too."""
        return Reasked(self.trace, self.trace.about, self.stock, {})

    @cached_property
    def stock(self) -> Stock:
        """Its databases, and the tables of its project."""
        return Stock(self.databases) if self.project is None else Stock.with_tables(self.databases, self.project)

    @cached_property
    def project(self) -> Project | None:
        """Its project; None where there is none, or it cannot be read."""
        if not self.folder:
            return None
        try:
            return Project.load(self.folder)
        except ContextDBError:
            return None

    @cached_property
    def config(self) -> MotionConfig | None:
        """What the project says of motion."""
        if self.project is None:
            return None
        return MotionConfig.from_dict(self.project.schema.motion, tables=self.project.tables, file=self.schema_file)

    def decisions(self, on_step: Callable[[], None]) -> list[Decision]:
        """All decisions in full; read once, which takes some seconds for a long session."""
        if self._decisions is None:
            decisions = []
            for each in self.trace:
                decisions.append(each)
                on_step()
            self._decisions = decisions
        return self._decisions

    @property
    def schema_file(self) -> str:
        """The contextdb.toml of the project."""
        return os.path.join(self.folder, SCHEMA_FILE)

    @property
    def controller(self) -> str:
        """The controller that recorded it; "" where the session does not say."""
        return self.trace.controller

    def weights(self) -> dict[str, float]:
        """The weights of all channels, as they were recorded."""
        weights: dict[str, float] = {}
        for database in self.databases.values():
            for name, weight in zip(database.channel_names, database.weights.tolist(), strict=True):
                weights.setdefault(name, weight)
        return weights

    def thresholds(self) -> dict[str, float]:
        """The thresholds of the databases that have one, as they were at the first search."""
        if not len(self.searches):
            return {}
        choice = self.trace[int(self.searches[0])].choice
        return {} if choice is None else {each.database: each.threshold for each in choice.searches if each.threshold is not None}

    # ---- poses

    def open_banks(self) -> dict[str, PoseBank]:
        """The poses of the databases: saved ones as they are, else made of the clips, which takes its time.

        Raises ContextDBError where they cannot be made.
        """
        if self.config is None or self.project is None:
            return {}
        names = [name for name in self.databases if name in self.config.databases]
        saved = self.saved_banks()
        if set(saved) >= set(names):
            return saved
        assets = {name: table.compile().leaves for name, table in self.project.tables.items()}
        return open_or_build_poses(self.config, self.project.folder, assets, names=names)

    def saved_banks(self) -> dict[str, PoseBank]:
        """The poses that are saved beside the databases and go with them."""
        return saved_poses(self.folder, self.databases) if self.folder else {}

    def strips(self, banks: Mapping[str, PoseBank], on_step: Callable[[], None]) -> Mapping[str, Floats]:
        """What is measured of the session's poses at each update, by the names of `MEASURES`; the poses themselves are stored."""
        decisions = self.decisions(on_step)
        settings = PoseSettings() if self.config is None else self.config.output_of(self.controller)
        warped = list(measure.warped_poses(Watched(decisions, on_step), banks, settings))
        poses = displayed.of_poses([pose for pose, _ in warped], 1.0)
        assert poses.positions is not None, "was just made"
        assert poses.roots is not None, "was just made"
        parents = next(iter(banks.values())).skeleton.parents
        self.displayed = Displayed(poses.positions.astype(np.float32), poses.roots, parents, [warp for _, warp in warped])
        self.measured = strips_of(displayed.with_poses(displayed.of_decisions(decisions), poses).with_contacts(Clips.of(banks)))
        return self.measured


@dataclass(frozen=True, eq=False)
class Displayed:
    """The poses of a session as they are displayed: blended, with feet locked and all else that its settings ask for.

    Attributes
    ----------
    positions : float32 array, shape (T, J, 3)
        Each joint in the world.
    roots : float64 array, shape (T, 3)
    parents : int64 array, shape (J,)
    warps : list of (stride, radians), length T
    """

    positions: NDArray[np.float32]
    roots: Floats
    parents: Ints
    warps: Sequence[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Moment:
    """An update, and the last search before it, or in it, with weights as they are turned now."""

    index: int
    decision: Decision
    search_index: int | None
    searched: Decision | None
    repeated: ReaskedDecision | None
    turned: ReaskedDecision | None
    not_repeated: str

    @classmethod
    def of(cls, recording: Recording, index: int, turned: Turned) -> Moment:
        """The moment of an update."""
        decision, at = recording.trace[index], recording.search_at(index)
        if at is None:
            return cls(index, decision, None, None, None, None, "nothing was searched up to here.")
        searched = decision if at == index else recording.trace[at]
        repeated, why = recording.repeated(at)
        return cls(index, decision, at, searched, repeated, None if repeated is None else turned.of(repeated), why)

    def with_turned(self, turned: Turned) -> Moment:
        """The same with other weights; nothing but the weighing is done again."""
        again = None if self.repeated is None else turned.of(self.repeated)
        return Moment(self.index, self.decision, self.search_index, self.searched, self.repeated, again, self.not_repeated)

    @cached_property
    def landscape(self) -> Landscape:
        """The costs of all frames; empty where the search cannot be repeated."""
        return Landscape({}) if self.turned is None else Landscape(self.turned.searches, self.turned.searched)
