"""A context database: which animation assets are valid now, and why the others are not.

    import contextdb as cdb

    table = cdb.load("tables/hit_mid_air.csv")
    compiled = table.compile()
    compiled.query({"IsInMidAirAnim": False, ...}).assets

Names are resolved when they are first used, so that importing the package costs little.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contextdb.cells.facts import cell
    from contextdb.compiled.batch import ManyMatches
    from contextdb.compiled.explain import Explanation, Failure, RowExplanation
    from contextdb.compiled.live import LiveContext
    from contextdb.compiled.matches import Matches
    from contextdb.compiled.picker import Pick, Picker
    from contextdb.compiled.table import CompiledTable
    from contextdb.console import __version__ as __version__
    from contextdb.covering import CoverageReport, Gap, coverage
    from contextdb.errors import (
        ArtefactError,
        CellError,
        ClipError,
        ContextDBError,
        ContextError,
        Fault,
        FileError,
        MotionError,
        NoSuchFact,
        NoSuchOutput,
        NoSuchPlace,
        NoSuchTable,
        Place,
        PolicyError,
        QueryError,
        SchemaError,
        TableError,
    )
    from contextdb.findings import Finding
    from contextdb.tables.project import Project, load
    from contextdb.tables.table import Table
    from contextdb.tables.watching import watch

_HOMES = {
    "compiled.batch": ("ManyMatches",),
    "compiled.picker": ("Pick", "Picker"),
    "compiled.table": ("CompiledTable",),
    "console": ("__version__",),
    "covering": ("CoverageReport", "Gap", "coverage"),
    "errors": (
        "ArtefactError",
        "CellError",
        "ClipError",
        "ContextDBError",
        "ContextError",
        "Fault",
        "FileError",
        "MotionError",
        "NoSuchFact",
        "NoSuchOutput",
        "NoSuchPlace",
        "NoSuchTable",
        "Place",
        "PolicyError",
        "QueryError",
        "SchemaError",
        "TableError",
    ),
    "compiled.explain": ("Explanation", "Failure", "RowExplanation"),
    "cells.facts": ("cell",),
    "findings": ("Finding",),
    "compiled.live": ("LiveContext",),
    "compiled.matches": ("Matches",),
    "tables.project": ("Project", "load"),
    "tables.table": ("Table",),
    "tables.watching": ("watch",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [  # noqa: RUF022
    "load",
    "Project",
    "watch",
    "Table",
    "CompiledTable",
    "Matches",
    "ManyMatches",
    "Picker",
    "Pick",
    "LiveContext",
    "cell",
    "coverage",
    "CoverageReport",
    "Gap",
    "Explanation",
    "RowExplanation",
    "Failure",
    "Finding",
    "ContextDBError",
    "CellError",
    "SchemaError",
    "TableError",
    "NoSuchTable",
    "FileError",
    "ContextError",
    "NoSuchFact",
    "NoSuchOutput",
    "NoSuchPlace",
    "PolicyError",
    "ArtefactError",
    "MotionError",
    "ClipError",
    "QueryError",
    "Fault",
    "Place",
]


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
