"""Show the decisions of a recorded session: what changed, when, and why; with --at, one decision in full.

Without --at each change has a row, with the cost of playing on and how long the new animation played. --at accepts the tick of an
update, shown in the first column, or a time such as 2.5s.

A session keeps the best candidates of each search. With --at and --name the costs of all assets with that name are computed again
from the databases: those of the project that the session was recorded with, or of --project.

  contextdb motion replay session.parquet
  contextdb motion replay session.parquet --at 2.5s --view pose
  contextdb motion replay session.parquet --name jog
  contextdb motion replay session.parquet --at 2.5s --name jog          why was mine not chosen?
"""

from __future__ import annotations

import argparse
import os
from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path

from contextdb.commands.motion_build_command import MotionProject
from contextdb.commands.motion_stage import add_view
from contextdb.commands.progress import building_bar
from contextdb.console import ExitCode, output, terminal_width
from contextdb.disk import path_in_quotes
from contextdb.errors import ContextDBError, Fault, MotionError, Place, QueryError, in_quotes
from contextdb.motion import MotionDatabase, open_database, open_or_build, saved_path
from contextdb.motion.reading import as_number
from contextdb.motion.selection.decision import Decision, Playing
from contextdb.motion.trace.cost_views import Ranked, View
from contextdb.motion.trace.filter_rows import fingerprint
from contextdb.motion.trace.json_form import decision_json, ranked_json
from contextdb.motion.trace.reasked import reasked, require_known, why_not_asked
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.views import decision_lines, session_lines, summary_line
from contextdb.report.render_json import as_json
from contextdb.tables.project import SCHEMA_FILE, folder_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of the command."""
    parser.add_argument("file", metavar="FILE", help="a recorded session, a .parquet file")
    parser.add_argument("--at", metavar="N|TIME", help="show one decision in full: its tick, or a time such as 2.5s")
    add_view(parser, "with --at: which costs are shown")
    parser.add_argument("--name", metavar="TEXT", default="", help="only assets whose name contains this")
    parser.add_argument("--project", metavar="FOLDER", help="with --name: the project with the databases (default: as recorded)")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Print a session, or one decision of it."""
    if arguments.view and arguments.at is None:
        raise QueryError(Fault("--view shows the costs of one decision.", "--at N|TIME with it, such as --at 2.5s"))
    trace = Trace.load(arguments.file)
    place = None if arguments.at is None else place_of(arguments.at, trace, arguments.file)
    with output():
        if place is None:
            _print_session(trace, arguments)
        else:
            _print_decision(trace, place, arguments)
    return ExitCode.OK


def place_of(text: str, trace: Trace, file: str) -> int:
    """Where the decision is that --at means: of that tick, or the last one at or before that time.

    Raises
    ------
    QueryError
        There is none; with the ticks and times there are.
    """
    ticks = [decision.tick for decision in trace.brief()]
    times_s = [decision.time_s for decision in trace.brief()]
    place = Place(file)
    if not ticks:
        raise QueryError(Fault("the session has no decision.", "one with at least an update", place=place))
    accepted = f"a tick from {ticks[0]} to {ticks[-1]}, or a time from {times_s[0]:.2f}s to {times_s[-1]:.2f}s"
    if text.endswith("s"):
        time_s = _number(text[:-1])
        if time_s is not None and times_s[0] - 0.005 <= time_s <= times_s[-1] + 0.005:
            return max(0, bisect_right(times_s, time_s + 0.005) - 1)
    elif text.isdecimal() and int(text) in ticks:
        return ticks.index(int(text))
    mend = in_quotes(f"{text}s") if _number(text) is not None and not text.isdecimal() else ""
    raise QueryError(Fault(f"there is no decision at {in_quotes(text)}.", accepted, mend, place))


def _number(text: str) -> float | None:
    try:
        return as_number(float(text))
    except ValueError:
        return None


def _print_session(trace: Trace, asked: argparse.Namespace) -> None:
    if asked.json:
        told = [decision for decision in trace.brief() if _is_named(decision.playing, asked.name)]
        document = {"format": 1, "file": asked.file, "decisions": [_brief(decision_json(decision)) for decision in told]}
        print(as_json(document), end="")
        return
    print(summary_line(trace.brief()))
    lines = list(session_lines(trace.brief(), name=asked.name, width=terminal_width()))
    print("", *(lines or [_never_played(trace, asked) if asked.name else "no decision"]), sep="\n")


def _never_played(trace: Trace, asked: argparse.Namespace) -> str:
    """What to say of a name that no playing asset holds, and of one that no asset of the databases holds."""
    databases, why = databases_of(trace, asked.project, asked.file)
    if why:
        return f"nothing whose name contains {in_quotes(asked.name)} plays; {why}"
    try:
        require_known(asked.name, databases, asked.file)
    except MotionError as error:
        return error.faults[0].message
    return f"nothing whose name contains {in_quotes(asked.name)} plays; --at N|TIME with --name shows what it would have cost"


def _is_named(playing: Playing | None, name: str) -> bool:
    return not name or (playing is not None and name.casefold() in playing.asset.casefold())


def _brief(decision: dict[str, object]) -> dict[str, object]:
    """A decision without what only --at tells."""
    return {key: value for key, value in decision.items() if key not in ("query", "candidates")}


def _print_decision(trace: Trace, place: int, asked: argparse.Namespace) -> None:
    decision, events = trace[place], trace.events(place)
    ranked, why = _asked(trace, decision, asked) if asked.name else (None, "")
    if asked.json:
        again = (
            {} if not asked.name else {"asked": None if ranked is None else ranked_json(ranked, events), "not_asked": why or None}
        )
        print(as_json({"format": 1, "file": asked.file, **decision_json(decision, events), **again}), end="")
        return
    view = View(asked.view or View.SUMMARY)
    lines = decision_lines(decision, view, name=asked.name, events=events, width=terminal_width(), asked=ranked)
    print(*lines, sep="\n")
    if why:
        print(f"\nof the candidates that the session keeps alone: {why}")


def _asked(trace: Trace, decision: Decision, asked: argparse.Namespace) -> tuple[list[Ranked] | None, str]:
    """The best frame of each range whose asset's name holds --name; None, and why, where they cannot be worked out."""
    databases, why = databases_of(trace, asked.project, asked.file)
    why = why or why_not_asked(decision, trace.about, databases)
    if why:
        return None, why
    require_known(asked.name, databases, asked.file)
    return reasked(decision, databases, asked.name), ""


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
    """The folder of the project that a session was recorded with, or of the one that is given; or why there is none."""
    if project is not None:
        return project, ""
    said = {str(about["project"]) for about in trace.about.values() if "project" in about}
    if not said:
        return "", "the session does not say which project it was recorded with; give it with --project FOLDER."
    folder = os.path.normpath(os.path.join(os.path.dirname(file), said.pop()))
    if not os.path.isfile(os.path.join(folder, SCHEMA_FILE)):
        return "", f"its project is no longer at {path_in_quotes(folder)}; give it with --project FOLDER."
    return folder, ""


def _saved(path: Path, about: Mapping[str, object]) -> MotionDatabase | None:
    """A saved database, if it is the one that was recorded."""
    try:
        database = open_database(path)
    except ContextDBError:
        return None
    return database if fingerprint(database) == about.get("digest") else None
