"""Show the decisions of a recorded session: what changed, when, and why; with --at, one decision in full.

Candidates and costs are computed again from the databases: those of the project that the session was recorded with, or of
--project. --what-if takes weights, biases and thresholds: "LeftFoot velocity=2", "continuing=-0.1" (or base, looping), "threshold
jog_tired=3".

  contextdb motion replay session.parquet
  contextdb motion replay session.parquet --at 2.5s --why jog           why was mine not chosen?
  contextdb motion replay session.parquet --what-if "LeftFoot velocity=2"
  contextdb motion replay session.parquet --format html -o session.html plays in any browser
  contextdb motion replay new.parquet --diff old.parquet --html both.html --markdown
"""

from __future__ import annotations

import argparse
import json
import os
from bisect import bisect_right
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from contextdb.commands import add_page_arguments, answer, take_page_arguments
from contextdb.commands.motion_build_command import MotionProject, warn
from contextdb.commands.motion_page import Played, comment_of, page_file, rerun_file, write_page, write_rerun
from contextdb.commands.motion_stage import add_view
from contextdb.commands.numbers import number_of
from contextdb.commands.progress import building_bar
from contextdb.console import ExitCode, output, terminal_width
from contextdb.disk import path_in_quotes, write_atomic
from contextdb.disk.boundary import is_below, work_tree
from contextdb.errors import ContextDBError, Fault, FileError, MotionError, Place, QueryError, in_quotes, nearest, some
from contextdb.motion import MotionDatabase, open_or_build
from contextdb.motion.measuring.measure import warped_poses
from contextdb.motion.search.filters import Biases
from contextdb.motion.selection.decision import Decision, Playing
from contextdb.motion.storage.building import saved_path
from contextdb.motion.storage.pose_files import saved_poses
from contextdb.motion.storage.stored import open_database
from contextdb.motion.trace.answer_views import diff_lines, stats_lines, what_if_lines, why_lines
from contextdb.motion.trace.chrome_trace import chrome_trace
from contextdb.motion.trace.cost_views import Ranked, View, decision_json, ranked_json
from contextdb.motion.trace.filter_rows import is_recorded
from contextdb.motion.trace.reasked import Changes, Reasked, require_known, why_not_asked
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.status import Status, status_of
from contextdb.motion.trace.stock import Stock
from contextdb.motion.trace.views import NOTHING_FORCED, decision_lines, look_first, session_lines, summary_line
from contextdb.motion.trace.what_if import what_if
from contextdb.motion.trace.why_not import WhyNot
from contextdb.tables.project import SCHEMA_FILE, Project, folder_of

Json = dict[str, object]
WARP_S = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="a recorded session, a .parquet file")
    parser.add_argument("--at", metavar="N|TIME", help="show one decision in full: its tick, or a time such as 2.5s")
    add_view(parser, "with --at: which costs to print")
    parser.add_argument("--name", metavar="TEXT", default="", help="only assets whose name contains this")
    parser.add_argument("--why", metavar="ASSET", help="with --at: why this asset was not chosen, and what would have to change")
    parser.add_argument("--stats", action="store_true", help="jumps, gains, causes, stay, and what never plays")
    parser.add_argument(
        "--what-if", metavar="NAME=VALUE", action="append", default=[], help="with this weight, bias or threshold; may be repeated"
    )
    parser.add_argument("--diff", metavar="OTHER", help="where this session and another one diverge")
    parser.add_argument("--trace", metavar="OUT", help="write a Chrome trace, a .json file that Perfetto opens")
    parser.add_argument("--rrd", metavar="OUT", help="write a .rrd file for the Rerun viewer; needs the extra rerun")
    parser.add_argument("--html", metavar="OUT", help="write a page that plays the session, with --diff both side by side")
    parser.add_argument("--markdown", action="store_true", help="the comment of a review: measures, and what changed")
    parser.add_argument("--project", metavar="FOLDER", help="the project with the databases (default: as recorded)")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")
    add_page_arguments(parser, ("text", "json", "markdown", "html"))


def run(arguments: argparse.Namespace) -> ExitCode:
    """Print a session, or one decision of it."""
    take_page_arguments(arguments)
    if arguments.at is None:
        for option, given, shows in (("--view", arguments.view, "the costs of"), ("--why", arguments.why, "an asset in")):
            if given is not None:
                raise QueryError(Fault(f"{option} shows {shows} one decision.", "--at N|TIME with it, such as --at 2.5s"))
    if arguments.markdown and (arguments.json or arguments.at is not None):
        raise QueryError(Fault("--markdown is of a whole session.", "--markdown without --json and --at"))
    page = None if arguments.html is None else page_file(arguments.html)
    recording = None if arguments.rrd is None else rerun_file(arguments.rrd)
    replay = Replay(Trace.load(arguments.file), arguments)
    other = None if arguments.diff is None else Trace.load(arguments.diff)
    if page is not None or arguments.markdown:
        sessions = [_played(replay), *([] if other is None else [_played(Replay(other, arguments, arguments.diff))])]
        if page is not None:
            write_page(page, sessions)
        if arguments.markdown:
            with output():
                print(comment_of(sessions, arguments.html), end="")
            return ExitCode.OK
    if recording is not None:
        write_rerun(recording, _played(replay))
    place = None if arguments.at is None else place_of(arguments.at, replay.trace, arguments.file)
    parts = list(_parts(replay, other))
    if arguments.trace is not None:
        _write_trace(replay.trace, Path(arguments.trace))
    if place is not None:
        parts.insert(0, _FullDecision.of(replay, place).part())
    if not parts:
        parts.append(_session(replay) if page is None else ({}, [summary_line(replay.trace.brief())]))
    merged = {"file": arguments.file} | {key: value for document, _ in parts for key, value in document.items()}
    answer(arguments, lambda: merged, lambda: ["\n\n".join("\n".join(lines) for _, lines in parts)])
    return ExitCode.OK


Part = tuple[Json, list[str]]
"""An answer, as JSON and as lines of text."""


@dataclass(eq=False)
class Replay:
    """A session, the options of the command, and, where that is needed, its databases."""

    trace: Trace
    options: argparse.Namespace
    of_file: str = ""
    missing: str = field(default="", init=False)

    @property
    def file(self) -> str:
        return self.of_file or str(self.options.file)

    @cached_property
    def databases(self) -> dict[str, MotionDatabase]:
        """The databases of the session's project; `missing` says why some are not what was recorded."""
        try:
            databases, why = databases_of(self.trace, self.options.project, self.file)
        except ContextDBError as error:
            if self.options.project is not None:
                raise
            databases, why = {}, str(error.faults[0])
        note = self.trace.use(databases)
        self.missing = why or note
        return databases

    def reasked(self, changes: Changes | None = None, *, with_tables: bool = False) -> Reasked:
        """The session searched again in its databases, and looked up again in the project's tables."""
        stock = Stock(self.databases)
        folder, why = project_of(self.trace, self.options.project, self.file)
        if with_tables and not why:
            stock = Stock.with_tables(self.databases, Project.load(folder))
        return Reasked(self.trace, self.trace.about, stock, changes or {})

    def require_databases(self) -> None:
        """Raise MotionError where the session cannot be searched again, with the reason."""
        if not self.databases or self.missing:
            raise MotionError(Fault(f"the session cannot be searched again: {self.missing}", place=Place(self.options.file)))


def _played(replay: Replay) -> Played:
    folder, why = project_of(replay.trace, replay.options.project, replay.file)
    if why:
        raise MotionError(Fault(f"its poses cannot be made: {why}", place=Place(replay.file)))
    databases = replay.databases
    if replay.missing:
        warn([f"{replay.file}: no candidates are listed: {replay.missing}"])
    return Played(replay.file, replay.trace, folder, replay.trace.databases if databases else {})


def _parts(replay: Replay, other: Trace | None) -> Iterator[Part]:
    options, trace, width = replay.options, replay.trace, terminal_width()
    if options.stats:
        stats = trace.stats()
        yield {"stats": stats.to_json()}, [*_heading(trace), "", *stats_lines(stats, width)]
    if options.what_if:
        replay.require_databases()
        comparison = what_if(replay.reasked(), replay.reasked(changes_of(options.what_if, replay.databases)))
        yield {"what_if": comparison.to_json()}, list(what_if_lines(comparison, width))
    if other is not None:
        diff = trace.diff(other)
        yield {"diff": {"file": options.diff, **diff.to_json()}}, list(diff_lines(diff, width))


def _write_trace(trace: Trace, path: Path) -> None:
    place = Place(str(path))
    if path.suffix != ".json":
        raise FileError(Fault("a Chrome trace cannot be written to such a file.", "a name that ends in .json", place=place))
    if not os.path.isdir(path.parent):
        fault = f"there is no folder {path_in_quotes(path.parent)}."
        raise FileError(Fault(fault, "an existing folder", place=place, rule="no-such-path"))
    write_atomic(path, (json.dumps(chrome_trace(trace.brief())) + "\n").encode())


def place_of(text: str, trace: Trace, file: str) -> int:
    """Where the decision is that --at means: of that tick, or the last one at or before that time. Raises QueryError, with the
    ticks and times there are, where there is none."""
    ticks = [decision.tick for decision in trace.brief()]
    times_s = [decision.time_s for decision in trace.brief()]
    place = Place(file)
    if not ticks:
        raise QueryError(Fault("the session has no decision.", "one with at least an update", place=place))
    accepted = f"a tick from {ticks[0]} to {ticks[-1]}, or a time from {times_s[0]:.2f}s to {times_s[-1]:.2f}s"
    if text.endswith("s"):
        time_s = number_of(text[:-1])
        if time_s is not None and times_s[0] - 0.005 <= time_s <= times_s[-1] + 0.005:
            return max(0, bisect_right(times_s, time_s + 0.005) - 1)
    elif text.isdecimal() and int(text) in ticks:
        return ticks.index(int(text))
    seconds = None if text.isdecimal() else number_of(text)
    mend = in_quotes(f"{text}s") if seconds is not None and times_s[0] <= seconds <= times_s[-1] else ""
    raise QueryError(Fault(f"there is no decision at {in_quotes(text)}.", accepted, mend, place))


def _heading(trace: Trace) -> list[str]:
    """A session in a line, and where to look first."""
    return [summary_line(trace.brief()), look_first(trace.brief()) or NOTHING_FORCED]


def _session(replay: Replay) -> Part:
    trace, options = replay.trace, replay.options
    if options.json:
        decisions = [decision for decision in trace.brief() if _is_named(decision.playing, options.name)]
        first = look_first(trace.brief()) or None
        return {"look_first": first, "decisions": [_brief(decision_json(decision)) for decision in decisions]}, []
    lines = list(session_lines(trace.brief(), name=options.name, width=terminal_width()))
    return {}, [*_heading(trace), "", *(lines or [_never_played(replay) if options.name else "no decision"])]


def _never_played(replay: Replay) -> str:
    """What to say of a name that no playing asset holds, and of one that no asset of the databases holds."""
    name, databases = replay.options.name, replay.databases
    if not databases:
        return f"nothing whose name contains {in_quotes(name)} plays; {replay.missing}"
    try:
        require_known(name, databases, replay.options.file)
    except MotionError as error:
        return error.faults[0].message
    return f"nothing whose name contains {in_quotes(name)} plays; --at N|TIME with --name shows what it would have cost"


def _is_named(playing: Playing | None, name: str) -> bool:
    return not name or (playing is not None and name.casefold() in playing.asset.casefold())


def _brief(decision: Json) -> Json:
    """A decision without what only --at tells."""
    return {key: value for key, value in decision.items() if key not in ("query", "candidates")}


@dataclass(frozen=True, eq=False)
class _FullDecision:
    """One decision, in full: with its candidates, the answers to --name and --why, and why something cannot be computed again."""

    replay: Replay
    place: int
    decision: Decision
    ranked: list[Ranked] | None
    why_not: WhyNot | None
    not_computed: str

    @classmethod
    def of(cls, replay: Replay, place: int) -> _FullDecision:
        """The decision at a place of the session."""
        options, trace, databases = replay.options, replay.trace, replay.databases
        decision = trace[place]
        needs = bool(options.name) or (
            decision.searched and decision.together is None and trace.n_candidates > 0 and not decision.candidates
        )
        not_computed = (replay.missing or why_not_asked(decision, trace.about, databases)) if needs else ""
        ranked, why_not = None, None
        if options.name and not not_computed:
            require_known(options.name, databases, options.file)
            ranked = replay.reasked()[place].best_of_assets(options.name)
        if options.why is not None:
            replay.require_databases()
            why_not = replay.reasked(with_tables=True).why_not(place, options.why)
        return cls(replay, place, decision, ranked, why_not, not_computed)

    def part(self) -> Part:
        """The decision as JSON, or as lines of text."""
        return (self._json(), []) if self.replay.options.json else ({}, list(self._lines()))

    def _json(self) -> Json:
        options, events = self.replay.options, self.replay.trace.events(self.place)
        again: Json = {}
        if options.name:
            again["asked"] = None if self.ranked is None else ranked_json(self.ranked, events)
        if options.name or self.not_computed:
            again["not_asked"] = self.not_computed or None
        if self.why_not is not None:
            again["why_not"] = self.why_not.to_json()
        return {**decision_json(self.decision, events), "status": self._status().to_json(), **again}

    def _status(self) -> Status:
        """Speeds and angles; with stride and warp where the poses are saved."""
        trace, place, databases = self.replay.trace, self.place, self.replay.databases
        known = {} if self.replay.missing else databases
        last = trace[place - 1] if place else None
        return status_of(self.decision, last, known, self._warp(known) if known else None)

    def _warp(self, databases: Mapping[str, MotionDatabase]) -> tuple[float, float] | None:
        """Those of the pose that was displayed; what was longer ago than `WARP_S` has faded out of it."""
        trace = self.replay.trace
        folder, _ = project_of(trace, self.replay.options.project, self.replay.file)
        banks = saved_poses(folder, databases)
        if len(banks) < len(databases):
            return None
        times_s = trace.columns(["time_s"])["time_s"].to_numpy()
        first = int(np.searchsorted(times_s, times_s[self.place] - WARP_S))
        settings = MotionProject.load(folder).config.output_of(trace.controller)
        return deque((warp for _, warp in warped_poses(trace[first : self.place + 1], banks, settings)), 1)[0]

    def _lines(self) -> Iterator[str]:
        options, width = self.replay.options, terminal_width()
        if self.why_not is not None:
            yield f"tick {self.decision.tick:,} at {self.decision.time_s:.2f} s: {self.decision.action}"
            yield from why_lines(self.why_not, width)
            return
        view, events = View(options.view or View.SUMMARY), self.replay.trace.events(self.place)
        yield from decision_lines(self.decision, view, name=options.name, events=events, width=width, ranked=self.ranked)
        if self.not_computed:
            held = (
                "only the candidates that the session keeps are listed" if self.decision.candidates else "no candidates are listed"
            )
            yield from ("", f"{held}: {self.not_computed}")


def databases_of(trace: Trace, project: str | None, file: str) -> tuple[dict[str, MotionDatabase], str]:
    """The databases that a session was recorded with, from the project's folder, or why there are none.

    A saved database that is the one which was recorded is opened without a look at the clips.
    """
    folder, why = project_of(trace, project, file)
    if why:
        return {}, why
    opened = {name: _saved(saved_path(folder_of(Path(folder)), name), about) for name, about in trace.about.items()}
    if all(opened.values()):
        return {name: database for name, database in opened.items() if database is not None}, ""
    motion = MotionProject.load(folder)
    names = [name for name in trace.about if name in motion.config.databases]
    with building_bar() as progress:
        return open_or_build(motion.config, motion.folder, motion.assets, progress, names=names), ""


def project_of(trace: Trace, project: str | None, file: str) -> tuple[str, str]:
    """The folder of the project that a session was recorded with, or of the one that is given; or why there is none.

    A session may come with a clone: the project that it names is used where it is in the same work tree of git; without git, in the
    folder of the session, or in the project in which the session is.
    """
    if project is not None:
        return project, ""
    projects = {str(about["project"]) for about in trace.about.values() if "project" in about}
    if not projects:
        return "", "the session does not say which project it was recorded with; give it with --project FOLDER."
    own, named = os.path.dirname(file), projects.pop()
    folder = os.path.normpath(os.path.join(own, named))
    is_relative = not os.path.isabs(named)  # as they are written; an absolute one could name another machine
    if is_relative and not os.path.isfile(os.path.join(folder, SCHEMA_FILE)):
        return "", f"its project is no longer at {path_in_quotes(folder)}; give it with --project FOLDER."
    if not is_relative or not is_below(Path(os.path.realpath(folder)), work_tree(Path(own))):
        return "", f"its project {path_in_quotes(folder)} is not in the folder of the session; give it with --project FOLDER."
    return folder, ""


def _saved(path: Path, about: Mapping[str, object]) -> MotionDatabase | None:
    """A saved database, if it is the one that was recorded."""
    try:
        database = open_database(path)
    except ContextDBError:
        return None
    return database if is_recorded(about, database) else None


# ---- what `motion replay --what-if` changes: NAME=VALUE as weights of channels, biases of databases, and thresholds

BIASES = ("base", "continuing", "looping")
THRESHOLD = "threshold "
ACCEPTED = 'NAME=VALUE, such as "LeftFoot velocity=2", "continuing=-0.1" or "threshold jog_tired=3"'
MOST = 1e9


def changes_of(texts: Sequence[str], databases: Mapping[str, MotionDatabase]) -> Changes:
    """The changes that some texts mean. Raises QueryError for a text that is no NAME=VALUE, a name that there is not, with the
    nearest, or a value that is no number."""
    channels = list(dict.fromkeys(name for each in databases.values() for name in each.channel_names))
    known = [*channels, *BIASES, *(f"{THRESHOLD}{name}" for name in databases)]
    weights: dict[str, float] = {}
    biases: dict[str, float] = {}
    thresholds: dict[str, float | None] = {}
    for text in texts:
        name, value = _read(text, known)
        if name in channels and value < 0.0:
            raise QueryError(Fault(f"the weight of {in_quotes(name)} is {value:g}.", "a number, 0 or more"))
        if name in channels:
            weights[name] = value
        elif name in BIASES:
            biases[name] = value
        else:
            thresholds[name.removeprefix(THRESHOLD)] = value
    of_each: dict[str, Biases] = {name: replace(each.biases, **biases) for name, each in databases.items()} if biases else {}
    return {"weights": weights, "biases": of_each, "thresholds": thresholds}


def _read(text: str, known: Sequence[str]) -> tuple[str, float]:
    name, equals, number = (part.strip() for part in text.rpartition("="))
    if not equals or not name:
        raise QueryError(Fault(f"{in_quotes(text)} is not a change.", ACCEPTED))
    if name not in known:
        near = nearest(name, known)
        fault = f"there is no channel, bias or threshold {in_quotes(name)}."
        raise QueryError(Fault(fault, some(known), in_quotes(f"{near}={number}") if near else ""))
    value = number_of(number)
    if value is None or abs(value) > MOST:
        raise QueryError(Fault(f"{in_quotes(number)} is not a number.", ACCEPTED))
    return name, value
