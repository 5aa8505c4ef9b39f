"""Sessions as a page, for a viewer, or as a comment: what `contextdb motion replay --html`, `--rrd` and `--markdown` give."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from contextdb.commands.motion_build_command import MotionProject
from contextdb.disk import path_in_quotes, write_atomic
from contextdb.errors import Fault, FileError, MotionError, Place, plural
from contextdb.motion import MotionDatabase, PoseBank, PoseSettings, measure, open_or_build_poses
from contextdb.motion.trace.session import Trace
from contextdb.report import session_html, session_markdown, session_rerun
from contextdb.report.measure_results import SessionMeasures
from contextdb.report.session_data import SessionView
from contextdb.report.session_view import view_of

SUFFIX = ".html"


@dataclass(frozen=True, eq=False)
class Played:
    """A session with its project's folder, and the databases and the poses of it; the databases are those that are what was
    recorded."""

    file: str
    trace: Trace
    folder: str
    databases: Mapping[str, MotionDatabase]

    @cached_property
    def project(self) -> MotionProject:
        return MotionProject.load(self.folder)

    @cached_property
    def banks(self) -> dict[str, PoseBank]:
        names = [name for name in self.trace.about if name in self.project.config.databases]
        if not names:
            fault = "its poses cannot be made: the project has none of its databases."
            raise MotionError(Fault(fault, "--project FOLDER with the project that it was recorded with", place=Place(self.file)))
        return open_or_build_poses(self.project.config, self.project.folder, self.project.assets, names=names)

    @property
    def settings(self) -> PoseSettings:
        return self.project.config.output_of(self.trace.controller)

    @cached_property
    def measured(self) -> SessionMeasures:
        measures = measure(self.trace, self.banks, databases=self.databases or None, settings=self.settings)
        return SessionMeasures(self.file, measures, {}, ())

    def view(self, *, with_candidates: bool = True) -> SessionView:
        """What the page displays, with the candidates of each search or without."""
        rows = {label: (value, raw) for label, value, raw, _ in self.measured.rows()}
        reasked = self.trace.reasked(self.databases) if self.databases and with_candidates else None
        return view_of(os.path.basename(self.file), self.trace, self.banks, self.settings, reasked, rows)


def page_file(name: str, what: str = "a page", suffix: str = SUFFIX) -> Path:
    """Where a page is to be written, refused before the work where it could only be refused after."""
    path, place = Path(name), Place(name)
    if path.suffix != suffix:
        raise FileError(Fault(f"{what} cannot be written to such a file.", f"a name that ends in {suffix}", place=place))
    if not os.path.isdir(path.parent):
        fault = f"there is no folder {path_in_quotes(path.parent)}."
        raise FileError(Fault(fault, "an existing folder", place=place, rule="no-such-path"))
    return path


def write_page(out: Path, sessions: Sequence[Played]) -> None:
    """Write the page of a session, or of two side by side."""
    write_atomic(out, session_html.render([each.view() for each in sessions], parting=parting_of(sessions)).encode())


def rerun_file(name: str) -> Path:
    """Where a recording for Rerun is to be written; raises MotionError without rerun-sdk."""
    session_rerun.require_rerun()
    return page_file(name, "a recording for Rerun", ".rrd")


def write_rerun(out: Path, session: Played) -> None:
    """Write a session as a recording for the Rerun viewer."""
    times_s = [decision.time_s for decision in session.trace.brief()]
    write_atomic(out, session_rerun.render(session.view(with_candidates=False), times_s))


def comment_of(sessions: Sequence[Played], page: str | None) -> str:
    """The sessions as Markdown, with the name of their page."""
    lists = [list(each.trace.brief()) for each in sessions]
    return session_markdown.render([each.measured for each in sessions], lists, parting_of(sessions), page)


def parting_of(sessions: Sequence[Played]) -> str:
    """Where two sessions part, in a sentence or two; "" of one."""
    if len(sessions) < 2:
        return ""
    one, other = sessions
    parting = one.trace.diff(other.trace)
    if parting.parting is None:
        return "Both play the same." if not parting.longer else "Both play the same as long as both last."
    where, names = parting.parting, [os.path.basename(each.file) for each in sessions]
    plays = f"{names[0]} plays {where.one or 'nothing'}, {names[1]} {where.other or 'nothing'}"
    others = f"Of {plural(parting.updates, 'update')}, {parting.other_assets:,} play another asset."
    return f"They part at {where.time_s:.2f} s: {plays}. {others}"
