"""Show which database of a selector wins for a pose and a desired path, with which frame, and why.

With facts, only the assets that the databases' tables say are valid may play. Exits with 1 if nothing may.

  contextdb motion select game/ locomotion --query walk@2 --speed 1.3
  contextdb motion select game/ locomotion gait=Walk speed=1.3 direction=0 style=tired --query walk@2 --speed 1.3 --view all
"""

from __future__ import annotations

import argparse
from dataclasses import replace

from contextdb.commands import answer
from contextdb.commands.motion_stage import Stage, add_query_arguments, add_view, context_text
from contextdb.console import ExitCode, terminal_width
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.selection.controller import Controller
from contextdb.motion.selection.decision import Decision
from contextdb.motion.trace.cost_views import View, decision_json
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.views import decision_lines


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help="a folder of tables, or its contextdb.toml")
    parser.add_argument("selector", metavar="SELECTOR", help="the name of a [selectors.NAME]")
    add_query_arguments(parser)
    add_view(parser, "which costs to print", View.SUMMARY)
    parser.add_argument("--name", metavar="TEXT", default="", help="only candidates whose name contains this")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Choose as a character does that plays nothing yet."""
    stage = Stage.of(arguments.path, lambda config: config.databases_of(arguments.selector))
    selector = stage.config.selector(arguments.selector, stage.databases)
    names = list(selector.names)
    valid, facts = stage.valid(names, arguments.facts, arguments.unknown)
    trace = Trace(arguments.k, selector.databases)
    query = stage.query(arguments.query, names, arguments)
    controller = Controller(selector, recorder=trace)
    decision = controller.update(0.0, query, valid or None, arguments.tags, context_text(facts))
    if not arguments.left_out:
        decision = _without_left_out(decision)
    events, view = trace.events(0), View(arguments.view)
    answer(
        arguments,
        lambda: decision_json(decision, events),
        lambda: decision_lines(decision, view, name=arguments.name, events=events, width=terminal_width()),
    )
    return ExitCode.OK if decision.playing is not None else ExitCode.FOUND


def _without_left_out(decision: Decision) -> Decision:
    """The same without the candidates that may not be chosen."""
    candidates = [
        (name, replace(rows, rows=tuple(row for row in rows if row.left_out is LeftOut.NO))) for name, rows in decision.candidates
    ]
    return replace(decision, candidates=tuple(candidates))
