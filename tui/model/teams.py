"""Actors for the test row: for each role of a table a team, as a small sheet of one row an actor and one column a fact.

A fact is written as in the test row: a value or a set of values; an empty one is no part of it. Actors of one name in two teams
are one actor, who plays one role at most. Teams are stored in `NAME.actors.json` next to the table, {role: [actor]}: what
`CompiledTable.query` takes as its actors. An edge: this reads and writes that file.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Fact, read_fact_text
from contextdb.disk import ACTORS_SUFFIX, read_bytes, write_atomic
from contextdb.errors import ContextError, Fault, FileError, Place, in_quotes
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table
from contextdb.telemetry.recordings import fact_text

from .displayed_table import Header
from .roomy_sheet import RoomySheet
from .table_answer import fact_fault
from .wanted import wanted_by

NAME = "Actor"


def roles_of(table: Table) -> dict[str, list[Condition]]:
    """The roles of a table, each with the conditions that its actors give facts of: those named `Role.fact`, and not computed."""
    roles: dict[str, list[Condition]] = {}
    for condition in wanted_by(table).given.values():
        role, dot, fact = condition.name.partition(".")
        if role and dot and fact:
            roles.setdefault(role, []).append(condition)
    return roles


class TeamSheet(RoomySheet):
    """The actors of one role, being edited."""

    fixed = "The facts of a role are columns of the table, and stay as they are here."
    no_enabling = "Delete the row of an actor who is not to be offered."

    def __init__(self, role: str, conditions: Sequence[Condition], rows: Sequence[Mapping[str, str]] = ()) -> None:
        """`rows` are actors as texts, by `NAME` and by the names of the facts."""
        self.role = role
        self.facts = {c.name.removeprefix(f"{role}."): c for c in conditions}
        names = (NAME, *self.facts)
        texts = {name: [*(row.get(name, "") for row in rows), ""] for name in names}
        settings = TableSettings(role, asset=NAME, outputs=tuple(self.facts))
        super().__init__(Table.from_columns(texts, settings=settings, name=role))

    def of_column(self, column: int) -> Condition | None:
        """The condition that a column holds facts of."""
        return self.facts.get(self.table.columns[column].name)

    def header(self, column: int) -> Header:
        condition = self.of_column(column)
        return (
            Header(NAME, "name")
            if condition is None
            else Header(super().header(column).name, condition.domain.kind, condition.unit)
        )

    def fault_of(self, column: int, text: str) -> Fault | None:
        """Why a text of a column cannot be read."""
        return fact_fault(text, self.of_column(column))

    @property
    def texts(self) -> list[dict[str, str]]:
        """The actors as texts, without empty rows."""
        rows = [{c.name: c[row] for c in self.table.columns if c[row].strip()} for row in range(self.table.n_rows)]
        return [row for row in rows if row]

    @property
    def faults(self) -> list[str]:
        """What is wrong with facts and names, each with its actor."""
        seen: set[str] = set()
        faults = []
        for at, row in enumerate(self.texts):
            actor = row.get(NAME) or f"actor {at + 1}"
            for column, one in enumerate(self.table.columns):
                if fault := self.fault_of(column, row.get(one.name, "")):
                    faults.append(f"{actor}, {one.name}: {fault.message}")
            if NAME in row and row[NAME] in seen:
                faults.append(f"{actor} appears twice among the actors for {self.role}.")
            seen.add(row.get(NAME, ""))
        return faults

    def actors(self) -> list[dict[str, object]]:
        """The actors as they are offered: with a name, an id where they were given a name, and the facts that can be read."""
        actors: list[dict[str, object]] = []
        taken: set[str] = set()
        for at, row in enumerate(self.texts):
            name = row.get(NAME, "")
            if name and name in taken:
                continue
            taken.add(name)
            actor: dict[str, object] = {"id": name or f"{self.role} {at + 1}", "name": name or f"{self.role} {at + 1}"}
            for fact, condition in self.facts.items():
                if (value := _read(row.get(fact, ""), condition)) is not None:
                    actor[condition.name] = value
            actors.append(actor)
        return actors


class Teams:
    """The teams of a table's roles."""

    def __init__(self, table: Table, texts: Mapping[str, Sequence[Mapping[str, str]]] | None = None) -> None:
        """`texts` are the actors of each role, as texts."""
        texts = texts or {}
        self.sheets = {role: TeamSheet(role, conditions, texts.get(role, ())) for role, conditions in roles_of(table).items()}

    @classmethod
    def beside(cls, table: Table) -> Teams:
        """The teams of the file next to a table; empty ones where there is none. Raises FileError where the file cannot be read."""
        path = teams_path(table)
        return cls(table, _texts_in(path, roles_of(table)) if path is not None and path.exists() else None)

    def of(self, table: Table) -> Teams:
        """The same actors for a table whose columns may have changed."""
        same = {role: [c.name for c in conditions] for role, conditions in roles_of(table).items()}
        if same == {role: [c.name for c in sheet.facts.values()] for role, sheet in self.sheets.items()}:
            return self
        return Teams(table, {role: sheet.texts for role, sheet in self.sheets.items()})

    @property
    def offered(self) -> dict[str, list[dict[str, object]]]:
        """The actors of each role that has some."""
        return {role: actors for role, sheet in self.sheets.items() if (actors := sheet.actors())}

    @property
    def faults(self) -> list[str]:
        """What is wrong with the actors."""
        return [fault for sheet in self.sheets.values() for fault in sheet.faults]

    def save(self, path: Path) -> None:
        """Write the file of the teams; raises FileError where the disk refuses."""
        teams = {role: [_as_json(row, sheet) for row in sheet.texts] for role, sheet in self.sheets.items() if sheet.texts}
        write_atomic(path, (json.dumps(teams, ensure_ascii=False, indent=2) + "\n").encode())


def teams_path(table: Table) -> Path | None:
    """The file of a table's teams; None for a table without a file."""
    return None if table.path is None else table.path.with_name(table.path.stem + ACTORS_SUFFIX)


def _read(text: str, condition: Condition) -> Fact:
    try:
        return read_fact_text(text, condition)
    except ContextError:
        return None


def _as_json(row: Mapping[str, str], sheet: TeamSheet) -> dict[str, object]:
    """An actor as a program would write him: plain values where his facts are plain, else their text."""
    document: dict[str, object] = {"name": row[NAME], "id": row[NAME]} if NAME in row else {}
    for fact, condition in sheet.facts.items():
        if fact in row:
            value = _read(row[fact], condition)
            kind = condition.domain.type
            is_plain = isinstance(value, (bool, int, float, str)) and not (kind.is_tags or kind.is_spelt)
            document[fact] = value if is_plain else row[fact]
    return document


def _texts_in(path: Path, roles: Mapping[str, Sequence[Condition]]) -> dict[str, list[dict[str, str]]]:
    try:
        teams = json.loads(read_bytes(path))
        if not (isinstance(teams, dict) and all(isinstance(team, list) for team in teams.values())):
            raise ValueError("it is not a mapping of roles to lists of actors")
        return {role: [_texts_of(actor, role, roles[role]) for actor in team] for role, team in teams.items() if role in roles}
    except ValueError as error:
        problem = f"its actors cannot be read: {in_quotes(str(error))}."
        raise FileError(Fault(problem, '{"Defender": [{"name": …}]}', place=Place(str(path)))) from None


def _texts_of(actor: object, role: str, conditions: Sequence[Condition]) -> dict[str, str]:
    if not isinstance(actor, dict):
        raise ValueError("an actor is not a mapping of facts")
    name = actor.get("name", actor.get("id"))
    texts = {NAME: str(name)} if name is not None else {}
    for condition in conditions:
        fact = condition.name.removeprefix(f"{role}.")
        value = actor.get(fact, actor.get(condition.name))
        if value is not None:
            texts[fact] = value if isinstance(value, str) else _text_of(value, condition)
    return texts


def _text_of(value: object, condition: Condition) -> str:
    return fact_text(float(value) if isinstance(value, int) and not isinstance(value, bool) else value, condition)
