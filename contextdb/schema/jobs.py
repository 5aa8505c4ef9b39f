"""The jobs of the columns of a table that are not conditions, as `[tables.NAME]` of contextdb.toml gives them: one for a column."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, get_args

from contextdb.errors import Fault, in_quotes

PlainJob = Literal["enabled", "priority", "weight", "once", "cooldown_s", "cooldown_turns"]
"""A column of plain values."""
Job = Literal["asset", PlainJob, "when"]
JOBS: tuple[Job, ...] = get_args(Job)
"""The keys that name one column each; "outputs" names several."""
JOB_KEYS = (*JOBS, "outputs")


def columns_with_jobs(said: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Each job with a column that has it, the outputs last."""
    single = [(job, said[job]) for job in JOBS if said.get(job) is not None]
    return [*single, *(("outputs", name) for name in said.get("outputs", ()))]


def columns_checked(said: Mapping[str, Any]) -> Iterator[tuple[str, str, Fault | None]]:
    """The same, and what is wrong where the column has another job already."""
    jobs: dict[str, str] = {}
    for job, column in columns_with_jobs(said):
        other = jobs.get(column)
        found = f"{job} and {other} both name the column {in_quotes(column)}."
        yield job, column, Fault(found, "one job for a column") if other else None
        jobs.setdefault(column, job)
