"""Renames of columns, values, roles and assets: what else names them is displayed, and all of it goes along, or only this table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from contextdb.edits.renaming import Renaming, Uses, renaming, uses_of
from contextdb.edits.renaming_assets import asset_renaming, asset_uses, facts_of, role_renaming, role_uses
from contextdb.edits.renaming_values import ValueUses, value_renaming, value_uses
from contextdb.errors import some
from contextdb.files.toml_shapes import wrong_name

from ..editor import Editor
from ..messages import Edited, RenameWanted, ValueRenameWanted
from ..model.column_values import replaced
from ..model.session import Session
from ..model.workspace import Workspace
from .ask import AskDialog, ChooseDialog

WRITTEN = "Everywhere and only here are written to the files at once, as one step that Ctrl+Z takes back."


class Renamed(Protocol):
    """What a rename needs of the screen: `tui.screens.main.MainScreen`."""

    app: Editor
    session: Session
    workspace: Workspace
    table_name: str

    def say(self, text: str, level: str = "information") -> None:
        """Say something in a line below."""

    def try_to(self, verb: Callable[[], None]) -> None:
        """Do something; what cannot be done is reported."""

    def edited(self, event: Edited) -> None:
        """The sheet was edited."""


class Renames:
    """The renames of one screen."""

    def __init__(self, screen: Any) -> None:
        self.screen: Renamed = screen

    # ---- columns and values

    def column(self, event: RenameWanted) -> None:
        """Rename a column; where others speak of its condition, ask whether they go along."""
        sheet, old, new = self.screen.session.sheet, event.old, event.new
        uses = uses_of(sheet.table, old) if sheet.path is not None and old in sheet.query.wanted.conditions else Uses()
        if not uses.text:
            self._step(lambda: sheet.rename_column(new))
            return
        here = f"Only here: this table, its rules and saved contexts; others keep {old}" if uses.is_elsewhere else ""

        def write(only_here: bool) -> Renaming:
            return renaming(sheet.table, old, new, only_here)

        self._ask(old, new, f"{old} is used by {uses.text}.", here, write, {old: new})

    def value(self, event: ValueRenameWanted) -> None:
        """Rename a value; where others speak of it, ask whether they go along."""
        sheet, name, old, new = self.screen.session.sheet, event.column, event.old, event.new
        condition = next((c.condition for c in sheet.table.conditions if c.condition.name == name), None)
        is_declared = condition is not None and condition.is_declared and old in (condition.domain.values or ())
        uses = value_uses(sheet.table, name, old) if is_declared else ValueUses()
        if not uses.text:
            self._step(lambda: sheet.rename_value(old, new))
            return
        about = f"{old} of {name} is used by {uses.text}.{_named(uses.tables)}"
        here = f"Only here: the cells of this table; {old} stays a value for others"

        def step() -> None:
            self._step(lambda: sheet.rename_value(old, new, keeps_old=True))

        self._ask(old, new, about, here, lambda _: value_renaming(sheet.table, name, old, new), {}, step)

    # ---- roles and assets

    def role(self) -> None:
        """Ask for another name of the role of the cursor's column, and whether all that speaks of it goes along."""
        sheet = self.screen.session.sheet
        old = sheet.table.columns[sheet.selection.column].name.partition(".")[0]
        if not facts_of(sheet.table, old):
            self.screen.say("This column belongs to no role: those of one are called like Defender.DepthChart.", "warning")
            return

        def named(new: str) -> None:
            if new.strip() != old:
                self.screen.try_to(lambda: self._role(old, new.strip()))

        AskDialog("Rename the role", f"Another name for {old}", old, _wrong_role).ask(self.screen.app, named)

    def _role(self, old: str, new: str) -> None:
        table = self.screen.session.sheet.table
        uses, tables = role_uses(table, old)
        names = {name: f"{new}.{name.removeprefix(f'{old}.')}" for name in facts_of(table, old)}
        here = f"Only here: this table, its rules, actors and saved contexts; others keep {old}"
        about = f"{old} is used by {uses}.{_named(tables)}"
        self._ask(old, new, about, here, lambda only_here: role_renaming(table, old, new, only_here), names)

    def asset(self) -> None:
        """Ask for another name of the asset of the cursor's row, and whether all that speaks of it goes along."""
        sheet = self.screen.session.sheet
        if not len(sheet.view):
            self.screen.say("There is no row here.", "warning")
            return
        old = sheet.text(sheet.cursor[0], sheet.asset_at)

        def named(new: str | None) -> None:
            if new is not None and new.strip() != old:
                self.screen.try_to(lambda: self._asset(old, new.strip()))

        AskDialog("Rename the asset", f"Another name for {old}", old, _wrong_asset).ask(self.screen.app, named)

    def _asset(self, old: str, new: str) -> None:
        sheet = self.screen.session.sheet
        uses = asset_uses(sheet.table, old)
        clips = f"\nThe clip {some(uses.clips)} keeps its name: rename that file, too." if uses.clips else ""
        if not uses.text and not uses.clips:
            self._step(lambda: sheet.apply(replaced(sheet.table, sheet.table.asset_column, {old: new}, f"Rename {old} to {new}")))
            return
        about = f"{old} is used by {uses.text or 'a clip'}.{_named(uses.tables)}{clips}"
        here = f"Only here: this table, its fallback and its saved contexts; others keep {old}"
        self._ask(old, new, about, here, lambda only_here: asset_renaming(sheet.table, old, new, only_here), {})

    # ---- take back

    def undo(self, is_redo: bool) -> None:
        """Take the last rename back that was written to the files, or make it again."""
        workspace, name = self.screen.workspace, self.screen.table_name
        verb = "redo" if is_redo else "undo"

        def write() -> None:
            renaming = workspace.undo_rename(name, is_redo)
            if renaming is None:
                self.screen.say(f"There is nothing to {verb}.")
            else:
                self._written(f"{verb.capitalize()}: Rename {renaming.old} to {renaming.new}.")

        self.screen.try_to(write)

    # ---- parts

    def _step(self, verb: Callable[[], Any]) -> None:
        self.screen.try_to(lambda: self.screen.edited(Edited(verb())))

    def _ask(
        self,
        old: str,
        new: str,
        about: str,
        here: str,
        write: Callable[[bool], Renaming],
        names: Mapping[str, str],
        step: Callable[[], None] | None = None,
    ) -> None:
        """Ask whether a name is changed everywhere or only here; `step` renames it here without a word to the files."""
        lines = ["Rename everywhere: in all that uses it", *([here] if here else []), "Cancel"]

        def chosen(at: int) -> None:
            if at == len(lines) - 1:
                return
            if at == 1 and step is not None:
                step()
            else:
                self.screen.try_to(lambda: done(at == 1))

        def done(only_here: bool) -> None:
            files = self.screen.workspace.rename(self.screen.table_name, write(only_here), names)
            where = "here" if only_here else "everywhere"
            self._written(f"Renamed {old} to {new} {where}, in {some(files)}. Ctrl+Z takes it back.")

        ChooseDialog(f"Rename {old} to {new}", lines, about=f"{about}\n{WRITTEN}").ask(self.screen.app, chosen)

    def _written(self, message: str) -> None:
        row, column = self.screen.session.sheet.cursor
        self.screen.workspace.session(self.screen.table_name).sheet.go(row, column)
        self.screen.app.open_table(self.screen.table_name)
        self.screen.app.say_renamed(message)


def _named(tables: Sequence[str]) -> str:
    return f"\nTables: {', '.join(tables)}." if tables else ""


def _wrong_role(text: str) -> str:
    name = text.strip()
    wrong = wrong_name(name) or ("it has a dot in it" if "." in name else "")
    return f"This cannot be a role: {wrong}." if wrong else ""


def _wrong_asset(text: str) -> str:
    return "" if text.strip() else "An asset needs a name."
