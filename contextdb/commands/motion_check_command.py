"""Find what is wrong with clips, markup and motion settings: missing bones, other units and axes, jumps, markup without effect.

Every clip is read as a build reads it. Where no motion database is declared, all clips below the folder are checked. Exits with 1
if there are findings at the level of --fail-on, with 2 if there is no such folder.

  contextdb motion check game/
  contextdb motion check game/ --fail-on error --format github
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

from contextdb.authoring.clip_folder import clips_below
from contextdb.commands import add_format_arguments
from contextdb.commands.check_command import printed
from contextdb.commands.progress import building_bar
from contextdb.console import ExitCode
from contextdb.errors import ContextDBError, Fault, Place, plural
from contextdb.findings import Finding
from contextdb.motion.storage.building import CACHE_FOLDER
from contextdb.motion.storage.checking import check_clips, check_motion
from contextdb.motion.storage.config import MotionConfig
from contextdb.report.results import CheckReport
from contextdb.tables.project import SCHEMA_FILE, Project, folder_of
from contextdb.tables.table import leaf_assets

FORMATS = ("text", "json", "github", "junit", "markdown")


@dataclass(frozen=True, slots=True)
class MotionReport(CheckReport):
    """The findings, and of each database how many clips can be used; "" is the database of clips that are in none."""

    n_clips: dict[str, int] = field(default_factory=dict)

    @property
    def summary(self) -> str:
        """How much was checked, and how many findings of each level there are."""
        counts = CheckReport((), self.findings).summary.partition(": ")[2]
        if self.n_clips.keys() == {""}:
            return f"{plural(self.n_clips[''], 'clip')} checked: {counts}"
        databases, clips = plural(len(self.n_clips), "database"), plural(sum(self.n_clips.values()), "clip")
        return f"{databases} and {clips} checked: {counts}"

    def condensed(self) -> MotionReport:
        """The report for people: what many clips have in common is reported for the first, with how many others have it."""
        alike: dict[tuple[str, ...], list[Finding]] = {}
        for i, finding in enumerate(self.findings):
            mend = finding.message.partition(" Expected: ")[2]
            alike.setdefault((finding.rule, mend) if mend else (finding.rule, mend, str(i)), []).append(finding)
        return replace(self, findings=tuple(_of_all(findings) for findings in alike.values()))

    def to_json(self) -> dict[str, object]:
        databases = [{"database": name or None, "clips": n_clips} for name, n_clips in self.n_clips.items()]
        return {"format": 1, "findings": [finding.to_json() for finding in self.findings], "databases": databases}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("path", metavar="PATH", help=f"a folder of tables, or its {SCHEMA_FILE}")
    add_format_arguments(parser, FORMATS)
    parser.add_argument(
        "--fail-on",
        metavar="LEVEL",
        choices=("error", "warning", "none"),
        default="warning",
        help="the lowest level that fails: error, warning or none (default: warning)",
    )
    parser.add_argument("--all", action="store_true", help="print every finding, not the first few of each kind")
    parser.add_argument("--no-cache", action="store_true", help="compute every clip, and cache nothing")


def run(arguments: argparse.Namespace) -> ExitCode:
    report = check_path(arguments.path, cache=not arguments.no_cache)
    is_for_people = arguments.format in ("text", "markdown") and not arguments.all
    return printed(report.condensed() if is_for_people else report, arguments)


def check_path(path: str, *, cache: bool = True) -> MotionReport:
    """Check the motion of a folder; settings that cannot be read are findings too. Raises FileError where there is no
    such folder."""
    folder = folder_of(Path(path))
    clips = clips_below(folder)
    if clips and not (folder / SCHEMA_FILE).exists():
        return _of_clips(clips)
    try:
        project = Project.load(folder, strict=False)
        config = MotionConfig.from_dict(project.schema.motion, tables=project.tables, file=project.schema.file)
    except ContextDBError as error:
        return MotionReport((), tuple(_as_findings(error.faults)))
    if not config.databases:
        accepted = 'a section such as [databases.jog] with features and clips = "clips/*.bvh"'
        none = Fault("no motion database is declared.", accepted, place=Place(str(folder / SCHEMA_FILE)), rule="no-databases")
        findings = _of_clips(clips)
        return replace(findings, findings=(Finding.of(none), *findings.findings))
    assets = {name: leaf_assets(table) for name, table in project.tables.items()}
    with building_bar() as progress:
        checked = check_motion(config, folder, assets, progress, cache=CACHE_FOLDER if cache else None)
    return MotionReport((), checked.findings, n_clips=checked.n_clips)


def _of_clips(paths: list[Path]) -> MotionReport:
    """The report on clips that no database names."""
    with building_bar() as progress:
        checked = check_clips(paths, progress)
    return MotionReport((), checked.findings, n_clips=checked.n_clips)


def _of_all(findings: list[Finding]) -> Finding:
    first, *others = findings
    return replace(first, message=f"{first.message} ({plural(len(others), 'other clip')} likewise.)") if others else first


def _as_findings(faults: Iterable[object]) -> list[Finding]:
    return [Finding.of(fault if isinstance(fault, Fault) else Fault(str(fault))) for fault in faults]
