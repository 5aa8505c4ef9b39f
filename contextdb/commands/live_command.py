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
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from contextdb.commands.numbers import whole_type
from contextdb.compiled.table import CompiledTable
from contextdb.console import ExitCode, aligned, note, output, printable
from contextdb.errors import ContextDBError, ContextError, Fault, in_quotes, plural
from contextdb.tables.project import Project
from contextdb.telemetry.link.game import new_recording
from contextdb.telemetry.link.hearing import Game, Hearing, Wanted, games, hear, the_game
from contextdb.telemetry.link.lines import ASK, DECISION, END, HEADER, LOST, PICK, TABLES, Line, fact_text, given_facts
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


# ---- what `contextdb live` prints: one line for each change of what a character asks, gets, and plays

N_NEAREST = 3
MOST_PRINTED = 4000
"""Characters of a line that is printed."""
MOST_KNOWN, MOST_KNOWN_BYTES = 1000, 1 << 24
"""Characters of a game that are remembered at most, and bytes of their lines; the one that was remembered first is forgotten."""
NO_PICK = "-"
Facts = dict[str, object]

UNCHANGED = ("plays on", "loops")
"""The actions of a decision that are no change."""


@dataclass(frozen=True)
class Printed:
    """What a line of the game says: lines for the output, and notes for the user."""

    lines: Sequence[str] = ()
    notes: Sequence[str] = ()


@dataclass
class _Known:
    """What was last printed of a character and a table."""

    facts: Mapping[str, object] = field(default_factory=dict)
    rows: str | None = None
    valid: int | None = None
    pick: tuple[object, object] | None = None
    n_bytes: int = 0


class Changes:
    """Finds what is new in each line. `own` are tables that answer too, by name."""

    def __init__(self, own: Mapping[str, CompiledTable], explains: bool) -> None:
        self.own, self.explains = own, explains
        self._known: dict[tuple[object, object], _Known] = {}
        self._playing: dict[object, tuple[object, object]] = {}
        self._n_rows: dict[str, object] = {}
        self._noted: set[str] = set()
        self._n_bytes = 0

    def versions(self, line: Line) -> list[str]:
        """Notes on the tables that a header, or a line of new tables, names."""
        notes = []
        self._n_rows = {name: about.get("rows") for name, about in line["tables"].items()}
        for name, about in line["tables"].items() if self.own else ():
            version = about.get("version")
            if name not in self.own:
                notes += self._note(f"{in_quotes(name)} is not one of your tables, so its answer is not compared.")
            elif version is not None and version != self.own[name].version:
                here = self.own[name].version
                notes += self._note(f"the game has another version of {in_quotes(name)}: {str(version)[:8]}, yours is {here[:8]}.")
        return notes

    def of(self, line: Line, n_bytes: int = 0) -> Printed:
        """What is new in a line of `n_bytes` bytes."""
        kind = line["line"]
        if kind in (HEADER, TABLES):
            return Printed(notes=self.versions(line))
        if kind == LOST:
            return Printed(notes=[f"{plural(line['count'], 'line')} lost: the game produced more than could be sent."])
        if kind in (ASK, PICK):
            return self._question_lines(line, n_bytes)
        return Printed(list(self._decided(line))) if kind == DECISION else Printed()

    def _question_lines(self, line: Line, n_bytes: int) -> Printed:
        known = self._remembered(line, n_bytes)
        facts = line.get("facts", known.facts)
        changed = {name: value for name, value in facts.items() if name not in known.facts or known.facts[name] != value}
        changed |= dict.fromkeys(name for name in known.facts if name not in facts)
        picked = line.get("pick")
        pick = known.pick if picked is None and line["line"] == PICK else _pick_of(picked)
        rows = line.get("rows", known.rows)
        is_new = bool(changed) or rows != known.rows or (pick is not None and pick != known.pick)
        known.facts, known.rows = facts, rows
        known.valid = line.get("valid", known.valid)
        known.pick = pick or known.pick
        if not is_new:
            return Printed()
        why, notes = self._why(line)
        return Printed([printable(cut(text)) for text in (self._line(line, known, changed, pick), *why)], notes)

    def _remembered(self, line: Line, n_bytes: int) -> _Known:
        known = self._known.setdefault((line["who"], line["table"]), _Known())
        self._n_bytes += n_bytes - known.n_bytes
        known.n_bytes = n_bytes
        while len(self._known) > 1 and (len(self._known) > MOST_KNOWN or self._n_bytes > MOST_KNOWN_BYTES):
            first = next(key for key in self._known if self._known[key] is not known)
            self._n_bytes -= self._known.pop(first).n_bytes
        return known

    def _line(self, line: Line, known: _Known, changed: Mapping[str, object], pick: tuple[object, object] | None) -> str:
        n_rows = self._n_rows.get(line["table"])
        valid = f"{known.valid}{'' if n_rows is None else f' of {n_rows}'} valid" if known.valid is not None else ""
        parts = [f"{line['t']:9.3f}", _name(line["who"]), line["table"], _pick_text(pick), valid, " ".join(_facts(changed))]
        return "  ".join(part for part in parts if part)

    def _why(self, line: Line) -> tuple[list[str], list[str]]:
        """The nearest rows of one's own table, and a note where its answer is another."""
        own = self.own.get(line["table"])
        if own is None or line["line"] != ASK:
            return [], []
        try:
            facts, actors = _given(line)
        except ValueError as error:
            return [], self._note(_refusal(own, error))
        try:
            explanation = own.explain(facts, unknown="any", actors=actors)
        except ContextDBError as error:
            return [], self._note(_refusal(own, error))
        notes: list[str] = []
        if explanation.matches.bits != int(line["rows"], 16) and not any(None is v for v in line["facts"].values()):
            notes = self._note(f"your {in_quotes(own.name)} answers differently from the game's.")
        nearest = explanation.nearest(N_NEAREST) if self.explains else []
        return [f"{'':11}{row}" for row in nearest], notes

    def _decided(self, line: Line) -> Iterator[str]:
        decision: Mapping[str, Any] = line["decision"]
        choice, playing = _dict(decision.get("choice")), _dict(decision.get("playing"))
        asset = _text(playing.get("asset") if "action" in decision else _dict(choice.get("hit")).get("asset"))
        action = _text(decision.get("action", choice.get("reason")))
        before = self._playing.pop(line["who"], None)
        self._playing[line["who"]] = now = (asset, action)
        if len(self._playing) > MOST_KNOWN:
            del self._playing[next(iter(self._playing))]
        if before == now or (before is not None and before[0] == asset and action in UNCHANGED):
            return
        database, reason = _text(playing.get("database") or choice.get("database")), _text(decision.get("why"))
        where = f" of {database}" if database else ""
        why = f": {reason}" if reason else ""
        yield printable(f"{line['t']:9.3f}  {_name(line['who'])}  {action} {asset or 'nothing'}{where}{why}")

    def _note(self, text: str) -> list[str]:
        """A note that was not given yet."""
        if text in self._noted or len(self._noted) >= MOST_KNOWN:
            return []
        self._noted.add(text)
        return [text]


def _given(line: Line) -> tuple[Facts, Mapping[str, list[Facts]] | None]:
    """The facts and the actors of a question, as a query takes them; ValueError where one is no fact."""
    actors = line.get("actors")
    given = None if actors is None else {role: [given_facts(each) for each in listed] for role, listed in actors.items()}
    return given_facts(line["facts"]), given


def _refusal(own: CompiledTable, error: Exception) -> str:
    return f"your {in_quotes(own.name)} cannot answer that: {error}"


def _pick_of(picked: object) -> tuple[object, object] | None:
    return (picked.get("row"), picked.get("asset")) if isinstance(picked, dict) else None


def _pick_text(pick: tuple[object, object] | None) -> str:
    if pick is None:
        return NO_PICK
    row, asset = pick
    if asset is None:
        return "nothing"
    return f"{asset} (row {row + 1})" if isinstance(row, int) else f"{asset} (fallback)"


def _facts(changed: Mapping[str, object]) -> Iterator[str]:
    """Facts as on the command line; "?" for one that is missing now."""
    for name, value in changed.items():
        try:
            text = fact_text(value)
        except ValueError:
            text = None
        yield f"{name}=?" if text is None else shlex.quote(f"{name}={text}")


def _name(character_id: str | None) -> str:
    return "-" if character_id is None else character_id


def cut(text: str) -> str:
    """A text that is not too long to be printed."""
    return text if len(text) <= MOST_PRINTED else f"{text[: MOST_PRINTED - 1]}…"


def _text(value: object) -> str | None:
    return cut(value) if isinstance(value, str) else None


def _dict(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}
