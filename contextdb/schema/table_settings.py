"""The settings of a table: its file, and which of its columns have a job instead of being a condition, one job for a column."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

from contextdb.cells.output_types import OutputValue
from contextdb.cells.outputs import Output
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import Fault, SchemaError, in_quotes
from contextdb.files.settings import Declared, setting, settings_of, word
from contextdb.files.toml_shapes import filled, listed
from contextdb.schema.policies import POLICIES, POLICY_SYNONYMS, Policy
from contextdb.schema.shapes import BASE, COLUMN, EXPRESSIONS, FALLBACK, FILE, OUTPUTS, TEXT

AN_OUTPUT = "Columns that are data for the game. They are not conditions: they exclude no row."
ASSUMED = "What is always so, such as: not (IsRunning and IsIdle). Coverage leaves out all other contexts."
ANOTHER_TABLE = "[another table](designers.md#a-row-that-refers-to-a-table)"


def _job(about: str, more: str, without: str, label: str = "", hint: str = "") -> Any:
    return setting(COLUMN, about, None, more=more, without=without, label=label, hint=hint, in_python=filled(COLUMN.accepted))


@dataclass(frozen=True)
class TableSettings(Declared, error=SchemaError):
    """What `[tables.NAME]` says: the table's file, and which of its columns are not conditions.

    `typed` is what is declared of outputs; one that is not among them is a text. `fallback_outputs` are names and values of the
    outputs that `fallback` gives. Raises SchemaError for a value that contextdb.toml could not hold.
    """

    name: str
    file: str | None = setting(FILE, "Its file, with `/` between folders.", None, without="`NAME.csv` or `NAME.parquet`")
    asset: str | None = _job(
        "Names the asset of each row.", f"`@table` refers to the rows of {ANOTHER_TABLE}.", "the first column", "Asset column"
    )
    outputs: tuple[str, ...] = setting(
        OUTPUTS, AN_OUTPUT, (), more="A list of names, or [typed](#outputs).", without="none", label="Outputs",
        in_python=listed("names of columns", filled("").wrong),
    )  # fmt: skip
    enabled: str | None = _job(
        "A row that says False here never matches.", "True and False; empty is True.", "every row may be valid", "Enabled column"
    )
    priority: str | None = _job(
        "Higher rows are picked first.", "Whole numbers; empty is 0.", "0", "Priority column",
        "A whole number in each row. Of the valid rows those with the highest are picked from.",
    )  # fmt: skip
    weight: str | None = _job(
        "How often a row is picked among equals: 2 is twice as often as 1.", "Numbers from 0 up; empty is 1.", "1", "Weight column"
    )
    once: str | None = _job(
        "A row that says True here is picked once by each character, then no more.",
        "True and False; empty is False.", "rows may be picked again", "Once column",
    )  # fmt: skip
    cooldown_s: str | None = _job(
        "Seconds until a row is picked again.", "Numbers from 0 up; empty is 0.", "0", "Cooldown seconds",
        "A column: the seconds for which a row is not picked again.",
    )  # fmt: skip
    cooldown_turns: str | None = _job(
        "Picks until a row is picked again.", "Whole numbers from 0 up; empty is 0.", "0", "Cooldown picks",
        "A column: the number of picks for which a row is not picked again.",
    )  # fmt: skip
    fallback: str | None = setting(
        FALLBACK, "The asset that plays when no row is valid. Empty: none does.", None,
        more="It may give [outputs](#outputs), too.", without="`pick` gives None", label="Fallback",
        in_python=filled(FALLBACK.accepted),
    )  # fmt: skip
    policy: Policy = word(
        tuple(POLICIES), "What the game does when several rows are valid at once.", "collect", "policy", POLICY_SYNONYMS,
        more="See [designers](designers.md#columns-that-are-not-conditions).", label="Policy",
    )  # fmt: skip
    assume: tuple[str, ...] = setting(
        EXPRESSIONS, ASSUMED, (), more="A list of [expressions](#expressions).", without="none", label="Assumptions"
    )
    when: str | None = _job(
        "An expression that must hold in each row.",
        "The row's [own rule](#a-rows-own-rule); one with `Any`, `-` or an empty cell has none.", "no rules",
    )  # fmt: skip
    base: str | None = setting(
        BASE, "The table that this one is a variant of: its file holds only what differs.", None,
        more="See [variants](designers.md#variants). Settings that it leaves out are those of the base.",
        without="a table of its own",
    )  # fmt: skip
    remove: str | None = _job(
        "Of a variant: a row that says True here is taken out of the base.", "True and False; empty is False.", "none is taken out"
    )
    expected: str | None = setting(
        FILE, "A file of the contexts that are expected, which coverage is first about.", None,
        more="Cells as in any table, and a column `weight` for how often. See [expected contexts](designers.md#expected-contexts).",
        without="nothing is expected",
    )  # fmt: skip
    owner: str = setting(TEXT, "Who answers for the table, such as a team.", "", without="nobody is named", label="Owner")
    typed: tuple[Output, ...] = ()
    fallback_outputs: tuple[tuple[str, OutputValue], ...] = ()

    @property
    def declared_outputs(self) -> tuple[Output, ...]:
        """The outputs, in the order of `outputs`."""
        typed = {output.name: output for output in self.typed}
        return tuple(typed.get(name) or Output(name) for name in self.outputs)

    def output(self, name: str) -> Output | None:
        """What is declared of an output; None for a column of another kind, or one of which nothing is. Raises nothing."""
        return next((output for output in self.typed if output.name == name), None)

    @property
    def jobs(self) -> list[tuple[str, str]]:
        """Each job with a column that has it, as far as columns are named."""
        return columns_with_jobs(vars(self))

    @property
    def files(self) -> tuple[str, ...]:
        """The files that may hold the table, the most wanted first."""
        return table_files(self.name, self.file)


JOBS = tuple(key for key, each in settings_of(TableSettings).items() if each.shape is COLUMN)
"""The keys that name one column each; "outputs" names several."""
PLAIN_JOBS = tuple(job for job in JOBS if job not in ("asset", "when"))
"""Those of columns of plain values."""
JOB_KEYS = (*JOBS, "outputs")


def columns_with_jobs(section: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Each job with a column that has it, the outputs last."""
    single = [(job, section[job]) for job in JOBS if section.get(job) is not None]
    return [*single, *(("outputs", name) for name in section.get("outputs", ()))]


def columns_checked(section: Mapping[str, Any]) -> Iterator[tuple[str, str, Fault | None]]:
    """The same, and what is wrong where the column has another job already."""
    jobs: dict[str, str] = {}
    for job, column in columns_with_jobs(section):
        other = jobs.get(column)
        problem = f"{job} and {other} both name the column {in_quotes(column)}."
        yield job, column, Fault(problem, "one job for a column") if other else None
        jobs.setdefault(column, job)


def missing_job(column: str, settings: Mapping[str, Any]) -> str:
    """The line of `[tables.NAME]` by which a column gets the job that it is most likely meant for; nothing where its name is that
    of no job, or another column has the job. `settings` are those of the table by name."""
    job = {"rest": "cooldown_s", "cooldown": "cooldown_s"}.get(column.lower(), column.lower())
    is_meant = job in JOBS and job != "asset" and settings.get(job) is None
    return f"{job} = {in_quotes(column)} in [tables.{settings['name']}]" if is_meant else ""


def table_files(name: str, file: str | None) -> tuple[str, ...]:
    """The files that may hold a table, the most wanted first; `file` is the one that its section names."""
    names = [name + suffix for suffix in TABLE_SUFFIXES] if file is None else [file]
    return tuple(str(PurePosixPath(each)) for each in names)
