"""A session opened with the databases of its project, which may have to be built in memory first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from contextdb.errors import ContextDBError, Fault, MotionError, Place
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.storage.building import open_or_build, saved_path
from contextdb.motion.storage.config import MotionConfig
from contextdb.motion.storage.stored import open_database
from contextdb.motion.trace.filter_rows import is_recorded
from contextdb.motion.trace.session import Trace
from contextdb.motion.trace.timeline import timeline_of
from contextdb.tables.project import Project

from .recording import Figures, Recording


def measures_of(path: Path) -> tuple[float, Figures]:
    """How long a session is, and how it jumps. Raises ContextDBError for what is none."""
    line = timeline_of(Trace.load(path))
    return line.seconds, Figures.of(line)


def opened(path: Path, folder: Path) -> Recording:
    """A session with the databases of a project. Raises ContextDBError where it is no session, or has no decision. What else is
    wrong, such as databases that are gone, `Recording.missing` says."""
    trace = Trace.load(path)
    if not len(trace):
        raise MotionError(Fault("the session has no decision.", "one with at least an update", place=Place(str(path))))
    try:
        databases = _databases(folder, trace.about)
        missing = trace.use(databases)
    except ContextDBError as error:
        databases, missing = {}, str(error.faults[0])
    return Recording(str(path), trace, str(folder), databases, missing)


def databases_of(folder: Path, names: Iterable[str] | None = None) -> dict[str, MotionDatabase]:
    """Databases of a project by their names, or all: those that are saved and up to date, the others built."""
    project = Project.load(folder)
    config = MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
    wanted = [name for name in (config.databases if names is None else names) if name in config.databases]
    assets = {name: table.compile().leaves for name, table in project.tables.items()}
    return open_or_build(config, project.folder, assets, names=wanted)


def _databases(folder: Path, about: Mapping[str, Mapping[str, Any]]) -> dict[str, MotionDatabase]:
    """Those that a session was recorded with; saved ones are opened without a look at the clips."""
    databases = {}
    for name, declared in about.items():
        try:
            database = open_database(saved_path(folder, name))
        except ContextDBError:
            break
        if not is_recorded(declared, database):
            break
        databases[name] = database
    return databases if len(databases) == len(about) else databases_of(folder, about)
