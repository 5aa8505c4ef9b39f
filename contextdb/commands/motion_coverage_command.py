"""Measure where in speed, turn and direction the clips have nothing, for each set of clips that a table lets play at once.

Mirrored clips count, by mirrored facts. Also: which clip to capture next, clips that never play, and clips that are near another.

Exits with 1 if --fail-under is missed, or if clips fill a movement in fewer contexts than in the --baseline; with 2 for bad use.

  contextdb motion coverage game/
  contextdb motion coverage game/ --format html -o motion.html
  contextdb motion coverage game/ --format json -o motion.json
  contextdb motion coverage game/ --baseline motion.json --fail-under 80
  contextdb motion coverage game/ --axis speed=wanted_speed --axis direction=move_direction
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

from contextdb.commands import add_format_arguments
from contextdb.commands.coverage_command import earlier_report, percent
from contextdb.commands.motion_build_command import MotionProject
from contextdb.commands.numbers import number_type
from contextdb.commands.progress import building_bar
from contextdb.console import ExitCode, note, output, terminal_width, wants_colour
from contextdb.covering.motion import motion_coverage
from contextdb.disk import write_atomic
from contextdb.errors import ContextError, Fault, in_quotes, mend_for, some
from contextdb.motion.measuring.near_clips import NEAR_COST
from contextdb.motion.measuring.transition_names import PATTERN
from contextdb.motion.storage.building import open_or_build
from contextdb.report import formats, render
from contextdb.report.motion_coverage_results import (
    BASELINE,
    Earlier,
    MotionCoverageResults,
    MotionMeasured,
    fail_under,
    lost_since,
    no_loss,
    read_baseline,
    table_gone,
)
from contextdb.report.motion_coverage_text import render_context
from contextdb.tables.project import Project


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="FOLDER", help="a folder of tables with motion databases")
    add_format_arguments(parser, formats("motion coverage"))
    parser.add_argument("-o", "--output", metavar="FILE", help="write the report to a file")
    parser.add_argument("--fail-under", type=percent, metavar="PCT", help="fail if the covered percentage of any table is lower")
    parser.add_argument("--baseline", metavar="FILE", help="compare with the JSON of an earlier run; a lost movement fails")
    parser.add_argument("--context", metavar="ID", help="show the maps of one set of contexts, by its id")
    parser.add_argument("--all", action="store_true", help="list every hole, every context, and every clip")
    parser.add_argument(
        "--axis", metavar="AXIS=CONDITION", action="append", help="what asks for speed, turn or direction; may be repeated"
    )
    told = f"names of transitions, such as {PATTERN} (default: as the project says, else that)"
    parser.add_argument("--transitions", metavar="PATTERN", help=told)
    told = f"the cost under which a clip is near another (default: {NEAR_COST})"
    cost = number_type(f"a cost. Accepted: a number from 0 up, such as {NEAR_COST}.")
    parser.add_argument("--near", metavar="COST", type=cost, default=NEAR_COST, help=told)


def run(arguments: argparse.Namespace) -> ExitCode:
    if arguments.context is not None and (arguments.format != "text" or arguments.baseline or arguments.fail_under is not None):
        raise ContextError(Fault("--context is text about some contexts; other formats and bars do not go with it."))
    earlier = earlier_report(arguments.baseline, read_baseline, BASELINE) if arguments.baseline else None
    results = _results(arguments, earlier)
    colour, width = wants_colour(sys.stdout) and not arguments.output, terminal_width()
    if arguments.context is not None:
        text = _context(results, arguments.context, colour, width)
    else:
        text = render(arguments.format, results, colour=colour, width=width, shows_all=arguments.all)
    if arguments.output:
        write_atomic(Path(arguments.output), text.encode("utf-8", "backslashreplace"))
    else:
        with output():
            print(text, end="")
    return ExitCode.OK if results.passed else ExitCode.FOUND


def _results(arguments: argparse.Namespace, earlier: Mapping[str, Earlier] | None) -> MotionCoverageResults:
    project = MotionProject.load(arguments.path)
    with building_bar() as progress:
        databases = open_or_build(project.config, project.folder, project.assets, progress)
    with building_bar("comparing clips") as progress:
        tables = Project.load(arguments.path)
        pattern = tables.schema.transitions or PATTERN if arguments.transitions is None else arguments.transitions
        found = motion_coverage(
            tables,
            databases,
            axes=_axes(arguments.axis or []),
            pattern=pattern,
            near_cost=arguments.near,
            progress=progress,
        )
    if joint := [name for name, settings in project.config.databases.items() if settings.roles]:
        note(f"left out: the joint clips of {some(joint)}: they follow no stick.")
    measured = []
    for motion in found.tables:
        gates = [] if arguments.fail_under is None else [fail_under(motion, arguments.fail_under)]
        lost = lost_since(motion, earlier[motion.name]) if earlier is not None and motion.name in earlier else None
        gates += [] if lost is None else [no_loss(lost)]
        measured.append(MotionMeasured(motion, lost, tuple(gates)))
    names = {motion.name for motion in found.tables}
    gone = {name: table_gone(name) for name in earlier or {} if name not in names}
    return MotionCoverageResults(tuple(measured), found.unlisted, gone)


def _context(results: MotionCoverageResults, wanted: str, colour: bool, width: int) -> str:
    known = {each.contexts.id: (measured, each) for measured in results.tables for each in measured.motion.coverage.contexts}
    if wanted not in known:
        accepted = f"an id of the report, such as {some(list(known))}" if known else "none: no context has a valid clip"
        raise ContextError(Fault(f"there are no contexts {in_quotes(wanted)}.", accepted, mend_for(wanted, known)))
    return render_context(*known[wanted], colour=colour, width=width)


def _axes(given: list[str]) -> dict[str, str]:
    found = {}
    for text in given:
        axis, equals, condition = text.partition("=")
        if not equals or not condition:
            raise ContextError(
                Fault(f"--axis {in_quotes(text)} names no condition.", "speed=, turn= or direction= and a condition")
            )
        found[axis.strip()] = condition.strip()
    return found
