"""What `contextdb live` prints: one line for each change of what a character asks, gets, and plays."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from contextdb.compiled.table import CompiledTable
from contextdb.console import printable
from contextdb.errors import ContextDBError, in_quotes, plural
from contextdb.telemetry.link.lines import ASK, DECISION, HEADER, LOST, PICK, TABLES, Line, fact_text, given_facts

N_NEAREST = 3
NO_PICK = "-"
Facts = dict[str, object]

UNCHANGED = ("plays on", "loops")
"""The actions of a decision that are no change."""


@dataclass(frozen=True)
class Said:
    """What a line of the game says: lines for the output, and notes for the user."""

    lines: Sequence[str] = ()
    notes: Sequence[str] = ()


@dataclass
class _Known:
    """What was last shown of a character and a table."""

    facts: Mapping[str, object] = field(default_factory=dict)
    rows: str | None = None
    valid: int | None = None
    pick: tuple[object, object] | None = None


class Changes:
    """Finds what is new in each line. `own` are tables to ask too, by name."""

    def __init__(self, own: Mapping[str, CompiledTable], explains: bool) -> None:
        self.own, self.explains = own, explains
        self._known: dict[tuple[object, object], _Known] = {}
        self._playing: dict[object, tuple[object, object]] = {}
        self._n_rows: dict[str, object] = {}
        self._noted: set[str] = set()

    def versions(self, line: Line) -> list[str]:
        """Notes on the tables that a header, or a line of new tables, tells of."""
        notes = []
        for name, told in line["tables"].items():
            self._n_rows[name] = told.get("rows")
            if not self.own:
                continue
            version = told.get("version")
            if name not in self.own:
                notes += self._note(f"{in_quotes(name)} is not one of your tables, so it is not asked.")
            elif version is not None and version != self.own[name].version:
                here = self.own[name].version
                notes += self._note(f"the game has another version of {in_quotes(name)}: {str(version)[:8]}, yours is {here[:8]}.")
        return notes

    def of(self, line: Line) -> Said:
        """What a line says that is new."""
        kind = line["line"]
        if kind in (HEADER, TABLES):
            return Said(notes=self.versions(line))
        if kind == LOST:
            return Said(notes=[f"{plural(line['count'], 'line')} lost: the game told more than could be sent."])
        if kind in (ASK, PICK):
            return self._asked(line)
        return Said(list(self._decided(line))) if kind == DECISION else Said()

    def _asked(self, line: Line) -> Said:
        known = self._known.setdefault((line["who"], line["table"]), _Known())
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
            return Said()
        why, notes = self._why(line)
        return Said([printable(self._line(line, known, changed, pick)), *map(printable, why)], notes)

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
            return [], self._note(_not_asked(own, error))
        try:
            explanation = own.explain(facts, unknown="any", actors=actors)
        except ContextDBError as error:
            return [], self._note(_not_asked(own, error))
        notes: list[str] = []
        if explanation.matches.bits != int(line["rows"], 16) and not any(None is v for v in line["facts"].values()):
            notes = self._note(f"your {in_quotes(own.name)} answers otherwise than the game's.")
        nearest = explanation.nearest(N_NEAREST) if self.explains else []
        return [f"{'':11}{row}" for row in nearest], notes

    def _decided(self, line: Line) -> Iterator[str]:
        decision: Mapping[str, Any] = line["decision"]
        choice, playing = _dict(decision.get("choice")), _dict(decision.get("playing"))
        asset = playing.get("asset") if "action" in decision else _dict(choice.get("hit")).get("asset")
        action = decision.get("action", choice.get("reason"))
        before = self._playing.get(line["who"])
        self._playing[line["who"]] = now = (asset, action)
        if before == now or (before is not None and before[0] == asset and action in UNCHANGED):
            return
        database = playing.get("database") or choice.get("database")
        where = f" of {database}" if database else ""
        why = f": {decision['why']}" if decision.get("why") else ""
        yield printable(f"{line['t']:9.3f}  {_name(line['who'])}  {action} {asset or 'nothing'}{where}{why}")

    def _note(self, text: str) -> list[str]:
        """A note that was not given yet."""
        if text in self._noted:
            return []
        self._noted.add(text)
        return [text]


def _given(line: Line) -> tuple[Facts, Mapping[str, list[Facts]] | None]:
    """The facts and the actors of a question, as a query takes them; ValueError where one is no fact."""
    actors = line.get("actors")
    given = None if actors is None else {role: [given_facts(each) for each in listed] for role, listed in actors.items()}
    return given_facts(line["facts"]), given


def _not_asked(own: CompiledTable, error: Exception) -> str:
    return f"your {in_quotes(own.name)} cannot be asked that: {error}"


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


def _name(who: str | None) -> str:
    return "-" if who is None else who


def _dict(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}
