"""Show the best frames of one database for a pose and a desired path, with what each channel and bias adds to their cost.

With facts, only the assets that the database's table says are valid may play. Exits with 1 if nothing may.

  contextdb motion search game/ loco --query walk@1.5 --speed 1.3 --turn 30
  contextdb motion search game/ loco gait=Walk speed=1.3 direction=0 style=tired --query walk@1.5 --view pose
  contextdb motion search game/ loco --query walk@1.5 --speed 3 --name jog
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contextdb.cells.facts import Fact
from contextdb.commands import answer
from contextdb.commands.motion_stage import Stage, add_query_arguments, add_view, context_text
from contextdb.compiled.matches import Matches
from contextdb.console import ExitCode, printable, terminal_width
from contextdb.errors import in_quotes, plural
from contextdb.motion import MotionDatabase
from contextdb.motion.features.extraction import Features
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.trace.cost_views import Ranked, View, candidate_lines, candidates_json
from contextdb.motion.trace.views import left_out_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or its contextdb.toml")
    parser.add_argument("database", metavar="DATABASE", help="the name of a [databases.NAME]")
    add_query_arguments(parser)
    add_view(parser, "which costs to print", View.SUMMARY)
    parser.add_argument("--name", metavar="TEXT", default="", help="only assets whose name contains this, chosen or not")


def run(arguments: argparse.Namespace) -> ExitCode:
    stage = Stage.of(arguments.path, lambda config: [config.database(arguments.database).name])
    name = stage.config.database(arguments.database).name
    valid, facts = stage.valid([name], arguments.facts, arguments.unknown)
    query = stage.query(arguments.query, [name], arguments)
    candidates = _candidates(stage.databases[name], query, valid.get(name), arguments)
    n_free = stage.databases[name].n_frames - sum(candidates.counts.values())
    answer(
        arguments,
        lambda: {"context": context_text(facts), "frames": n_free, **_document(stage, name, candidates)},
        lambda: _lines(stage, name, candidates, facts, valid.get(name), n_free, arguments),
    )
    return ExitCode.OK if n_free else ExitCode.FOUND


def _candidates(database: MotionDatabase, query: Features, valid: Matches | None, options: argparse.Namespace) -> Candidates:
    """The best frames; of assets whose name contains --name, those that may not be chosen too."""
    if not options.name:
        return database.candidates(query, options.k, valid, left_out=options.left_out, tags=options.tags)
    counts = database.candidates(query, 0, valid, tags=options.tags).counts
    is_named = np.array([options.name.casefold() in asset.casefold() for asset in database.assets], np.bool_)
    others = np.where(is_named, 0.0, np.inf)  # no other frame comes before the wanted ones
    candidates = database.candidates(query, options.k, valid, left_out=True, tags=options.tags, penalties=others)
    return replace(candidates, rows=tuple(row for row in candidates if is_named[row.range]), counts=counts)


def _events(stage: Stage, name: str, candidates: Candidates) -> dict[tuple[str, int], tuple[str, ...]]:
    return {(name, row.frame): stage.databases[name].marks.events(row.frame) for row in candidates}


def _document(stage: Stage, name: str, candidates: Candidates) -> dict[str, object]:
    return candidates_json(name, candidates, _events(stage, name, candidates))


def _lines(
    stage: Stage,
    name: str,
    candidates: Candidates,
    facts: dict[str, Fact],
    valid: Matches | None,
    n_free: int,
    options: argparse.Namespace,
) -> Iterator[str]:
    if valid is not None:
        table = printable(str(stage.config.databases[name].table))
        has_mirror = valid.mirrored is not valid and bool(stage.databases[name].mirrored.any())
        mirrored = f", {len(valid.mirrored):,} mirrored" if has_mirror else ""
        yield f"{len(valid):,} of {plural(valid.n_rows, 'row')} valid in {table}{mirrored}"
    yield f"{n_free:,} of {plural(stage.databases[name].n_frames, 'frame')} of {printable(name)} may play"
    if candidates.counts:
        yield f"left out: {left_out_text(candidates)}"
    rows = [Ranked(rank, name, row) for rank, row in enumerate(candidates, 1)]
    yield ""
    if rows:
        yield from candidate_lines(rows, View(options.view), _events(stage, name, candidates), terminal_width())
    elif options.name:
        yield f"no asset's name contains {in_quotes(options.name)}"
    else:
        yield "nothing may play"
