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
    from contextdb import motion as motion
    from contextdb.authoring.game_link import link
    from contextdb.authoring.motion_coverage import ProjectMotion, TableMotion, motion_coverage
    from contextdb.cells.facts import Context, FactSet, Unknown, cell
    from contextdb.compiled.casting.facts import Actors, Prefer
    from contextdb.compiled.explain import Explanation, Failure, RowExplanation
    from contextdb.compiled.live import LiveContext
    from contextdb.compiled.live_many import LiveMany
    from contextdb.compiled.many import ManyMatches
    from contextdb.compiled.matches import Matches
    from contextdb.compiled.memory import Rng
    from contextdb.compiled.picker import Pick, Picker
    from contextdb.compiled.table import CompiledTable
    from contextdb.console import __version__ as __version__
    from contextdb.covering import CoverageReport, Gap, coverage
    from contextdb.errors import (
        ArtefactError,
        CellError,
        ContextDBError,
        ContextError,
        Fault,
        FileError,
        NoSuchFact,
        NoSuchOutput,
        NoSuchPlace,
        NoSuchRow,
        NoSuchTable,
        Place,
        PolicyError,
        SchemaError,
        TableError,
        WrongType,
    )
    from contextdb.findings import Finding
    from contextdb.schema.settings import Schema, TableSettings
    from contextdb.tables.project import Project, load
    from contextdb.tables.table import Table
    from contextdb.tables.watching import Snapshot, Watch, watch
    from contextdb.telemetry.link.game import Link

# The same names for the interpreter, by module; tests/test_face.py compares the three lists.
_HOMES = {
    "authoring.game_link": "link",
    "cells.facts": "Context FactSet Unknown cell",
    "compiled.casting.facts": "Actors Prefer",
    "compiled.explain": "Explanation Failure RowExplanation",
    "compiled.live": "LiveContext",
    "compiled.live_many": "LiveMany",
    "compiled.many": "ManyMatches",
    "compiled.matches": "Matches",
    "compiled.memory": "Rng",
    "compiled.picker": "Pick Picker",
    "compiled.table": "CompiledTable",
    "console": "__version__",
    "covering": "CoverageReport Gap coverage",
    "authoring.motion_coverage": "ProjectMotion TableMotion motion_coverage",
    "errors": "ArtefactError CellError ContextDBError ContextError Fault FileError NoSuchFact NoSuchOutput"
    " NoSuchPlace NoSuchRow NoSuchTable Place PolicyError SchemaError TableError WrongType",
    "findings": "Finding",
    "schema.settings": "Schema TableSettings",
    "tables.project": "Project load",
    "tables.table": "Table",
    "tables.watching": "Snapshot Watch watch",
    "telemetry.link.game": "Link",
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = ["Link", "Project", "Schema", "Snapshot", "Table", "TableSettings", "Watch", "link", "load", "watch"]
__all__ += ["CompiledTable", "Context", "FactSet", "LiveContext", "LiveMany", "ManyMatches", "Matches", "Unknown", "cell"]
__all__ += ["Actors", "Explanation", "Failure", "Pick", "Picker", "Prefer", "Rng", "RowExplanation"]
__all__ += ["CoverageReport", "Fault", "Finding", "Gap", "Place", "ProjectMotion", "TableMotion", "coverage", "motion_coverage"]
__all__ += ["ArtefactError", "CellError", "ContextDBError", "ContextError", "FileError", "PolicyError", "SchemaError", "TableError"]
__all__ += ["NoSuchFact", "NoSuchOutput", "NoSuchPlace", "NoSuchRow", "NoSuchTable", "WrongType"]

if not TYPE_CHECKING:  # a type checker takes every name for one that exists where it sees this

    def __getattr__(name: str) -> object:
        if name == "motion":
            return import_module(f"{__name__}.motion")
        if name not in _HOME_OF:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__", "motion"])
