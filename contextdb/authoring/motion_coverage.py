"""Motion coverage of a project: what the clips of each table have of motion, in each of the contexts that the table tells apart.

Table coverage says which contexts have no valid row; this says which movements the clips of the valid rows lack. Contexts without a
valid clip are left to table coverage.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from contextdb.authoring.clip_contexts import TableContexts, clip_contexts, is_axis, queried_axes
from contextdb.cells.arguments import require_kind, require_mapping
from contextdb.covering.space import require_counts
from contextdb.errors import ContextError, Fault, MotionError, in_quotes, mend_for, some
from contextdb.motion.measuring.coverage import ContextCoverage, MotionCoverage, coverage
from contextdb.motion.measuring.moves import DIRECTION, MAPS, SPEED, TURN
from contextdb.motion.measuring.usage import NEAR_COST, PATTERN
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.building import open_or_build
from contextdb.motion.storage.clip_files import unmatched
from contextdb.motion.storage.config import MotionConfig
from contextdb.tables.project import Project
from contextdb.tables.table import Table, leaf_assets

MOST_CONTEXTS = 50
"""So many contexts of a table are in the JSON, the largest shares first."""
DATABASES = "a mapping of names to MotionDatabase"
Tell = Callable[[int, int, str], None]


@dataclass(frozen=True, eq=False)
class TableMotion:
    """The motion coverage of one table, or of the databases that have none.

    Attributes
    ----------
    coverage : MotionCoverage
    contexts : TableContexts or None
        How its contexts were found; None without a table.
    axes : mapping of str to str
        The conditions that say which speeds, turns and directions are requested.
    without_clip : tuple of str
        Assets of the table that no database has a clip of.
    """

    coverage: MotionCoverage
    contexts: TableContexts | None = None
    axes: Mapping[str, str] = field(default_factory=dict)
    without_clip: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The table's name, or those of the databases that have none."""
        return self.coverage.table if self.coverage.table is not None else ", ".join(self.coverage.databases)

    @property
    def is_exact(self) -> bool:
        """Whether shares of contexts are exact."""
        return self.contexts is None or self.contexts.method == "exact"

    def to_json(self) -> dict[str, Any]:
        coverage, contexts = self.coverage, self.contexts
        return {
            "table": coverage.table,
            "databases": list(coverage.databases),
            "clips": len(coverage.clips),
            "frames": coverage.n_frames,
            "mirrored": coverage.is_mirrored,
            "covered": coverage.covered,
            "contexts": {
                "method": "exact" if contexts is None else contexts.method,
                "samples": 0 if contexts is None else contexts.n_samples,
                "why_drawn": "" if contexts is None else contexts.why,
                "different": len(coverage.contexts),
                "without_clip": 0.0 if contexts is None else contexts.without,
                "not_mirrored": [] if contexts is None else list(contexts.not_mirrored),
                "asked_by": dict(self.axes),
                "items": [_context_json(each) for each in coverage.contexts[:MOST_CONTEXTS]],
            },
            "maps": {name: self._map_json(name) for name in MAPS},
            "to_capture": [each.to_json() for each in coverage.to_capture],
            "never_valid": list(coverage.never_valid),
            "dead_frames": [{"asset": clip.asset, "dead": clip.n_dead, "frames": clip.n_frames} for clip in coverage.dead],
            "near": [near.to_json() for near in coverage.near],
            "transitions": coverage.transitions.to_json(),
            "rows_without_clip": list(self.without_clip),
        }

    def _map_json(self, name: str) -> dict[str, object]:
        coverage = self.coverage
        parts: dict[str, Mapping[str, Any]] = {
            "frames": coverage.frames,
            "filled": coverage.filled_shares,
            "wanted": coverage.wanted_shares,
            "holes": coverage.hole_shares,
        }
        return {part: of[name].tolist() for part, of in parts.items()}


def _context_json(each: ContextCoverage) -> dict[str, object]:
    contexts = each.contexts
    return {
        "id": contexts.id,
        "share": contexts.share,
        "cells": dict(contexts.cells),
        "assets": sorted(contexts.assets),
        "mirrored": sorted(contexts.mirrored),
        "covered": each.covered,
        "wanted": each.n_wanted,
        "holes": each.n_holes,
        "maps": {name: {"frames": each.frames[name].tolist(), "holes": each.holes[name].astype(int).tolist()} for name in MAPS},
    }


@dataclass(frozen=True, eq=False)
class ProjectMotion:
    """The motion coverage of a project: of each table with clips, then of the databases without a table.

    Databases with roles are left out: their clips are chosen together, so none fills a movement alone.
    `unlisted` are the clips that no table has a row for, though a database that they fit names one.
    """

    tables: tuple[TableMotion, ...]
    unlisted: tuple[str, ...]


def motion_coverage(
    project: Project,
    databases: Mapping[str, MotionDatabase] | None = None,
    *,
    axes: Mapping[str, str] | None = None,
    pattern: str = PATTERN,
    near_cost: float = NEAR_COST,
    seed: int = 0,
    progress: Tell | None = None,
) -> ProjectMotion:
    """Measure where in speed, turn and direction the clips of a project have nothing, for all contexts of its tables.

    Joint clips do not count: they follow no stick.

    Parameters
    ----------
    project : Project
    databases : mapping of str to MotionDatabase, optional
        Its databases, by name. Default: the saved ones that are up to date are opened, the others built.
    axes : mapping of str to str, optional
        For "speed" (m/s), "turn" (degrees a second) and "direction" (degrees, of movement against facing) the condition that says
        what is requested. Default: the number conditions named "speed" and "turn" that have min and max.
    pattern : str
        How clips of transitions are named.
    near_cost : float
        Clips that lie within this cost of another are listed.
    seed : int
        Of contexts that have to be drawn.
    progress : function of (done, total, clip name), optional

    Raises
    ------
    MotionError, FileError, SchemaError
        What building the databases raises; also when none is declared, or all are of joint clips.
    ContextError
        An argument of another type, or a condition of `axes` that no table with clips has.
    """
    require_kind(project, Project, "project", "a Project")
    require_counts(seed=seed)
    config = MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
    assets = {name: leaf_assets(table) for name, table in project.tables.items()}
    built = (
        open_or_build(config, project.folder, assets, progress)
        if databases is None
        else dict(require_mapping(databases, "databases", DATABASES))
    )
    missing, unlisted = unmatched(config.databases.values(), project.folder, assets)
    groups = _by_table(config, built)
    tables = {name: table for name, table in project.tables.items() if name in groups}
    axes_of = _axes(tables, axes)
    options: dict[str, Any] = {"pattern": pattern, "near_cost": near_cost, "progress": progress}
    tables_covered = [
        _of_table(table, groups[name], axes_of[name], tuple(missing.get(name, ())), seed, options) for name, table in tables.items()
    ]
    if None in groups:
        tables_covered.append(TableMotion(coverage(groups[None], **options)))
    return ProjectMotion(tuple(tables_covered), tuple(unlisted))


def _by_table(config: MotionConfig, built: Mapping[str, MotionDatabase]) -> dict[str | None, dict[str, MotionDatabase]]:
    """The databases of each table, without those of joint clips; None: of no table."""
    groups: dict[str | None, dict[str, MotionDatabase]] = {}
    for name, settings in config.databases.items():
        if name in built and not settings.roles:
            groups.setdefault(settings.table, {})[name] = built[name]
    if built and not groups:
        raise MotionError(Fault("all databases hold joint clips, which follow no stick.", "clips that one character plays alone"))
    return groups


def _of_table(
    table: Table,
    databases: Mapping[str, MotionDatabase],
    axes: Mapping[str, str],
    missing: tuple[str, ...],
    seed: int,
    options: Mapping[str, Any],
) -> TableMotion:
    clips = {asset for database in databases.values() for asset in database.assets}
    mirrored = {
        asset
        for database in databases.values()
        for asset, is_mirrored in zip(database.assets, database.mirrored.tolist(), strict=True)
        if is_mirrored
    }
    contexts = clip_contexts(table, clips, mirrored, axes=axes, seed=seed)
    covered = coverage(databases, contexts.contexts, table=table.name, never_valid=contexts.never_valid, **options)
    return TableMotion(covered, contexts, axes, missing)


def _axes(tables: Mapping[str, Table], axes: Mapping[str, str] | None) -> dict[str, dict[str, str]]:
    """For each table the conditions that say what is requested."""
    named = {name: queried_axes(table) for name, table in tables.items()}
    for axis, condition in require_mapping(axes or {}, "axes", 'a mapping such as {"speed": "wanted_speed"}').items():
        if axis not in (SPEED, TURN, DIRECTION):
            raise ContextError(Fault(f"nothing is measured that is called {in_quotes(str(axis))}.", some((SPEED, TURN, DIRECTION))))
        has = set(_having(tables, condition))
        if not has:
            known = sorted({c.condition.name for t in tables.values() for c in t.flat().conditions if is_axis(c.condition)})
            problem = f"no table with clips has a condition {in_quotes(str(condition))} of numbers with min and max."
            accepted = some(known) or "none: no condition is an angle, or a number with min and max"
            raise ContextError(Fault(problem, accepted, mend_for(str(condition), known)))
        for name in has:
            named[name][axis] = condition
    return named


def _having(tables: Mapping[str, Table], condition: str) -> Iterator[str]:
    for name, table in tables.items():
        if any(c.condition.name == condition and is_axis(c.condition) for c in table.flat().conditions):
            yield name
