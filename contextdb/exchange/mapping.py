"""Which column of a reading becomes what in a table: the asset, a condition that is declared, a new one, data, or nothing."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from contextdb.columns import TextColumn
from contextdb.conditions import Condition
from contextdb.errors import ContextDBError, Fault, in_quotes, nearest, plural, some
from contextdb.exchange.proposals import n_unreadable, names_of, propose_type
from contextdb.exchange.reading import Reading
from contextdb.schema import Schema, TableSettings, conditions_from_dict
from contextdb.sections import condition_to_dict

Job = Literal["asset", "condition", "output", "enabled", "priority", "weight", "when", "left out"]
JOBS: tuple[Job, ...] = ("asset", "condition", "output", "enabled", "priority", "weight", "when", "left out")
PLAIN_JOBS: tuple[Job, ...] = ("enabled", "priority", "weight", "when")
_NEVER_GUESSED = ("when",)
"""Jobs whose word is too common a name to go by."""

_ASSET_NAMES = ("assetname", "asset", "animation", "animationname", "animasset", "clip", "clipname", "rowname", "name")


@dataclass(frozen=True)
class Mapped:
    """What becomes of one column."""

    source: str
    """Its name in the file."""
    name: str
    """Its name in the table."""
    job: Job
    why: str
    """Why, in a few words for a person."""
    declared: Mapping[str, object] | None = None
    """What `[conditions.NAME]` shall say of a new condition; None for one that is declared already, and for other jobs."""
    is_new: bool = False
    """Whether it is a condition that contextdb.toml does not have yet."""
    n_unreadable: int = 0
    """Rows whose cell cannot be read as the condition."""
    near: str | None = None
    """A declared condition whose name is near, and which may be meant."""

    @property
    def kind(self) -> str:
        """The job, or for a condition its type, as a person reads it."""
        return str(self.declared["type"]) if self.job == "condition" and self.declared else self.job


def propose(
    reading: Reading, schema: Schema, settings: TableSettings, renames: Mapping[str, str] | None = None
) -> tuple[Mapped, ...]:
    """Propose what becomes of each column.

    Parameters
    ----------
    schema : Schema
        What the project declares.
    settings : TableSettings
        What it says of the table that is written, if anything.
    renames : mapping of str to str, optional
        What a person said: a column of the file to a name in the table, or to "" to leave it out.

    Raises
    ------
    ContextDBError
        `renames` speaks of a column that is not there, or two columns would have one name.
    """
    renames = renames or {}
    _require_known(renames, reading.names)
    kept = next(iter(reading.schema.tables.values()), None)
    merged = _merged(settings, kept)
    asset = _asset(reading, merged, renames)
    mapped = tuple(_mapped(column, asset, reading, schema, merged, renames) for column in reading.columns)
    _require_different(mapped)
    return mapped


def as_condition(mapped: Mapped, column: TextColumn, name: str, schema: Schema) -> Mapped:
    """The same column as the condition `name`: a declared one, or a new one of the type that its cells have."""
    if name in schema.conditions:
        return _as_declared(column, schema.conditions[name], "chosen")
    proposal = propose_type(column)
    declared = proposal.declared or {"type": "text"}
    return replace(
        mapped, name=name, job="condition", why=proposal.why, declared=declared, is_new=True, n_unreadable=proposal.n_unreadable
    )


def as_type(mapped: Mapped, column: TextColumn, kind: str) -> Mapped:
    """The same column as a new condition of another type; an enum then has the names that its cells have.

    Raises
    ------
    ContextDBError
        An enum is wanted, and no cell holds a name.
    """
    declared: dict[str, object] = {"type": kind}
    if kind == "enum":
        declared["values"] = names_of(column)
        if not declared["values"]:
            raise ContextDBError(Fault(f"{in_quotes(column.name)} cannot be an enum: no cell holds a name.", "any other type"))
    domain = conditions_from_dict({"x": declared})["x"].domain
    return replace(
        mapped, job="condition", declared=declared, is_new=True, why="chosen", n_unreadable=n_unreadable(column, domain)[0]
    )


def as_job(mapped: Mapped, job: Job) -> Mapped:
    """The same column with another job."""
    return replace(mapped, job=job, why="chosen", declared=None, is_new=False, n_unreadable=0, near=None)


# ---- parts


def _require_known(renames: Mapping[str, str], names: Sequence[str]) -> None:
    faults = []
    for source in renames:
        if source not in names:
            near = nearest(source, names)
            faults.append(Fault(f"the file has no column {in_quotes(source)}.", some(names), in_quotes(near) if near else ""))
    if faults:
        raise ContextDBError(*faults)


def _require_different(mapped: Sequence[Mapped]) -> None:
    seen: dict[str, str] = {}
    for column in mapped:
        if column.job == "left out":
            continue
        if column.name in seen:
            found = (
                f"the columns {in_quotes(seen[column.name])} and {in_quotes(column.source)} would both be {in_quotes(column.name)}."
            )
            raise ContextDBError(Fault(found, "one column for each name", f'to leave one out: --map "{column.source}="'))
        seen[column.name] = column.source


def _merged(settings: TableSettings, kept: TableSettings | None) -> TableSettings:
    """What the project says of the table, and where it says nothing, what the file itself keeps."""
    if kept is None or settings != TableSettings(settings.name, settings.file):
        return settings
    return replace(kept, name=settings.name, file=settings.file)


def _asset(reading: Reading, settings: TableSettings, renames: Mapping[str, str]) -> str:
    """The column of the file that names the assets."""
    names = [name for name in reading.names if renames.get(name) != ""]
    if settings.asset:
        for name in names:
            if renames.get(name, name) == settings.asset or _folded(name) == _folded(settings.asset):
                return name
    return next((name for key in _ASSET_NAMES for name in names if _folded(name) == key), names[0] if names else "")


def _mapped(
    column: TextColumn, asset: str, reading: Reading, schema: Schema, settings: TableSettings, renames: Mapping[str, str]
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
        said = getattr(settings, job) if job in PLAIN_JOBS else None
        return Mapped(source, said or name, job, "by its name")
    return _condition(column, name, reading, schema)


def _plain_job(name: str, column: TextColumn, settings: TableSettings) -> Job | None:
    """The job of a column that is no condition: what the settings say, or its name where they say nothing."""
    if name in settings.outputs:
        return "output"
    for job in PLAIN_JOBS:
        said = getattr(settings, job)
        if said is not None and (name == said or _folded(name) == _folded(said)):
            return job
        if said is None and _folded(name) == job and job not in _NEVER_GUESSED and _fits(column, job):
            return job
    return None


def _fits(column: TextColumn, job: Job) -> bool:
    """Whether every cell of a column can be read for a job."""
    from contextdb.edits import check_cell
    from contextdb.table import build_table

    settings = replace(TableSettings("table", asset="asset"), **{str(job): column.name})  # type: ignore[arg-type]
    empty = build_table("table", [TextColumn.of("asset", ()), TextColumn.of(column.name, ())], settings=settings)
    return all(check_cell(empty, column.name, text) is None for text in column.texts)


def _condition(column: TextColumn, name: str, reading: Reading, schema: Schema) -> Mapped:
    if name in schema.conditions:
        return _as_declared(column, schema.conditions[name], "declared")
    alike = next((known for known in schema.conditions if _folded(known) == _folded(name)), None)
    if alike is not None:
        return _as_declared(column, schema.conditions[alike], f"declared as {in_quotes(alike)}")
    near = nearest(name, schema.conditions)
    kept = reading.schema.conditions.get(column.name)
    if kept is not None:
        declared = condition_to_dict(kept)
        return Mapped(
            column.name, name, "condition", "the file keeps its type", declared, True, n_unreadable(column, kept.domain)[0], near
        )
    if column.name in reading.outputs:
        return Mapped(column.name, name, "output", "data, as the file says")
    proposal = propose_type(column)
    if proposal.declared is None:
        return Mapped(column.name, name, "output", proposal.why, near=near)
    return Mapped(column.name, name, "condition", proposal.why, proposal.declared, True, proposal.n_unreadable, near)


def _as_declared(column: TextColumn, condition: Condition, why: str) -> Mapped:
    n_wrong, example = n_unreadable(column, condition.domain)
    kind = condition.domain.kind
    if n_wrong:
        why = f"{why}; {plural(n_wrong, 'cell')} cannot be read as {kind}, such as {in_quotes(example)}"
    return Mapped(column.name, condition.name, "condition", why, None, False, n_wrong)


def _folded(name: str) -> str:
    """A name without what people write in different ways: case, spaces, underscores, hyphens, dots."""
    return re.sub(r"[\s_\-.]+", "", name).casefold()
