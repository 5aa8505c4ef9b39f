"""The commands: one list for keys, palette, help and keymap; each of them runs wherever one is."""

import inspect
import re
from collections import Counter
from pathlib import Path

import pytest
from strategies import IS_FULL, for_each
from terminal import press, screen_text, settled, with_editor

from tui.app import EditorApp
from tui.commands import ASSETS, BY_ID, COMMANDS, GRID, SCREEN, Command
from tui.editor_settings import _KEYS, MODIFIERS
from tui.model.views import Filter
from tui.panes.assets import AssetsPane
from tui.screens.main import MainScreen
from tui.screens.table_screen import TABS, TOOLS
from tui.widgets.grid import Grid

TABLES = {
    "ordinary": "Asset,speed,hit\nwalk,0..2,True\nrun,2..6,Any\njump,Any,False\n",
    "no_rows": "Asset,speed,hit\n",
    "one_column": "Asset\nwalk\nrun\n",
}
UNSENDABLE = {
    "ctrl+h",
    "ctrl+i",
    "ctrl+m",
    "ctrl+j",
    "ctrl+space",
    "alt+enter",
    "shift+enter",
    "ctrl+enter",
    "shift+space",
    "ctrl+shift+z",
}
"""What a terminal without extended keys sends as something else, or not at all."""


def keys_of(command: Command) -> list[str]:
    return [key for key in command.keys.split(",") if key]


# ---- the list


def test_each_command_has_a_name_of_its_own():
    assert len(BY_ID) == len(COMMANDS)


def test_no_two_commands_have_one_key():
    taken = Counter(key for command in COMMANDS for key in keys_of(command))
    assert [key for key, n in taken.items() if n > 1] == []


@for_each(COMMANDS)
def test_every_key_is_one_that_there_is(command):
    for key in keys_of(command):
        *modifiers, last = key.split("+")
        assert set(modifiers) <= set(MODIFIERS)
        assert len(last) == 1 or last in _KEYS


@for_each(COMMANDS)
def test_no_command_has_only_keys_that_terminals_cannot_send(command):
    assert not keys_of(command) or set(keys_of(command)) - UNSENDABLE


@for_each(COMMANDS)
def test_a_command_can_be_found_by_key_palette_or_both_and_says_what_it_does(command):
    assert command.keys or command.is_listed
    assert re.fullmatch(r"[A-Z0-9].*\.", command.about)
    assert len(command.label) <= 16


@for_each(COMMANDS)
def test_the_action_of_a_command_is_there_where_it_runs(command):
    if command.verb is not None:
        assert command.scope == "grid"
        return
    name, _, arguments = command.run.partition("(")
    if name.startswith("app."):
        assert hasattr(EditorApp, f"action_{name.removeprefix('app.')}")
        return
    where = {"grid": Grid, "assets": AssetsPane, "screen": MainScreen}[command.scope]
    found = getattr(where, f"action_{name}", None) or getattr(EditorApp, f"action_{name}")
    n_given = len(arguments.rstrip(")").split(",")) if arguments.rstrip(")") else 0
    inspect.signature(found).bind(None, *range(n_given))


def test_a_command_of_the_pane_has_its_keys_on_the_screen_and_in_every_tab():
    assert {command.scope for command in GRID} == {"grid"}
    assert {command.scope for command in ASSETS} == {"assets"}
    assert {command.scope for command in SCREEN} == {"screen"}


def test_tabs_and_tools_are_commands():
    assert set(TABS) | set(TOOLS) <= set(BY_ID)


# ---- in the editor


async def in_cells(app: EditorApp) -> None:
    app.main.session.sheet.go(0, 1)


async def in_the_test_row(app: EditorApp) -> None:
    app.main.session.sheet.go(0, 1)
    app.main.assets.grid.is_in_test_row = True


async def with_a_bar_open(app: EditorApp) -> None:
    await app.main.assets.action_find()


async def with_all_rows_hidden(app: EditorApp) -> None:
    app.main.session.sheet.set_filter(Filter(text="nowhere"))
    app.main.show()


async def leave(app: EditorApp, pilot) -> None:
    """Back to the table, as it was read."""
    while not isinstance(app.screen, MainScreen) or app.main.assets.editor is not None:
        await press(pilot, "escape")
    assert isinstance(app.screen, MainScreen)
    for bar in app.main.query("FindBar, FilterBar"):
        bar.remove_class("-open")
    await app.main.run_action("tab('assets')")
    sheet = app.main.session.sheet
    while sheet.history.position:
        sheet.undo()
    app.main.assets.grid.is_in_test_row = False
    app.main.assets.action_show_all()
    sheet.set_sort(None)
    app.main.show()
    await settled(pilot)


STATES = [
    ("ordinary", in_cells),
    ("ordinary", in_the_test_row),
    ("ordinary", with_all_rows_hidden),
    ("no_rows", in_cells),
    ("one_column", with_a_bar_open),
]


@pytest.mark.parametrize(("name", "state"), STATES)
def test_every_command_runs_wherever_one_is(tmp_path, name, state):
    file = tmp_path / f"{name}.csv"
    file.write_text(TABLES[name])
    commands = [command for command in COMMANDS if command.id != "quit"]
    if not IS_FULL:  # each command in one of the states
        place = STATES.index((name, state))
        commands = [command for i, command in enumerate(commands) if i % len(STATES) == place]

    async def script(app: EditorApp, pilot) -> list[str]:
        ran = []
        for command in commands:
            await state(app)
            await app.main.run_command(command.id)
            await settled(pilot)
            assert app._exception is None, f"{command.id}: {app._exception}"
            ran.append(command.id)
            await leave(app, pilot)
            assert app._exception is None, f"after {command.id}: {app._exception}"
        return ran

    assert with_editor(file, script) == [command.id for command in commands]
    assert file.read_text() == TABLES[name]


@pytest.mark.parametrize("name", ["ordinary", "no_rows"])
def test_every_key_of_a_command_does_something_without_a_fault(tmp_path, name):
    file = tmp_path / f"{name}.csv"
    file.write_text(TABLES[name])

    # every day the keys of each second command on each of the tables
    commands = COMMANDS if IS_FULL else COMMANDS[name == "no_rows" :: 2]

    async def script(app: EditorApp, pilot) -> None:
        for command in commands:
            for key in keys_of(command):
                if command.id not in ("quit", "palette"):
                    await press(pilot, key)
                    assert app._exception is None, f"{key} for {command.id}: {app._exception}"
            await leave(app, pilot)

    with_editor(file, script)


def test_the_palette_lists_every_command_with_its_key_and_runs_it(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text(TABLES["ordinary"])

    async def script(app: EditorApp, pilot) -> tuple[set[str], int]:
        titles = {command.title for command in app.get_system_commands(app.screen)}
        await press(pilot, "ctrl+p", *"duplicate")
        await press(pilot, "enter")
        await settled(pilot)
        return titles, app.main.session.sheet.table.n_rows

    titles, n_rows = with_editor(file, script)
    assert titles >= {command.label for command in COMMANDS if command.is_listed and command.id != "palette"}
    assert n_rows == 4


def test_the_help_names_every_command(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text(TABLES["ordinary"])

    async def script(app: EditorApp, pilot) -> str:
        await press(pilot, "f1")
        shown = []
        for _ in range(16):
            shown.append(screen_text(app))
            await press(pilot, "pagedown")
        return "\n".join(shown)

    shown = with_editor(file, script, size=(120, 40))
    assert [c.about for c in COMMANDS if c.about not in shown] == []


def test_a_cell_in_markup_is_shown_as_it_is_in_the_help_line_and_in_the_messages(tmp_path: Path):
    file = tmp_path / "t.csv"
    file.write_text("Asset,[/] x\n[red]walk[/],[/]\n")

    async def script(app: EditorApp, pilot) -> str:
        await press(pilot, "right", "delete", "ctrl+z", "left", "x", "enter")
        return screen_text(app)

    shown = with_editor(file, script)
    assert "[/] x" in shown
