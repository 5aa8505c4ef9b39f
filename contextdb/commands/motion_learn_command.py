"""Learn the weights of channels from what people would have chosen in recorded sessions.

In "contextdb motion debug", + marks an asset that should have been chosen, - one that should not. The choices are in a CSV file
beside the session, session.choices.csv, with the columns tick, asset and choice. The sessions are run again with the learned
weights: how many searches would choose otherwise, and the jumps before and after.

Exits with 1 if better weights were learned and --write is not given.

  contextdb motion learn session.parquet
  contextdb motion learn monday.parquet tuesday.parquet --write
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from contextdb.authoring.weights import weights_change
from contextdb.commands import answer
from contextdb.commands.motion_build_command import MotionProject
from contextdb.commands.motion_replay_command import project_of
from contextdb.commands.progress import building_bar
from contextdb.console import ExitCode, note, printable, terminal_width
from contextdb.disk.boundary import real_path
from contextdb.errors import Fault, MotionError, Place, QueryError, plural
from contextdb.motion import open_or_build
from contextdb.motion.trace.answer_views import what_if_lines
from contextdb.motion.trace.choice_pairs import ChoiceSession, choices_path, read_choices
from contextdb.motion.trace.learning import Learned, learn
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.stock import Stock
from contextdb.motion.trace.text_table import Column, table_lines
from contextdb.motion.trace.what_if import WhatIf, what_if
from contextdb.tables.project import SCHEMA_FILE, Project


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("files", metavar="SESSION", nargs="+", help="a recorded session, a .parquet file")
    parser.add_argument("--project", metavar="FOLDER", help="the project with the databases (default: as recorded)")
    parser.add_argument("--write", action="store_true", help="write the weights into contextdb.toml")
    parser.add_argument("--json", action="store_true", help="a JSON document instead of text")


def run(arguments: argparse.Namespace) -> ExitCode:
    folder, sessions = _sessions(arguments.files, arguments.project)
    learned = learn(sessions)
    weights = learned.of_features if learned.is_better else {}
    effects = {each.file: what_if(each.reasked(), each.reasked(weights)) for each in sessions} if weights else {}
    if arguments.write:
        for features, own in weights.items():
            change = weights_change(Path(folder, SCHEMA_FILE), features, own)
            if change is not None:
                change.write()
    answer(
        arguments,
        lambda: _document(learned, effects, bool(weights), arguments.write),
        lambda: map(printable, _lines(learned, effects, terminal_width())),
    )
    if weights and not arguments.write:
        note("--write writes the weights into contextdb.toml.")
    return ExitCode.FOUND if weights and not arguments.write else ExitCode.OK


def _sessions(files: list[str], project: str | None) -> tuple[str, list[ChoiceSession]]:
    """The folder of the project, and the sessions with their choices. Raises MotionError where there are no choices, and
    ContextDBError where a session cannot be repeated."""
    traces = {file: Trace.load(file) for file in files}
    folders = {}
    for file, trace in traces.items():
        folders[file], why = project_of(trace, project, file)
        if why:
            raise MotionError(Fault(f"the session cannot be searched again: {why}", place=Place(file)))
    if len({real_path(folder) for folder in folders.values()}) > 1:
        raise QueryError(Fault("the sessions are of different projects.", "sessions of one project, or --project FOLDER"))
    preferences = {file: read_choices(file) for file in traces}
    if not any(preferences.values()):
        first = files[0]
        problem = f"nothing says what should have been chosen: there is no choice in {choices_path(first)}."
        accepted = f'the columns tick, asset and choice, + or -; keys + and - of "contextdb motion debug {first}" write them'
        raise MotionError(Fault(problem, accepted, place=Place(first)))
    folder = folders[files[0]]
    motion, tables = MotionProject.load(folder), Project.load(folder)
    names = [name for name in motion.config.databases if any(name in trace.about for trace in traces.values())]
    with building_bar() as progress:
        databases = open_or_build(motion.config, motion.folder, motion.assets, progress, names=names)
    features_of = {name: motion.config.databases[name].features for name in names}
    sessions = []
    for file, trace in traces.items():
        own = {name: each for name, each in databases.items() if name in trace.about}
        sessions.append(ChoiceSession(file, trace, preferences[file], Stock.with_tables(own, tables), features_of))
    return folder, sessions


def _document(learned: Learned, effects: dict[str, WhatIf], is_better: bool, is_written: bool) -> dict[str, object]:
    sessions = [{"file": file, **effect.to_json()} for file, effect in effects.items()]
    return {**learned.to_json(), "better": is_better, "written": is_better and is_written, "sessions": sessions}


def _lines(learned: Learned, effects: dict[str, WhatIf], width: int) -> Iterator[str]:
    searches = f"{learned.searches:,} search{'' if learned.searches == 1 else 'es'}"
    yield f"{plural(learned.choices, 'choice')} at {searches}, {plural(learned.pairs, 'pair')} of frames"
    yield from learned.unusable
    if not effects:
        n, of = learned.now.searches, learned.searches
        yield f"no other weights follow more of them: with the present ones {n:,} of {of:,} searches choose as they should"
        return
    yield ""
    yield from table_lines(
        [
            Column("channel", [each.channel for each in learned.weights], is_key=True),
            Column("features", [each.features for each in learned.weights]),
            Column("weight", [f"{each.now:g}" for each in learned.weights], is_number=True),
            Column("learned", [f"{each.learned:g}" for each in learned.weights], is_number=True),
        ],
        width,
    )
    yield ""
    now, after = learned.now, learned.after
    rows = [("searches", learned.searches, now.searches, after.searches), ("pairs", learned.pairs, now.pairs, after.pairs)]
    if learned.searches > 1:
        rows.append(("pairs held out of the learning", learned.pairs, now.pairs, learned.held_out))
    yield from table_lines(
        [
            Column("as people would choose", [row[0] for row in rows], is_key=True),
            *(Column(name, [f"{row[i]:,}" for row in rows], is_number=True) for i, name in enumerate(("of", "now", "learned"), 1)),
        ],
        width,
    )
    for file, effect in effects.items():
        yield from ("", file, "")
        yield from what_if_lines(effect, width)
