"""Rename, copy and delete the table that is displayed, with the files beside it. All of it is written at once."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from contextdb.edits.table_files import copy_table, delete_table, rename_table
from contextdb.errors import Fault, TableError, in_quotes

from ..model.new_table import name_fault
from .ask import AskDialog, SureDialog


class TableFiles:
    """The verbs of one screen about its table's file."""

    def __init__(self, screen: Any) -> None:
        self.screen = screen

    def rename(self) -> None:
        """Ask for another name, and go on under that."""
        self._with_name("Rename table", rename_table, leaves=True)

    def duplicate(self) -> None:
        """Ask for a name, and go to the copy."""
        self._with_name("Duplicate table", copy_table, leaves=False)

    def delete(self) -> None:
        """Ask, delete the table, and go to another one of the folder."""
        screen = self.screen
        name, workspace = screen.table_name, screen.workspace
        others = [one for one in workspace.files if one != name]

        def decided(answer: bool | None) -> None:
            if answer:
                screen.try_to(lambda: self._delete(name, others[0]))

        if not others:
            screen.say("This is the only table of the folder.", "warning")
            return
        question = f"Delete {workspace.files[name].name}, with its saved contexts, notes and actors? Ctrl+Z does not bring it back."
        screen.app.push_screen(SureDialog("Delete table", question), decided)

    # ---- parts

    def _with_name(self, title: str, write: Callable[[Path, str, str], Path], leaves: bool) -> None:
        screen = self.screen
        workspace, old = screen.workspace, screen.table_name

        check = partial(name_fault, workspace.folder, taken=workspace.files)
        text = old if leaves else f"{old}_copy"
        AskDialog(title, "The name of the table and its file", text, check).ask(
            screen.app, lambda answer: screen.try_to(lambda: self._write(write, answer.strip(), leaves))
        )

    def _write(self, write: Callable[[Path, str, str], Path], new: str, leaves: bool) -> None:
        screen = self.screen
        workspace, old = screen.workspace, screen.table_name
        self._require_saved(list(workspace.sessions) if leaves else [old])
        path = write(workspace.folder, old, new)
        if leaves:
            workspace.forget()
        workspace.look_again()
        screen.app.open_table(new)
        screen.app.say_renamed(f"{old} is now {path.name}." if leaves else f"{path.name} is a copy of {old}.")

    def _delete(self, name: str, next_name: str) -> None:
        workspace = self.screen.workspace
        self._require_saved([one for one in workspace.sessions if one != name])
        if workspace.session(name).why_read_only:
            raise TableError(Fault(f"{in_quotes(name)} can be read only.", "a table that can be written"))
        delete_table(workspace.folder, name)
        workspace.forget()
        workspace.look_again()
        self.screen.app.open_table(next_name)
        self.screen.app.say_renamed(f"{name} is deleted.")

    def _require_saved(self, names: list[str]) -> None:
        workspace = self.screen.workspace
        if waiting := [one for one in names if one in workspace.unsaved]:
            problem = f"{in_quotes(waiting[0])} has unsaved edits, and this is written at once."
            raise TableError(Fault(problem, "tables that are saved", "to save first: Ctrl+S"))
        if held := [one for one in names if workspace.sessions[one].is_read_only]:
            raise TableError(Fault(f"{in_quotes(held[0])} can be read only.", "tables that can be written"))
