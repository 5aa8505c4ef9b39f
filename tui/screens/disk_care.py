"""What a screen does about files that others write while it shows them: look once a second, merge, ask, save.

A screen makes one `DiskCare` for its session, has a timer call `look`, and saves through `save`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal, Protocol

from textual.screen import Screen

from contextdb.edits.diffing import diff
from contextdb.errors import ContextDBError, FileError
from contextdb.tables.merging.conflicts import Side
from contextdb.tables.merging.merging import Merge
from contextdb.tables.table import Table

from ..model.session import Session
from .conflicts import ConflictsDialog

LOOK_EVERY_S = 1.0

Level = Literal["information", "warning", "error"]


class Say(Protocol):
    """Show a line to the person."""

    def __call__(self, text: str, level: Level = ...) -> None: ...


class DiskCare:
    """Keeps a session and the files on the disk together."""

    def __init__(self, screen: Screen[Any], session: Session, say: Say, changed: Callable[[], None]) -> None:
        """`changed` shows the sheet again; it is called after every merge and reload."""
        self._screen, self._session, self._say, self._changed = screen, session, say, changed
        self._notice = ""
        """The last message about the disk, so that a timer does not say it again."""
        self._left_stamp: object = None
        """The stamp of a version of the file that is not merged, as the person chose or because it cannot be: until a save."""

    def look(self) -> None:
        """Take in what others did since the last look. Not while a dialog is open."""
        if self._screen.app.screen is not self._screen:
            return
        change = self._session.poll()
        if not change:
            self._notice = ""
            return
        if change.schema != "same":
            self._reload()
        if change.taken_by is not None:
            self._say_once(f"{change.taken_by} has taken over this table: you can only save it under another name.", "warning")
        elif change.is_free:
            self._say_once("The other editor has closed this table: it can be saved here again.")
        elif change.has_left:
            what = "The other editor has ended and left edits that are not saved."
            self._say_once(f"{what} Save yours under another name; then open this table again.", "warning")
        elif change.held_by is not None:
            what = f"{change.held_by} has opened this table: it can be read here, and saved under another name."
            self._say_once(what, "warning")
        if change.table == "gone":
            self._say_once(f"{self._session.path.name} is no longer on disk. Saving creates it again.", "warning")
        elif change.table == "changed" and self._session.disk_stamp != self._left_stamp:
            self._merge_unasked()

    def save(self, path: Path | None = None, overwrite: bool = False, then: Callable[[], None] = lambda: None) -> None:
        """Save; conflicts with what others wrote are resolved first. `then` is called when the table is saved. Raises FileError or
        TableError as `Session.save` does, but for conflicts that can be decided."""
        try:
            self._session.save(path, overwrite)
        except FileError as error:
            if error.faults[0].rule != "merge-conflict":
                raise
            try:
                self.merge(then=lambda: self.save(path, overwrite, then))
            except ContextDBError:
                raise error from None  # what is on the disk is not a table
            return
        then()

    def merge(self, then: Callable[[], None] = lambda: None) -> None:
        """Merge what is on the disk, and ask about conflicts. `then` is called when it is merged. Raises FileError, SchemaError or
        TableError where what is on the disk is gone, no table, or another one."""
        merged = self._session.merge_from_disk()
        if merged.conflicts:
            self._ask(merged, then)
        else:
            self._merged(merged, then)

    # ---- parts

    def _merge_unasked(self) -> None:
        try:
            self.merge()
        except ContextDBError as error:
            self._left_stamp = self._session.disk_stamp
            self._say_once(str(error), "error")

    def _ask(self, merged: Merge[Table], then: Callable[[], None]) -> None:
        def decided(sides: Mapping[int, Side] | None) -> None:
            if sides is None:
                self._left_stamp = self._session.disk_stamp
                self._say("Nothing is merged. The next save asks again.", "warning")
                return
            resolved = merged.resolved(sides)
            if resolved.conflicts:  # a row that comes back can bring new ones
                self._ask(resolved, then)
                return
            self._session.take(resolved)
            self._merged(resolved, then)

        self._screen.app.push_screen(ConflictsDialog(merged.conflicts, self._session.path.name), decided)

    def _merged(self, merged: Merge[Table], then: Callable[[], None]) -> None:
        self._changed()
        changed = diff(merged.ours, self._session.sheet.table)
        message = f"{changed.summary}. Ctrl+Z undoes it." if changed else "nothing changes here."
        lost = [f" {cell}" for cell in merged.lost[:1]] + (
            [f" {len(merged.lost) - 1:,} more cells went so."] if merged.lost[1:] else []
        )
        self._say(f"Merged from disk: {message}{''.join(lost)}", "warning" if lost else "information")
        then()

    def _reload(self) -> None:
        try:
            self._session.reload_schema()
        except ContextDBError as error:
            self._say_once(str(error), "error")
            return
        self._changed()
        self._say("contextdb.toml changed on disk and was read again.")

    def _say_once(self, text: str, level: Level = "information") -> None:
        if text != self._notice:
            self._notice = text
            self._say(text, level)
