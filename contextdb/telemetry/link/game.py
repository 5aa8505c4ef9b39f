"""A link: a running game publishes what it asks and picks, to those that listen on the same machine.

Games get one from `contextdb.link`, which hands it what makes plain data of decisions.
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable, Sequence
from pathlib import Path

from contextdb.cells.arguments import require_number, require_path, require_row, require_text, require_whole
from contextdb.compiled.table import CompiledTable
from contextdb.errors import ContextError, Fault, FileError, Place
from contextdb.telemetry.link import doors
from contextdb.telemetry.link.doors import require_name
from contextdb.telemetry.link.feed import Decisions, Feed, Picked, Posed, Watcher, Who
from contextdb.telemetry.link.lines import cut_name
from contextdb.telemetry.link.listeners import FileListener
from contextdb.telemetry.link.watched import Watched, has_decisions
from contextdb.telemetry.link.writer import Writer

PER_SECOND = 30.0
RECORDING = ".jsonl"
"""What the file of a recording ends in."""

_links: weakref.WeakSet[Link] = weakref.WeakSet()
"""The open links: a process that is forked off lets go of them."""


def open_link(name: str, record: str | Path | None, per_second: float, decisions: Callable[[], Decisions]) -> Link:
    """What `contextdb.link` gives; `decisions` loads what makes plain data of decisions, when the first is to be published."""
    require_name(name)
    if not 1.0 <= require_number(per_second, "per_second") <= 60.0:
        raise ContextError(Fault(f"per_second is {per_second:g}.", "a number from 1 to 60"))
    file = None if record is None else new_recording(require_path(record, "record"))
    door = None
    try:
        door = doors.opened(name)
        return Link(door, file, 1.0 / per_second, decisions)
    except BaseException:
        if file is not None:
            file.close()
        if door is not None:
            door.close()
        raise


def new_recording(path: Path) -> FileListener:
    """A new file for lines. Raises FileError where it does not end in .jsonl, is there already, or cannot be written."""
    place = Place(str(path))
    if path.suffix != RECORDING:
        raise FileError(Fault("a recording does not end so.", f"a name that ends in {RECORDING}", place=place))
    try:
        return FileListener(path, path.open("xb"))
    except FileExistsError:
        raise FileError(Fault("the file is there already.", "a new file", place=place)) from None
    except OSError as error:
        raise FileError(Fault(f"the file cannot be written: {error.strerror}.", "an existing folder", place=place)) from None


class Link:
    """What a game watches by. Get one from `contextdb.link`; close it, or use it in a `with`.

    While nobody listens, a question tests one flag more. While somebody does, the game's thread puts a tuple into a queue for each
    question; all else is done in the link's own thread.
    """

    def __init__(self, door: doors.Door, file: FileListener | None, every_s: float, decisions: Callable[[], Decisions]) -> None:
        self.name = door.name
        """What the game is called: the name that was requested, or that with a number."""
        self._feed = Feed()
        self._watched = Watched(self._feed)
        self._writer = Writer(door, self._watched, file, every_s)
        self._decisions = decisions
        self._is_closed = False
        _links.add(self)

    @property
    def is_heard(self) -> bool:
        """Whether somebody listens now, or a file takes the lines."""
        return self._feed.is_open

    def watch(self, what: object, who: Who = None) -> None:
        """Publish what something is asked, and what is picked or decided, from now on.

        Parameters
        ----------
        what : CompiledTable, LiveContext, Controller, Character, Watch or mapping of CompiledTable, or a sequence of them
            A folder that is watched for changes, `cdb.watch(folder)`, stays watched when its tables are exchanged. Tables, live
            contexts and controllers that the game lets go are watched no more. Of a sequence, such as a Crowd or ControllerGroup,
            those that are in it now are watched, as "WHO 0", "WHO 1" and so on where `who` is a name.
        who : str or function, optional
            The character that asks; a function gives it, and is called in each question. Who watches again, renames.

        Raises
        ------
        ContextError
            It is none of these, another link watches it, or the link is closed.
        """
        if isinstance(what, Sequence) and not isinstance(what, str):
            for i, each in enumerate(what):
                self.watch(each, f"{who} {i}" if isinstance(who, str) else who)
            return
        if self._is_closed:
            raise ContextError(Fault("the link is closed.", "an open link"))
        if who is not None and not callable(who):
            who = cut_name(require_text(who, "who"))
        if has_decisions(what):
            self._load_decisions()
        with self._writer.lock:
            self._watched.watch(what, who)

    def tell(self, who: str | None, decision: object) -> None:
        """Publish the decision of a controller that is not watched, or the choice of a selector. Raises ContextError where it is
        neither."""
        if not self._load_decisions().is_decision(decision):
            problem = f"a link cannot publish what is of type {type(decision).__name__}."
            raise ContextError(Fault(problem, "the Decision of a controller, or the Choice of a selector"))
        if self._feed.is_open:
            Watcher(self._feed, who).decided(decision)

    def picked(self, table: CompiledTable, who: str | None, row: int | None) -> None:
        """Publish the row that a character plays though no picker picked it, such as that of the frame that a search chose; None or
        -1 for none. It belongs to the character's last question. Raises ContextError where the table has no such row."""
        if not isinstance(table, CompiledTable):
            raise ContextError(Fault(f"a row of {type(table).__name__} is published.", "a compiled table"))
        at = None if row is None or require_whole(row, "row") == -1 else require_row(row, table.n_rows)
        if self._feed.is_open:
            with self._writer.lock:
                source = self._watched.source_of(table)
            self._feed.put(who, source, Picked(at, table.fallback if at is None else table.assets[at]))

    def pose(self, who: str | None, pose: object, rig: object) -> None:
        """Publish a pose to those who listen for poses: the bones once, then where they are.

        Parameters
        ----------
        who : str or None
        pose : Pose
            Such as `updated.pose` of a character; the newest is sent.
        rig : PoseBank
            What it is a pose of: `character.stream.rig`.

        Raises
        ------
        ContextError
            An argument of another type.
        """
        if not self._load_decisions().is_pose(pose, rig):
            problem = f"a link cannot publish {type(pose).__name__} of {type(rig).__name__}."
            raise ContextError(Fault(problem, "a Pose, and the PoseBank of its rig"))
        name = None if who is None else cut_name(require_text(who, "who"))
        if self._feed.wants_poses:
            self._feed.put(name, None, Posed(pose, rig))

    def close(self) -> None:
        """Publish no more. What was watched is what it was before."""
        if not self._is_closed:
            self._is_closed = True
            _links.discard(self)
            self._writer.close()
            self._watched.forget()

    def __enter__(self) -> Link:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Link {self.name!r}: {'closed' if self._is_closed else 'heard' if self.is_heard else 'nobody listens'}>"

    def _load_decisions(self) -> Decisions:
        """What makes plain data of decisions; loaded when the first is to be published, and not in a frame."""
        if self._writer.decisions is None:
            self._writer.decisions = self._decisions()
        return self._writer.decisions

    def _forked(self) -> None:
        self._is_closed = True
        self._writer.drop()
        self._watched.forget()


def _let_go() -> None:
    """In a process that was forked off: its copies of links are closed, the game's own stay."""
    for each in list(_links):
        each._forked()
    _links.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)
