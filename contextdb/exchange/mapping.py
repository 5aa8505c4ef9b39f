"""Which column of a reading becomes what in a table: the asset, a condition that is declared, a new one, data, or nothing."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.grammar import reads
from contextdb.cells.kinds import KINDS
from contextdb.columns import TextColumn
from contextdb.edits.edits import check_cell
from contextdb.errors import ContextDBError, Fault, in_quotes, mend_for, nearest, plural, some
from contextdb.exchange.everyday import JOB_WORDS, as_truths, counts_rows
from contextdb.exchange.proposals import as_cells, n_unreadable, names_of, propose_type, rewritten
from contextdb.exchange.reading import DECIMAL_COMMA, Reading, pair_in
from contextdb.files.toml_shapes import as_toml, dotted
from contextdb.schema.sections import condition_to_dict, settings_to_dict
from contextdb.schema.settings import Schema, TableSettings, conditions_from_dict, settings_renamed
from contextdb.schema.table_settings import PLAIN_JOBS
from contextdb.tables.table import Table

COLUMN_JOBS = (*(job for job in PLAIN_JOBS if job != "remove"), "when")
JOBS = ("asset", "condition", "output", *COLUMN_JOBS, "left out")
_NEVER_GUESSED = ("when",)
"""Jobs whose word is too common a name to go by."""

_TRUTHS = ("enabled", "once")
_NUMBERS = ("priority", "weight", "cooldown_s", "cooldown_turns")

MOST_COMPARED = 100_000
"""Pairs of a column and a declared condition whose names are compared; each costs some 20 µs."""

_ASSET_NAMES = ("assetname", "asset", "animation", "animationname", "animasset", "clip", "clipname", "rowname", "name")


@dataclass(frozen=True)
class Mapped:
    """What becomes of one column."""

    source: str
    """Its name in the file."""
    name: str
    job: str
    why: str
    """Why, in a few words for a person."""
    declared: Mapping[str, object] | None = None
    """What `[conditions.NAME]` shall say of a new condition; None for one that is declared already, and for other jobs."""
    is_new: bool = False
    """Whether it is a condition that contextdb.toml does not have yet."""
    n_unreadable: int = 0
    """Rows whose cell cannot be read as the condition."""
    near: str | None = None
    """A declared condition whose name is near, and which possible."""
    names: TextColumn | None = None
    """The column with each text as one whole name, where its file has whole names and some must be quoted for it."""
    cells: TextColumn | None = None
    """The cells that the texts become, where some are written differently than in the file."""

    @property
    def kind(self) -> str:
        """The job, or for a condition its type, as a person reads it."""
        return str(self.declared["type"]) if self.job == "condition" and self.declared else self.job


def propose(
    reading: Reading, schema: Schema, settings: TableSettings, renames: Mapping[str, str] | None = None
) -> tuple[Mapped, ...]:
    """Propose what becomes of each column, by what the project declares and, if anything, says of the table that is written.
    `renames` is what a person said: for a column of the file a name in the table, or "" to leave it out. Raises ContextDBError
    where it speaks of a column that is missing, or two columns would have one name."""
    renames = renames or {}
    _require_known(renames, reading.names)
    earlier = next(iter(reading.schema.tables.values()), None)
    merged = _merged(settings, earlier, renames)
    asset = _asset(reading, merged, renames)
    known = _Known.of(schema, len(reading.columns))
    mapped = tuple(_mapped(column, asset, reading, known, merged, renames) for column in reading.columns)
    _require_different(mapped)
    return mapped


def as_condition(mapped: Mapped, column: TextColumn, name: str, schema: Schema) -> Mapped:
    """The same column as the condition `name`: a declared one, or a new one of the type that its cells have."""
    if name in schema.conditions:
        return _as_declared(column, schema.conditions[name], "chosen", mapped.names)
    proposal = propose_type(column, mapped.names)
    declared = proposal.declared or {"type": "text"}
    cells = mapped.names if proposal.declared is None else proposal.cells
    return replace(
        mapped,
        name=name,
        job="condition",
        why=proposal.why,
        declared=declared,
        is_new=True,
        n_unreadable=proposal.n_unreadable,
        cells=cells,
    )


def as_type(mapped: Mapped, column: TextColumn, kind: str) -> Mapped:
    """The same column as a new condition of another type; an enum then has the names that its cells have. Raises ContextDBError
    where an enum is wanted, and no cell holds a name."""
    declared: dict[str, object] = {"type": kind}
    cells = as_cells(column, Domain(kind)) or (mapped.names if KINDS[kind].is_named else None)
    column = cells or column
    if KINDS[kind].needs_values:
        declared["values"] = names_of(column)
        if not declared["values"]:
            raise ContextDBError(
                Fault(f"{in_quotes(column.name)} cannot be {KINDS[kind].noun}: no cell holds a name.", "any other type")
            )
    domain = conditions_from_dict({"x": declared})["x"].domain
    n_wrong = n_unreadable(column, domain)[0]
    return replace(mapped, job="condition", declared=declared, is_new=True, why="chosen", n_unreadable=n_wrong, cells=cells)


def as_job(mapped: Mapped, job: str) -> Mapped:
    """The same column with another job."""
    return replace(mapped, job=job, why="chosen", declared=None, is_new=False, n_unreadable=0, near=None, cells=None)


# ---- parts


@dataclass(frozen=True)
class _Known:
    """The conditions that are declared, and how a name is found among them."""

    conditions: Mapping[str, Condition]
    folded: Mapping[str, str]
    """Their names by what `_folded` makes of them."""
    is_compared: bool
    """Whether names that are only near are looked for."""

    @classmethod
    def of(cls, schema: Schema, n_columns: int) -> _Known:
        folded: dict[str, str] = {}
        for name in schema.conditions:
            folded.setdefault(_folded(name), name)
        return cls(schema.conditions, folded, n_columns * len(folded) <= MOST_COMPARED)

    def near(self, name: str) -> str | None:
        """A declared name that possible."""
        return nearest(name, self.conditions) if self.is_compared else None

    def noted(self, why: str) -> str:
        """The reason for a new column, and that its name was compared with no other."""
        return (
            why if self.is_compared else f"{why}; not compared with the {len(self.conditions):,} declared names, which are too many"
        )


def _require_known(renames: Mapping[str, str], names: Sequence[str]) -> None:
    faults = []
    for source in renames:
        if source not in names:
            faults.append(Fault(f"the file has no column {in_quotes(source)}.", some(names), mend_for(source, names)))
    if faults:
        raise ContextDBError(*faults)


def _require_different(mapped: Sequence[Mapped]) -> None:
    seen: dict[str, str] = {}
    for column in mapped:
        if column.job == "left out":
            continue
        if column.name in seen:
            problem = (
                f"the columns {in_quotes(seen[column.name])} and {in_quotes(column.source)} would both be {in_quotes(column.name)}."
            )
            raise ContextDBError(Fault(problem, "one column for each name", f'to leave one out: --map "{column.source}="'))
        seen[column.name] = column.source


def _merged(settings: TableSettings, known: TableSettings | None, renames: Mapping[str, str]) -> TableSettings:
    """What the project says of the table, and where it says nothing, what the file itself keeps, under the new names."""
    if known is None or settings != TableSettings(settings.name, settings.file):
        return settings
    return replace(settings_renamed(known, lambda name: renames.get(name, name) or None), name=settings.name, file=settings.file)


def _asset(reading: Reading, settings: TableSettings, renames: Mapping[str, str]) -> str:
    """The column of the file that names the assets."""
    names = [name for name in reading.names if renames.get(name) != "" and not counts_rows(name, reading.column(name).to_list())]
    names = names or reading.names
    if settings.asset:
        for name in names:
            if renames.get(name, name) == settings.asset or _folded(name) == _folded(settings.asset):
                return name
    return next((name for key in _ASSET_NAMES for name in names if _folded(name) == key), names[0] if names else "")


def _mapped(
    column: TextColumn, asset: str, reading: Reading, known: _Known, settings: TableSettings, renames: Mapping[str, str]
) -> Mapped:
    source = column.name
    name = renames.get(source, source.strip())
    if name == "":
        return Mapped(source, source, "left out", "as asked")
    if source == asset:
        wanted = settings.asset if settings.asset and source not in renames else name
        is_first = not settings.asset and source == reading.names[0]
        return Mapped(source, wanted, "asset", "the first column" if is_first else "names the assets")
    if job := _plain_job(name, column, settings):
        declared = getattr(settings, job) if job in COLUMN_JOBS else None
        cells = _plain_cells(column, job)
        why = "by its name" if cells is None else f"by its name{rewritten(column, cells)}"
        return Mapped(source, declared or name, job, why, cells=cells)
    if name == source and name not in known.conditions and counts_rows(name, column.to_list()):
        return Mapped(source, name, "left out", "counts the rows")
    return _condition(column, name, reading, known)


def _plain_job(name: str, column: TextColumn, settings: TableSettings) -> str | None:
    """The job of a column that is not a condition: what the settings say, or its name where they say nothing."""
    if name in settings.outputs:
        return "output"
    for job in COLUMN_JOBS:
        declared = getattr(settings, job)
        if declared is not None and (name == declared or _folded(name) == _folded(declared)):
            return job
        is_named = declared is None and JOB_WORDS.get(_folded(name), _folded(name)) == job and job not in _NEVER_GUESSED
        if is_named and _fits(_plain_cells(column, job) or column, job):
            return job
    return None


def _plain_cells(column: TextColumn, job: str) -> TextColumn | None:
    """The cells of a job as people write them otherwise: truths that are ticked, numbers with a decimal comma, which can be no
    tolerance here."""
    if job in _TRUTHS:
        return as_truths(column)
    texts = [DECIMAL_COMMA.sub(".", text) for text in column.texts]
    if job in _NUMBERS and texts != list(column.texts):
        return TextColumn.of(column.name, (texts[code] for code in column.codes.tolist()))
    return None


def _fits(column: TextColumn, job: str) -> bool:
    """Whether every cell of a column can be read for a job."""

    settings = replace(TableSettings("table", asset="asset"), **{job: column.name})  # type: ignore[arg-type]
    empty = Table.build("table", [TextColumn.of("asset", ()), TextColumn.of(column.name, ())], settings=settings)
    return all(check_cell(empty, column.name, text) is None for text in column.texts)


def _condition(column: TextColumn, name: str, reading: Reading, known: _Known) -> Mapped:
    names = reading.whole_names(column)
    if name in known.conditions:
        return _as_declared(column, known.conditions[name], "declared", names)
    alike = known.folded.get(_folded(name))
    if alike is not None:
        return _as_declared(column, known.conditions[alike], f"declared as {in_quotes(alike)}", names)
    near = known.near(name)
    earlier = reading.schema.conditions.get(column.name)
    if earlier is not None:
        declared = condition_to_dict(earlier)
        return Mapped(
            column.name, name, "condition", "the file keeps its type", declared, True, n_unreadable(column, earlier.domain)[0], near
        )
    if column.name in reading.outputs:
        return Mapped(column.name, name, "output", "data, as the file says")
    proposal = propose_type(column, names)
    why = known.noted(proposal.why)
    if proposal.declared is None:
        return Mapped(column.name, name, "output", why, near=near, names=names)
    return Mapped(column.name, name, "condition", why, proposal.declared, True, proposal.n_unreadable, near, names, proposal.cells)


def _as_declared(column: TextColumn, condition: Condition, why: str, names: TextColumn | None) -> Mapped:
    domain = condition.domain
    cells = as_cells(column, domain)
    if domain.type.is_named:
        cells = _fitting(column, whole, domain) if (whole := cells or names) else None
    elif cells is not None:
        why += rewritten(column, cells)
    n_wrong, example = n_unreadable(cells or column, condition.domain)
    if n_wrong:
        why = f"{why}; {plural(n_wrong, 'cell')} cannot be read as {condition.domain.kind}, such as {in_quotes(example)}"
    if condition.domain.type.is_decimal:
        why += pair_in(column.texts)
    return Mapped(column.name, condition.name, "condition", why, None, False, n_wrong, names=names, cells=cells)


def _fitting(column: TextColumn, names: TextColumn, domain: Domain) -> TextColumn:
    """The texts as they are where the grammar of cells reads them, else as whole names where those are read."""
    pairs = np.column_stack((column.codes, names.codes))
    each, which = np.unique(pairs, axis=0, return_inverse=True)
    spellings = [(column.texts[text], names.texts[name]) for text, name in each.tolist()]
    chosen = [name if not reads(text, domain) and reads(name, domain) else text for text, name in spellings]
    return TextColumn.of(column.name, (chosen[at] for at in which.ravel().tolist()))


def _folded(name: str) -> str:
    """A name without what people write in different ways: case, spaces, underscores, hyphens, dots."""
    return re.sub(r"[\s_\-.]+", "", name).casefold()


# ---- what contextdb.toml says of one table, as the lines of one: so that a workbook can carry it along on a sheet of its own


TYPES_SHEET = "contextdb"
FIRST_LINE = "# contextdb 1: what contextdb.toml says of this table; contextdb import reads it"
LONG_LINE = 1_000
"""A list of more characters has a line for each value: Excel holds so many in a cell, and no more."""


def described(table: Table) -> list[str]:
    """The sections of contextdb.toml that a table needs: its own, and those of the conditions that it has and are declared."""
    declared = [c.condition for c in table.conditions if c.condition.is_declared]
    lines = [line for condition in declared for line in _section("conditions", condition.name, condition_to_dict(condition))]
    own = {key: value for key, value in settings_to_dict(table.settings).items() if key != "file"}
    return [FIRST_LINE, *lines, *_section("tables", table.name, {"asset": table.asset_column} | own)]


def _section(section: str, name: str, values: Mapping[str, object]) -> Iterator[str]:
    yield f"[{dotted((section, name))}]"
    for key, value in values.items():
        line = f"{key} = {as_toml(value)}"
        if isinstance(value, list) and len(line) > LONG_LINE:
            yield from (f"{key} = [", *(f"  {as_toml(item)}," for item in value), "]")
        elif isinstance(value, Mapping) and len(line) > LONG_LINE:
            yield from (f"{dotted((key, inner))} = {as_toml(item)}" for inner, item in value.items())
        else:
            yield line
    yield ""
