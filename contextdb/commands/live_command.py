"""Show what a running game asks its tables and what it picks, one line per change.

Without NAME, the command shows the only running game, or lists them if there are several. A line has the seconds since the link
was opened, who asks, the table, what was picked, how many rows are valid, and the facts that changed. Ctrl+C ends it.

  contextdb live game --who player --table locomotion
  contextdb live game --tables tables/ --explain
  contextdb live game --record session.jsonl

With --record FILE every question is saved, not only the newest; `evaluate` and `coverage --telemetry` read FILE, even while it
grows.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from contextdb.commands.live_views import Changes, cut
from contextdb.commands.numbers import whole_type
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, aligned, note, output
from contextdb.errors import ContextDBError, ContextError, Fault, in_quotes
from contextdb.tables.project import Project
from contextdb.telemetry.link.game import new_recording
from contextdb.telemetry.link.hearing import Game, Hearing, Wanted, games, hear, the_game
from contextdb.telemetry.link.lines import END
from contextdb.telemetry.link.listeners import FileListener


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", nargs="?", help="the name of a running game")
    parser.add_argument("--who", action="append", metavar="WHO", help="only what this character asks; may be repeated")
    parser.add_argument("--table", action="append", metavar="TABLE", help="only what this table is asked; may be repeated")
    parser.add_argument("--record", metavar="FILE", help="also write every line to a new file: .jsonl")
    parser.add_argument("--tables", metavar="FOLDER", help="a folder of tables to ask too; shows where their answers differ")
    parser.add_argument("--explain", action="store_true", help="with --tables: show the nearest rows, and which cells fail")
    parser.add_argument("--most", type=whole_type("a number of lines, such as 10.", 1), metavar="N", help="end after N lines")


def run(arguments: argparse.Namespace) -> ExitCode:
    """Listen until the game ends, or the user does not want to any more."""
    if arguments.explain and arguments.tables is None:
        raise ContextError(Fault("--explain asks your own tables.", "--tables FOLDER with it"))
    own: dict[str, CompiledTable] = {}
    if arguments.tables is not None:
        own = {name: table.compile() for name, table in Project.load(arguments.tables).tables.items()}
    wanted = Wanted(arguments.who or (), arguments.table or (), every=arguments.record is not None)
    try:
        game = _game(arguments.name, wanted)
        if not isinstance(game, Hearing):
            _list(game)
            return ExitCode.OK
        with ExitStack() as stack:
            hearing = stack.enter_context(game)
            file = None if arguments.record is None else _record(Path(arguments.record), hearing, stack)
            with output():
                _show(hearing, Changes(own, arguments.explain), file, arguments.most)
    except KeyboardInterrupt:  # how a listener ends
        return ExitCode.OK
    return ExitCode.OK


def _game(name: str | None, wanted: Wanted) -> Hearing | Sequence[Game]:
    """The game that is meant, or several of which it may be one. Raises ContextDBError where none runs that is meant; it names
    those that run."""
    running = games() if name is None else []
    if len(running) > 1:
        return running
    path = running[0].path if running else the_game(name)[1]
    try:
        return hear(path, wanted)
    except OSError:
        fault = f"the game {in_quotes(path.stem)} does not answer: it is stopped, has ended, or has too many listeners."
        raise ContextDBError(Fault(fault)) from None


def _list(running: Sequence[Game]) -> None:
    rows = [(game.name, str(game.header["pid"]), cut(", ".join(game.header["tables"]))) for game in running]
    with output():
        print(*aligned([("game", "process", "tables"), *rows]), sep="\n")


def _record(path: Path, hearing: Hearing, stack: ExitStack) -> FileListener:
    file = new_recording(path)
    stack.callback(file.close)
    file.offer(hearing.raw_header)
    return file


def _show(hearing: Hearing, changes: Changes, file: FileListener | None, most: int | None) -> None:
    note(*changes.versions(hearing.header))
    n_lines, has_ended = 0, False
    for batch in hearing.batches():
        for raw, line in batch:
            has_ended = has_ended or line["line"] == END
            if file is not None:
                file.offer(raw)
            changed = changes.of(line, len(raw))
            note(*changed.notes)
            if changed.lines:
                print(*changed.lines, sep="\n", flush=True)
                n_lines += 1
            if most is not None and n_lines >= most:
                return
        if file is not None:
            file.send()
    name = in_quotes(str(hearing.header["game"]))
    note(f"the game {name} has ended." if has_ended else f"the game {name} is gone.")
