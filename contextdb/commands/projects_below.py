"""All projects below a folder: their folders, and one check of all of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from contextdb.console import printable
from contextdb.disk import boundary, path_in_quotes
from contextdb.disk.boundary import SCHEMA_FILE, TYPED_ROOT, work_tree
from contextdb.errors import Fault, FileError, Place, plural
from contextdb.findings import Level
from contextdb.report.results import CheckReport
from contextdb.tables.project import folder_of


def project_folders(text: str) -> list[Path]:
    """The folders below a root that have a contextdb.toml, in the order of their paths; hidden folders and links are passed over.
    Raises FileError where there is no such folder, or no project in it."""
    root = folder_of(Path(text), "a folder with projects below it")
    folders = boundary.project_folders(root)
    if not folders:
        place = Place(str(root))
        raise FileError(
            Fault("no project is below the folder.", f"folders with a {SCHEMA_FILE}", path_in_quotes(root.parent), place)
        )
    return folders


def extend_up_to(root: str) -> None:
    """Let projects extend others up to this folder, where no repository says how far and nobody has typed another one."""
    if TYPED_ROOT.get() is None and not (work_tree(Path(os.path.realpath(root))) / ".git").exists():
        TYPED_ROOT.set(Path(root))


@dataclass(frozen=True)
class ProjectCheck:
    """What a check says of one project."""

    folder: Path
    report: CheckReport

    def n_failing(self, failing: Sequence[Level]) -> int:
        return sum(finding.level in failing for finding in self.report.findings)

    def to_json(self, failing: Sequence[Level]) -> dict[str, object]:
        counts = {f"{level}s": sum(f.level == level for f in self.report.findings) for level in ("error", "warning")}
        return {"project": str(self.folder), "tables": len(self.report.tables), **counts, "passed": not self.n_failing(failing)}


@dataclass(frozen=True)
class ProjectsReport(CheckReport):
    """One report of all projects."""

    projects: tuple[ProjectCheck, ...] = ()
    failing: tuple[Level, ...] = ()

    @classmethod
    def of(cls, projects: Sequence[ProjectCheck], failing: Sequence[Level]) -> ProjectsReport:
        reports = [project.report for project in projects]
        tables = tuple(table for report in reports for table in report.tables)
        findings = tuple(dict.fromkeys(finding for report in reports for finding in report.findings))
        contracts = tuple(proof for report in reports for proof in report.contracts)
        return cls(tables, findings, contracts, tuple(projects), tuple(failing))

    @property
    def summary(self) -> str:
        bad = [project for project in self.projects if project.n_failing(self.failing)]
        names = ", ".join(printable(str(project.folder)) for project in bad)
        n = plural(len(self.projects), "project")
        return f"{f'{len(bad)} of {n} fail: {names}.' if bad else f'{n} checked, and none fails.'} {super().summary}"

    def to_json(self) -> dict[str, object]:
        return super().to_json() | {"projects": [project.to_json(self.failing) for project in self.projects]}
