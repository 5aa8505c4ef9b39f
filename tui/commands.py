"""Every command of the editor, once: its keys, what it is called, what it does, and what runs. Data only.

Key bindings, the footer, the command palette, the help on F1, the keymap file and docs/keys.md are all made from this list.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Literal

from textual.binding import Binding, BindingType

from .model.selection import Selection
from .model.sheet import Done, Sheet

Scope = Literal["grid", "assets", "screen"]
"""Where an action runs: in the grid, in the pane round it, or on the screen."""
Verb = Callable[[Sheet], Done]


@dataclass(frozen=True)
class Command:
    """One thing that can be done."""

    id: str
    """Names it in a keymap file."""
    keys: str
    """With commas between, first one that every terminal sends; empty: only by the palette or the mouse."""
    label: str
    about: str
    """A sentence for the palette and the help."""
    group: str
    action: str = ""
    """The Textual action of its scope; empty: the verb is called."""
    verb: Verb | None = None
    """An edit of the sheet."""
    scope: Scope = "grid"
    in_footer: bool = False
    is_listed: bool = True
    """False: too small for the palette; it is in the help with its neighbours."""

    def binding(self) -> Binding | None:
        """The command as a Textual binding; None without keys. The screen has those of the assets' pane, for every tab."""
        action = f"command('{self.id}')" if self.scope == "assets" else self.run
        return Binding(self.keys, action, self.label, show=self.in_footer, id=self.id) if self.keys else None

    @property
    def run(self) -> str:
        """The Textual action of its scope."""
        return self.action or f"verb('{self.id}')"


def _moves() -> Iterable[Command]:
    for key, down, right in (("up", -1, 0), ("down", 1, 0), ("left", 0, -1), ("right", 0, 1)):
        for shift in (False, True):
            how, held = ("Select", "shift+") if shift else ("Go", "")
            name = f"{how.lower()}-{key}"
            move = f"move({down}, {right}, {shift})"
            yield Command(name, held + key, f"{how} {key}", f"{how} one cell {key}.", "Move", move, is_listed=False)
            edge = f"edge({down}, {right}, {shift})"
            about = f"{how} {key} to the end of the filled cells."
            yield Command(f"{name}-end", f"ctrl+{held}{key}", f"{how} to edge", about, "Move", edge, is_listed=False)


def _jumps() -> Iterable[Command]:
    ends = (
        ("home", "home", "the row's first cell"),
        ("end", "end", "the row's last cell"),
        ("ctrl+home", "first", "the first cell of all"),
        ("ctrl+end", "last", "the last cell of all"),
    )
    for shift in (False, True):
        how, held = ("Select", "shift+") if shift else ("Go", "")
        for key, jump, where in ends:
            keys = key.replace("ctrl+", f"ctrl+{held}") if "ctrl" in key else held + key
            about = f"{how} to {where}."
            yield Command(
                f"{how.lower()}-{jump}", keys, f"{how} to {jump}", about, "Move", f"jump('{jump}', {shift})", is_listed=False
            )
        for key, pages in (("pageup", -1), ("pagedown", 1)):
            name = f"{how.lower()}-page-{'up' if pages < 0 else 'down'}"
            about = f"{how} a page {'up' if pages < 0 else 'down'}."
            yield Command(name, held + key, f"{how} a page", about, "Move", f"page({pages}, {shift})", is_listed=False)


def _move_down(sheet: Sheet) -> Done:
    return sheet.move_rows(1)


def _move_up(sheet: Sheet) -> Done:
    return sheet.move_rows(-1)


GRID: tuple[Command, ...] = (
    *_moves(),
    *_jumps(),
    Command("select-rows", "alt+r,shift+space", "Select rows", "Select the whole rows of the selection.", "Select", "select_rows"),
    Command("select-columns", "alt+k,ctrl+@,ctrl+space", "Select columns", "Select the whole columns.", "Select", "select_columns"),
    Command("select-all", "ctrl+a", "Select all", "Select every cell.", "Select", "select_all"),
    Command("edit", "f2,enter", "Edit", "Edit the cell; Enter accepts, Esc cancels.", "Edit", "edit", in_footer=True),
    Command("choose", "f4,alt+down", "Choose", "Open the list of accepted values.", "Edit", "choose"),
    Command("edit-empty", "backspace", "Edit empty", "Edit the cell from empty; Esc leaves it as it was.", "Edit", "edit_empty"),
    Command("clear", "delete", "Clear", "Empty the selected cells; an empty condition is Any.", "Edit", "clear"),
    Command("copy", "ctrl+c", "Copy", "Copy the selected cells, also for Excel.", "Edit", "copy"),
    Command("cut", "ctrl+x", "Cut", "Copy the selected cells and empty them.", "Edit", "cut"),
    Command("paste", "ctrl+v", "Paste", "Paste cells; rows that are missing are added.", "Edit", "paste"),
    Command(
        "fill-down", "ctrl+d", "Fill down", "Copy the first selected row into the others.", "Edit", verb=lambda s: s.fill_down()
    ),
    Command(
        "fill-right",
        "ctrl+r",
        "Fill right",
        "Copy the first selected column into the others.",
        "Edit",
        verb=lambda s: s.fill_right(),
    ),
    Command("mend-all", "", "Mend all", "Mend every cell of the column that can be.", "Edit", verb=lambda s: s.mend_all()),
    Command(
        "fill-series",
        "ctrl+t",
        "Fill series",
        "Continue the series of the first selected cells: _v1, _v2.",
        "Edit",
        verb=lambda s: s.fill_series(),
    ),
    Command("undo", "ctrl+z", "Undo", "Undo the last step; in the test row the last fact.", "Edit", "undo(False)"),
    Command("redo", "ctrl+y,ctrl+shift+z", "Redo", "Redo the step that was undone.", "Edit", "undo(True)"),
    Command("repeat", "ctrl+u", "Repeat", "Make the last edit again, with what is selected now.", "Edit", "repeat"),
    Command("insert-row", "insert,alt+a", "Insert row", "Insert as many rows above as are selected.", "Rows", "insert_rows(False)"),
    Command("insert-below", "ctrl+n", "Insert below", "Insert as many rows below as are selected.", "Rows", "insert_rows(True)"),
    Command(
        "duplicate", "ctrl+b", "Duplicate", "Copy the selected rows below themselves.", "Rows", verb=lambda s: s.duplicate_rows()
    ),
    Command(
        "delete-rows", "ctrl+k,ctrl+delete", "Delete rows", "Delete the selected rows.", "Rows", verb=lambda s: s.delete_rows()
    ),
    Command(
        "remove-duplicates",
        "",
        "Drop duplicates",
        "Delete each row that is in all columns as one above it.",
        "Rows",
        verb=lambda s: s.remove_duplicates(),
    ),
    Command("row-up", "alt+i,alt+shift+up", "Move up", "Move the selected rows up.", "Rows", verb=_move_up),
    Command("row-down", "alt+m,alt+shift+down", "Move down", "Move the selected rows down.", "Rows", verb=_move_down),
    Command(
        "enable", "ctrl+e", "Enable / disable", "Disable the rows, or enable them again.", "Rows", verb=lambda s: s.enable_rows()
    ),
    Command(
        "delete-columns",
        "alt+delete",
        "Delete columns",
        "Delete the selected columns.",
        "Columns",
        verb=lambda s: s.delete_columns(),
    ),
    Command(
        "column-left", "alt+h,alt+shift+left", "Move left", "Move the column left.", "Columns", verb=lambda s: s.move_column(-1)
    ),
    Command(
        "column-right", "alt+l,alt+shift+right", "Move right", "Move the column right.", "Columns", verb=lambda s: s.move_column(1)
    ),
    Command("sort", "alt+s", "Sort", "Show the rows sorted by this column: up, down, as in the file.", "View", "sort"),
    Command("narrower", "alt+comma", "Narrower", "Make the selected columns narrower.", "View", "widen(-1)"),
    Command("wider", "alt+full_stop", "Wider", "Make the selected columns wider.", "View", "widen(1)"),
    Command("test-row", "f6", "Test row", "Go to the test row, or back to the table.", "Test row", "test_row", in_footer=True),
    Command("open-row", "alt+o", "Open the row", "Open the table that the row refers to.", "Move", "open_row"),
    Command(
        "next-failing", "alt+n", "Next failing", "Go to the next cell that fails, or cannot be read.", "Move", "next_failing(False)"
    ),
    Command("previous-failing", "alt+v", "Previous failing", "Go to the cell before that fails.", "Move", "next_failing(True)"),
    Command("leave", "escape", "Back", "Leave the test row; end a selection.", "Move", "leave", is_listed=False),
)

_OF_ASSETS = (
    Command("find", "ctrl+f", "Find", "Find texts, and replace them.", "Edit", "find", in_footer=True),
    Command("find-next", "f3", "Find next", "Go to the next hit.", "Edit", "find_next(False)"),
    Command("find-previous", "shift+f3", "Find previous", "Go to the previous hit.", "Edit", "find_next(True)"),
    Command("note", "shift+f2", "Note", "Write a note on the cell, for people.", "Edit", "note"),
    Command("colour-rows", "", "Colour rows", "Mark the selected rows with a colour, for people.", "Rows", "colour_rows"),
    Command("insert-copied", "", "Insert copied", "Put what was copied into new rows above.", "Rows", "insert_copied"),
    Command("go-to", "ctrl+g", "Go to", "Go to a row by its number or its asset, or to a column.", "Move", "go_to"),
    Command("filter", "ctrl+l", "Filter", "Show only some of the rows.", "View", "filter"),
    Command("filter-same", "alt+e,alt+f", "Filter same", "Show only rows with the text of this cell.", "View", "filter_same"),
    Command("show-all", "alt+g", "Show all rows", "Remove the filter.", "View", "show_all"),
    Command("columns", "alt+j", "Columns", "All columns: go to one, hide, fold, freeze, edit.", "Columns", "columns"),
    Command("hide-columns", "alt+0", "Hide columns", "Hide the selected columns.", "Columns", "hide_columns"),
    Command("show-columns", "", "Show all columns", "Show hidden columns again.", "Columns", "show_columns"),
    Command("fold", "", "Fold the group", "Fold the columns of one prefix, or open them.", "Columns", "fold"),
    Command("freeze", "", "Freeze columns", "The columns up to this one never scroll.", "Columns", "freeze"),
    Command("sort-then", "alt+t", "Sort then", "Sort rows that are alike by this column, too.", "View", "sort_then"),
    Command("values", "alt+d", "Values", "The values of the column: filter, mend, replace, rename.", "Columns", "values"),
    Command("unfilter", "alt+y", "Filter less", "Remove the last part of the filter.", "View", "unfilter"),
    Command("sort-file", "", "Sort the file", "Sort the rows of the file itself as in the view.", "Rows", "sort_file"),
    Command("autofit", "alt+w", "Autofit", "Make each column as wide as its texts.", "View", "autofit"),
    Command("rename-column", "", "Rename column", "Give the column another name.", "Columns", "rename_column"),
    Command("clear-context", "alt+x", "Clear test row", "Empty the test row.", "Test row", "clear_context"),
)

_OF_SCREEN = (
    Command("help", "f1", "Help", "Every key, and how cells are written.", "Help", "help", in_footer=True),
    Command(
        "palette",
        "ctrl+p",
        "Commands",
        "Find a command by its name.",
        "Help",
        "app.command_palette",
        scope="screen",
        in_footer=True,
    ),
    Command("save", "ctrl+s", "Save", "Write the table to its file.", "File", "save", in_footer=True),
    Command("save-as", "", "Save as", "Write the table to another file, and continue with it.", "File", "save_as"),
    Command("open", "ctrl+o", "Tables", "Go to another table of the folder.", "File", "tables"),
    Command(
        "back", "alt+q,alt+up,alt+b", "Back", "Leave an inner table, and go back to the row that refers to it.", "File", "back"
    ),
    Command("new-table", "", "New table", "Make a table, with the columns of a blueprint.", "File", "new_table"),
    Command("rename-table", "", "Rename table", "Give the table another name, everywhere.", "File", "rename_table"),
    Command("duplicate-table", "", "Duplicate table", "Copy the table and its saved contexts.", "File", "duplicate_table"),
    Command("delete-table", "", "Delete table", "Delete the table's file, after a question.", "File", "delete_table"),
    Command("refresh", "f5", "Refresh", "Read changes from disk; sort and filter again.", "File", "refresh"),
    Command("import", "", "Import", "Read rows from Excel, CSV, Parquet or JSON.", "File", "import"),
    Command("export", "", "Export", "Write the table for Excel or other tools.", "File", "export"),
    Command("history", "alt+z", "Undo history", "Every step; go back to any of them.", "Edit", "history"),
    Command(
        "git-history",
        "shift+f1",
        "Git history",
        "Who changed this cell and row, when and why; the row then and now.",
        "Edit",
        "git_history",
    ),
    Command("autofill", "shift+f4", "Autofill", "Fill columns from the clips.", "Columns", "autofill"),
    Command("add-column", "alt+c", "Add column", "Add a condition or another column.", "Columns", "add_column"),
    Command("rename-role", "", "Rename role", "Give the role of the column another name, everywhere.", "Columns", "rename_role"),
    Command("rename-asset", "", "Rename asset", "Give the asset of the row another name, everywhere.", "Rows", "rename_asset"),
    Command("find-everywhere", "shift+f5", "Find everywhere", "Find a text in all tables.", "Edit", "find_everywhere"),
    Command("column-sheet", "", "Sheet of columns", "Types, units, values, outputs of all columns.", "Columns", "column_sheet"),
    Command("blueprints", "", "Blueprints", "Sets of columns to reuse.", "Columns", "blueprints"),
    Command("contexts", "f9", "Contexts", "Load a saved or recorded context.", "Test row", "contexts", in_footer=True),
    Command("next-context", "f8", "Next context", "Load the next context of the file.", "Test row", "step(1)"),
    Command("previous-context", "f7", "Previous context", "Load the previous context.", "Test row", "step(-1)"),
    Command(
        "changes",
        "",
        "What changes",
        "Which moments your edits change, before you save.",
        "Test row",
        "changes",
    ),
    Command(
        "next-picks",
        "shift+f9",
        "Next picks",
        "Simulate the next 50 picks for the test row: chance seen.",
        "Test row",
        "next_picks",
    ),
    Command("live", "alt+u", "Follow a game", "Let the test row follow a running game, or a recording.", "Test row", "live"),
    Command("live-pause", "shift+f7", "Pause the game", "Pause the game that is followed, or go on.", "Test row", "live_pause"),
    Command("live-back", "alt+8", "A second back", "Go back one second in the game.", "Test row", "live_by(-1)"),
    Command("live-ahead", "alt+9", "A second ahead", "Go ahead one second in the game.", "Test row", "live_by(1)"),
    Command("live-keep", "shift+f8", "Keep the moment", "Save this moment as a context.", "Test row", "live_keep"),
    Command("live-stop", "", "Stop following", "Stop following the game; its last facts stay.", "Test row", "live_stop"),
    Command("actors", "alt+p", "Actors", "The actors for each role, for the test row.", "Test row", "actors"),
    Command(
        "why",
        "f12",
        "Why",
        "Why this row is valid or not; next to the table where there is room.",
        "Test row",
        "why",
        in_footer=True,
    ),
    Command("nearest", "shift+f12", "Nearest rows", "Which rows are nearest to valid; correct cells.", "Test row", "nearest"),
    Command(
        "clip",
        "shift+f11",
        "Animation",
        "Play the clip of the row, of the gap's nearest row, or of what is picked.",
        "View",
        "clip",
    ),
    Command("next-tab", "ctrl+pagedown,alt+right", "Next tab", "Go to the next tab.", "Tabs", "next_tab(1)"),
    Command("previous-tab", "ctrl+pageup,alt+left", "Previous tab", "Go to the previous tab.", "Tabs", "next_tab(-1)"),
    Command("assets", "alt+1", "Assets", "The table.", "Tabs", "tab('assets')"),
    Command("options", "alt+2", "Options", "The settings of the table.", "Tabs", "tab('options')"),
    Command("priorities", "alt+3", "Priorities", "Which database comes first.", "Tabs", "tab('priorities')"),
    Command("coverage", "alt+4", "Coverage", "Which contexts have no asset.", "Tabs", "tab('coverage')"),
    Command("problems", "alt+5", "Problems", "What is wrong with the table.", "Tabs", "tab('problems')"),
    Command("contracts", "alt+6", "Contracts", "What must hold of the table, proved as you type.", "Tabs", "tab('contracts')"),
    Command("motion", "alt+7", "Motion", "The recorded sessions of the project, to debug.", "Tabs", "tab('motion')"),
    Command("quit", "ctrl+q", "Quit", "Quit; asks about unsaved edits.", "File", "quit"),
)

SCREEN: tuple[Command, ...] = tuple(replace(command, scope="screen") for command in _OF_SCREEN)
ASSETS: tuple[Command, ...] = tuple(replace(command, scope="assets") for command in _OF_ASSETS)
COMMANDS: tuple[Command, ...] = (*GRID, *ASSETS, *SCREEN)
BY_ID = {command.id: command for command in COMMANDS}


def bindings(commands: Iterable[Command]) -> list[BindingType]:
    """The commands that have keys as Textual bindings."""
    return [binding for command in commands if (binding := command.binding()) is not None]


JUMPS = {"home": Selection.home, "end": Selection.end, "first": Selection.first, "last": Selection.last}

NAMES = {"pageup": "PgUp", "pagedown": "PgDn", "escape": "Esc", "delete": "Del", "insert": "Ins", "backspace": "Backspace"}
NAMES |= {"comma": ","}


def key_name(key: str) -> str:
    """A key as people write it: "ctrl+shift+left" is "Ctrl+Shift+Left", "left_square_bracket" is "["."""
    if key == "ctrl+@":
        return "Ctrl+Space"
    return "+".join(
        NAMES.get(part) or _sign(part) or (part.upper() if len(part) == 1 else part.capitalize()) for part in key.split("+")
    )


def key_names(keys: str) -> list[str]:
    """The keys of a command as people write them, each once; Ctrl+Space comes as "ctrl+@" or by its name."""
    return list(dict.fromkeys(key_name(key.strip()) for key in keys.split(",") if key.strip()))


def _sign(part: str) -> str:
    """The character that Textual calls by its Unicode name; empty for other keys."""
    try:
        return unicodedata.lookup(part.replace("_", " ")) if "_" in part else ""
    except KeyError:
        return ""
