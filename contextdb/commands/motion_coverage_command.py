"""Measure where in speed, turn and direction the clips have nothing, for each set of clips that a table lets play at once.

Also: which clip to capture next, clips that never play, and near-duplicates. Exits with 1 if --fail-under is missed, if clips
fill a movement in fewer contexts than in the --baseline, or if a table is gone, new or redefined and no option accepts that.

  contextdb motion coverage game/
  contextdb motion coverage game/ --format html -o motion.html
  contextdb motion coverage game/ --baseline motion.json --fail-under 80
  contextdb motion coverage game/ --axis speed=wanted_speed --axis direction=move_direction
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence

from contextdb.authoring.motion_coverage import TableMotion, motion_coverage
from contextdb.commands import add_format_arguments, deliver, is_coloured
from contextdb.commands.gating import (
    Accepted,
    add_accepting_arguments,
    earlier_report,
    gone_gates,
    require_baseline,
    space_gates,
)
from contextdb.commands.motion_build_command import MotionProject
from contextdb.commands.numbers import number_type, percent
from contextdb.commands.progress import building_bar
from contextdb.console import ExitCode, note, terminal_width
from contextdb.covering.baseline import NOTHING, declared, differences
from contextdb.errors import ContextError, Fault, in_quotes, mend_for, some
from contextdb.motion.measuring.usage import NEAR_COST, PATTERN
from contextdb.motion.storage.building import open_or_build
from contextdb.report import formats, render
from contextdb.report.coverage_results import table_new
from contextdb.report.document import as_text
from contextdb.report.motion_coverage_document import context_document
from contextdb.report.motion_coverage_results import (
    BASELINE,
    Earlier,
    MotionCoverageResults,
    MotionMeasured,
    fail_under,
    lost_since,
    no_loss,
    read_baseline,
)
from contextdb.tables.project import Project


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="FOLDER", help="a folder of tables with motion databases")
    add_format_arguments(parser, formats("motion coverage"))
    parser.add_argument("--fail-under", type=percent, metavar="PCT", help="fail if the covered percentage of any table is lower")
    parser.add_argument("--baseline", metavar="FILE", help="compare with the JSON of an earlier run; a lost movement fails")
    add_accepting_arguments(parser, ("gone", "new", "redefined"))
    parser.add_argument("--context", metavar="ID", help="show the maps of one set of contexts, by its id")
    parser.add_argument("--all", action="store_true", help="list every hole, every context, and every clip")
    parser.add_argument(
        "--axis", metavar="AXIS=CONDITION", action="append", help="what asks for speed, turn or direction; may be repeated"
    )
    help_text = f"names of transitions, such as {PATTERN} (default: as the project says, else that)"
    parser.add_argument("--transitions", metavar="PATTERN", help=help_text)
    help_text = f"the cost under which a clip is a near-duplicate of another (default: {NEAR_COST})"
    cost = number_type(f"a cost. Accepted: a number from 0 up, such as {NEAR_COST}.")
    parser.add_argument("--near", metavar="COST", type=cost, default=NEAR_COST, help=help_text)


def run(arguments: argparse.Namespace) -> ExitCode:
    if arguments.context is not None and (arguments.format != "text" or arguments.baseline or arguments.fail_under is not None):
        raise ContextError(Fault("--context is text about some contexts; other formats and bars do not go with it."))
    require_baseline(arguments, bool(arguments.baseline))
    earlier = earlier_report(arguments.baseline, read_baseline, BASELINE) if arguments.baseline else None
    results = _results(arguments, earlier)
    colour, width = is_coloured(arguments), terminal_width()
    if arguments.context is not None:
        text = _context(results, arguments.context, colour, width)
    else:
        text = render(arguments.format, results, colour=colour, width=width, shows_all=arguments.all)
    deliver(text, arguments)
    return ExitCode.OK if results.passed else ExitCode.FOUND


def _results(arguments: argparse.Namespace, earlier: Mapping[str, Earlier] | None) -> MotionCoverageResults:
    project = MotionProject.load(arguments.path)
    with building_bar() as progress:
        databases = open_or_build(project.config, project.folder, project.assets, progress)
    with building_bar("comparing clips") as progress:
        tables = Project.load(arguments.path)
        pattern = tables.schema.transitions or PATTERN if arguments.transitions is None else arguments.transitions
        coverage = motion_coverage(
            tables,
            databases,
            axes=_axes(arguments.axis or []),
            pattern=pattern,
            near_cost=arguments.near,
            progress=progress,
        )
    if joint := [name for name, settings in project.config.databases.items() if settings.roles]:
        note(f"left out: the joint clips of {some(joint)}: they follow no stick.")
    accepted = Accepted.of(arguments)
    names = [motion.name for motion in coverage.tables]
    missing = [name for name in earlier or {} if name not in names]
    measured = [_measured(motion, tables, arguments.fail_under, earlier, accepted, missing) for motion in coverage.tables]
    gone = gone_gates(missing, [name for name in names if name not in (earlier or {})], accepted)
    accepted.require_needed()
    return MotionCoverageResults(tuple(measured), coverage.unlisted, dict(gone))


def _measured(
    motion: TableMotion,
    tables: Project,
    limit: float | None,
    earlier: Mapping[str, Earlier] | None,
    accepted: Accepted,
    missing: Sequence[str],
) -> MotionMeasured:
    table = None if motion.coverage.table is None else tables[motion.coverage.table]
    space = NOTHING if table is None else declared(table, {})
    gates = [] if limit is None else [fail_under(motion, limit)]
    if earlier is None:
        return MotionMeasured(motion, None, tuple(gates), space)
    if motion.name not in earlier:
        gates.append(table_new(motion.name, accepted.holds("new", motion.name), missing))
        return MotionMeasured(motion, None, tuple(gates), space)
    before = earlier[motion.name]
    changes = [*differences(before.space, space), *_other_axes(before.axes, motion.axes)]
    gates += space_gates(motion.name, changes, accepted)
    lost = None if changes else lost_since(motion, before)
    gates += [] if lost is None else [no_loss(lost)]
    return MotionMeasured(motion, lost, tuple(gates), space)


def _other_axes(before: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    for axis in sorted({*before, *now}):
        if before.get(axis) != now.get(axis):
            yield f"{axis} was wanted by {before.get(axis, 'nothing')}, now by {now.get(axis, 'nothing')}"


def _context(results: MotionCoverageResults, wanted: str, colour: bool, width: int) -> str:
    known = {each.contexts.id: (measured, each) for measured in results.tables for each in measured.motion.coverage.contexts}
    if wanted not in known:
        accepted = f"an id of the report, such as {some(list(known))}" if known else "none: no context has a valid clip"
        raise ContextError(Fault(f"there are no contexts {in_quotes(wanted)}.", accepted, mend_for(wanted, known)))
    return as_text(context_document(*known[wanted]), colour, width, shows_all=True)


def _axes(given: list[str]) -> dict[str, str]:
    axes = {}
    for text in given:
        axis, equals, condition = text.partition("=")
        if not equals or not condition:
            raise ContextError(
                Fault(f"--axis {in_quotes(text)} names no condition.", "speed=, turn= or direction= and a condition")
            )
        axes[axis.strip()] = condition.strip()
    return axes
