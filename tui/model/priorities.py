"""Selectors as a designer sees them: databases in order, and which of them decides for the test context.

A database holds the assets whose clips its pattern finds; where no clip is there yet, the rows of its table that the pattern fits.
An asset is valid when a row of it is. No pose is known here, so nothing is known of costs but what the thresholds make of them.

This reads the disk: the names of clips, and tables other than the open one, each once until `reload`.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from contextdb.disk import fits
from contextdb.errors import ContextDBError, Fault, SchemaError, in_quotes
from contextdb.motion.clips.source import ENDINGS
from contextdb.motion.storage.clip_files import named_takes
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.database_settings import DatabaseSettings
from contextdb.tables.project import load, table_files
from contextdb.tables.table import Table

from .query_row import QueryRow
from .sheet import Sheet

Order = tuple[tuple[str, float | None], ...]
"""Databases in order, each with the threshold under which it wins outright; the last has none."""

Answer = tuple[dict[str, None], set[str]]
"""The assets of a table in its order, and those that are valid."""

EXAMPLE = """[databases.jog]
table = "locomotion"
clips = "clips/jog/*.bvh"
features = "loco"
[databases.jog_tired]
table = "locomotion"
clips = "clips/jog_tired/*.bvh"
features = "loco"

[selectors.locomotion]
order = [ { database = "jog_tired", threshold = 0.1 }, { database = "jog" } ]"""


@dataclass(frozen=True)
class DatabaseNow:
    """A database in a selector's order, and its assets for the test context."""

    name: str
    threshold: float | None
    assets: tuple[str, ...] = ()
    valid: tuple[str, ...] = ()
    note: str = ""
    """What one should know of the count: that there are no clips yet, or why nothing is known."""


@dataclass(frozen=True)
class SelectorNow:
    """A selector, and the rule that follows from its thresholds and the valid assets."""

    name: str
    databases: tuple[DatabaseNow, ...]

    @property
    def order(self) -> Order:
        return tuple((one.name, one.threshold) for one in self.databases)

    @property
    def rule(self) -> str:
        """What wins for the test context, in words."""
        return rule_of(self.databases)


class Priorities:
    """The selectors of a sheet's project."""

    def __init__(self, sheet: Sheet) -> None:
        self.sheet = sheet
        self._clips: dict[tuple[str, tuple[str, ...]], tuple[str, ...]] = {}
        self._tables: dict[str, Table | str] = {}
        self._answers: dict[str, Answer | str] = {}

    def reload(self) -> None:
        """Look again for clips and other tables."""
        self._clips.clear()
        self._tables.clear()

    @property
    def config(self) -> MotionConfig:
        """What contextdb.toml says of motion. Raises SchemaError with every fault of it."""
        schema = self.sheet.table.schema
        return MotionConfig.from_dict(schema.motion, file=schema.file)

    @property
    def folder(self) -> Path | None:
        schema = self.sheet.table.schema
        return Path(schema.file).parent if schema.file else None

    def clips_without_row(self) -> list[str]:
        """The clips of this table's databases that no row of it names yet; none where contextdb.toml has faults."""
        if self.faults():
            return []
        own = [one for one in self.config.databases.values() if one.table == self.sheet.table.settings.name]
        named = {asset for asset, _ in self.sheet.query.answers()}
        return [clip for clip in dict.fromkeys(clip for one in own for clip in self._clips_of(one)) if clip not in named]

    def faults(self) -> tuple[Fault, ...]:
        """Why the selectors cannot be displayed."""
        try:
            _ = self.config
        except SchemaError as error:
            return error.faults
        return ()

    def selectors(self) -> list[SelectorNow]:
        """Every selector for the context of the test row; none where contextdb.toml has faults."""
        if self.faults():
            return []
        config = self.config
        self._answers.clear()
        counted = {name: self._counted(config.databases[name]) for name in config.databases}
        return [
            SelectorNow(name, tuple(DatabaseNow(one, threshold, *counted[one]) for one, threshold in selector.order))
            for name, selector in config.selectors.items()
        ]

    def unused(self, selector: SelectorNow) -> list[str]:
        """The databases that a selector could have too: those of the same features."""
        databases = self.config.databases
        taken = {one.name for one in selector.databases}
        features = {databases[name].features for name in taken}
        return [name for name, one in databases.items() if name not in taken and one.features in features]

    def _counted(self, settings: DatabaseSettings) -> tuple[tuple[str, ...], tuple[str, ...], str]:
        """The assets of a database, those of them that are valid now, and a note."""
        clips = self._clips_of(settings)
        if settings.table is None:
            note = "" if clips else f"no file fits {settings.clips}"
            return clips, clips, note or "no table filters it: every clip is valid"
        answer = self._valid_in(settings.table)
        if isinstance(answer, str):
            return clips, (), answer
        assets, valid = answer
        if clips:
            held = tuple(clip for clip in clips if clip in assets)
            return held, tuple(clip for clip in held if clip in valid), ""
        pattern = PurePosixPath(settings.clips).name
        rows = tuple(asset for asset in assets if any(fits(f"{asset}{ending}", pattern) for ending in ENDINGS))
        return rows, tuple(asset for asset in rows if asset in valid), "no clips yet: counted from the rows of the table"

    def _clips_of(self, settings: DatabaseSettings) -> tuple[str, ...]:
        key = settings.clips, settings.roles
        if key not in self._clips:
            names: list[str] = []
            with suppress(ContextDBError, OSError):  # a pattern that pathlib does not know, or a folder that may not be read
                names = [name for name, _, _ in named_takes(settings, self.folder)] if self.folder else []
            self._clips[key] = tuple(dict.fromkeys(map(settings.asset_of, names)))
        return self._clips[key]

    def _valid_in(self, name: str) -> Answer | str:
        """What a table answers to the test row, or why it cannot be reported."""
        if name not in self._answers:
            self._answers[name] = self._answer_of(name)
        return self._answers[name]

    def _answer_of(self, name: str) -> Answer | str:
        if name == self.sheet.table.settings.name:
            return _answer(self.sheet.query)
        table = self._table(name)
        if isinstance(table, str):
            return table
        query = QueryRow(table)
        query.load(self.sheet.query.texts)
        return _answer(query)

    def _table(self, name: str) -> Table | str:
        if name not in self._tables:
            self._tables[name] = self._loaded(name)
        return self._tables[name]

    def _loaded(self, name: str) -> Table | str:
        files = dict(table_files(self.folder, self.sheet.table.schema)) if self.folder else {}
        if name not in files:
            return f"there is no table {in_quotes(name)}"
        try:
            return load(files[name], strict=False)
        except ContextDBError as error:
            return f"the table {in_quotes(name)} cannot be read: {error.faults[0].found}"


def _answer(query: QueryRow) -> Answer:
    answers = list(query.answers())
    return dict.fromkeys(asset for asset, _ in answers), {asset for asset, is_valid in answers if is_valid}


# ---- the rule in words


def rule_of(databases: Sequence[DatabaseNow]) -> str:
    """What wins among databases in order, of which those without a valid asset are passed over."""
    able = [one for one in databases if one.valid]
    idle = [one.name for one in databases if not one.valid]
    if not able:
        return "No database has a valid asset for this context: nothing may play."
    passed = f"{_listed(idle)} {'has' if len(idle) == 1 else 'have'} no valid asset for this context: " if idle else ""
    if len(able) == 1:
        return f"{passed}{able[0].name} decides." if passed else f"{able[0].name} decides: it is the only database."
    return passed + " ".join(_steps(able))


def _steps(able: Sequence[DatabaseNow]) -> list[str]:
    """The sentences of the chain: the search goes on until a cost is under its threshold; the lowest of what was searched wins."""
    first, last = able[0], able[-1]
    if len(able) == 2:
        return [f"{first.name} wins outright when its best cost is under {_cost(first)}, otherwise the cheaper of both plays."]
    steps = [f"{first.name} wins outright when its best cost is under {_cost(first)}."]
    for n, one in enumerate(able[1:-1], 2):
        cheapest = "the cheaper of both plays" if n == 2 else f"the cheapest of the first {n} plays"
        steps.append(f"If not, {one.name} is searched too: when its best cost is under {_cost(one)}, {cheapest}.")
    return [*steps, f"If not, {last.name} is searched too, and the cheapest of all {len(able)} plays."]


def _cost(one: DatabaseNow) -> str:
    return f"{one.threshold:g}"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


# ---- other orders


def moved(order: Order, at: int, down: int) -> Order:
    """A database one place up (-1) or down (1). Its threshold goes with it, but the last one of the new order has none, and the one
    that was last takes over the threshold of whose place it takes."""
    to = at + down
    if not (0 <= at < len(order) and 0 <= to < len(order)):
        return order
    now = list(order)
    now[at], now[to] = now[to], now[at]
    upper, lower = min(at, to), max(at, to)
    if now[upper][1] is None:
        now[upper], now[lower] = (now[upper][0], now[lower][1]), (now[lower][0], None)
    return tuple(now)


def with_threshold(order: Order, at: int, threshold: float) -> Order:
    """Another threshold for one database."""
    return (*order[:at], (order[at][0], threshold), *order[at + 1 :])


def with_database(order: Order, at: int, name: str) -> Order:
    """A database more, before place `at`. Its threshold is 0: it wins outright never, until it is given another."""
    return (*order[:at], (name, 0.0), *order[at:])


def without_database(order: Order, at: int) -> Order:
    """A database less; the last of the others has no threshold."""
    left = (*order[:at], *order[at + 1 :])
    return (*left[:-1], (left[-1][0], None)) if left else left
