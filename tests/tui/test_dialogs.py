"""What dialogs share: one kind of button, a title and keys in the frame, and room for what is longer than the screen."""

import importlib
import pkgutil
import re
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from typing import Any

import pytest
from terminal import press, screen_text, with_editor
from textual.binding import Binding
from textual.widgets import OptionList

from tui import screens
from tui.screens.ask import ChooseDialog
from tui.screens.context_forms import OpenDialog
from tui.screens.dialog import Dialog
from tui.screens.remarks import RemarksDialog
from tui.widgets.line_list import LineList

KEY = re.compile(r"F\d+|Del|[A-Z]")
REMARKS = [f"column {n} is of another type than its condition" for n in range(1, 31)]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text("Asset,speed\nwalk,0..2\n")
    return file


def test_remarks_are_scrolled_through_to_the_last_and_left_with_escape(path):
    async def script(app, pilot):
        app.push_screen(RemarksDialog("Import moves.csv", REMARKS))
        await press(pilot)
        first = screen_text(app)
        await press(pilot, "end")
        last = screen_text(app)
        await press(pilot, "escape")
        return first, last, isinstance(app.screen, RemarksDialog)

    first, last, is_open = with_editor(path, script)
    assert "Import moves.csv" in first
    assert f"· {REMARKS[0]}" in first
    assert REMARKS[-1] not in first
    assert f"· {REMARKS[-1]}" in last
    assert not is_open


@pytest.mark.parametrize("of", ["choices", "columns", "files"])
def test_home_and_end_go_through_a_list_as_long_as_nothing_is_typed_over_it(path, of):
    for n in range(30):
        (path.parent / f"table{n:02}.csv").write_text("Asset\nwalk\n")
    (path.parent / "contextdb.toml").write_text("".join(f'[conditions.other{n}]\ntype = "bool"\n' for n in range(30)))

    async def script(app, pilot):
        if of == "choices":
            app.push_screen(ChooseDialog("Choose", [f"line {n}" for n in range(30)]))
        elif of == "columns":
            await press(pilot, "alt+c")
        else:
            app.push_screen(OpenDialog(path.parent))
        await press(pilot)
        listed = app.screen.query_one(LineList if of == "files" else OptionList)
        at = lambda: listed.index if of == "files" else listed.highlighted  # noqa: E731
        n_lines = listed.n_lines if of == "files" else listed.option_count
        places = [at()]
        for key in ("end", "home", "end"):
            await press(pilot, key)
            places.append(at())
        await press(pilot, "e", "home")
        return places, n_lines, app.focused.cursor_position, app.focused.value

    places, n_lines, in_text, text = with_editor(path, script)
    assert places == [0, n_lines - 1, 0, n_lines - 1]
    assert (in_text, text) == (0, "e")


def look_of(app, label: str) -> tuple[str, str, bool | None]:
    """The text with its spaces, the ground, and the weight of a button."""
    for strip in app.screen._compositor.render_strips():
        for segment in strip:
            if segment.text.strip() == label:
                return segment.text.replace(label, "…"), segment.style.bgcolor.name, segment.style.bold
    raise AssertionError(label)


def test_what_one_clicks_looks_the_same_in_a_form_and_in_other_dialogs(path):
    async def script(app, pilot):
        await press(pilot, "alt+c")
        form = look_of(app, "Cancel")
        await press(pilot, "escape", "delete", "ctrl+q")
        return form, look_of(app, "Stay")

    form, other = with_editor(path, script)
    assert form == other


def dialogs(of: type = Dialog) -> Iterator[type[Dialog[Any]]]:
    for each in of.__subclasses__():
        yield each
        yield from dialogs(each)


for module in pkgutil.iter_modules(screens.__path__):
    importlib.import_module(f"tui.screens.{module.name}")


@pytest.mark.parametrize("dialog", [each for each in dict.fromkeys(dialogs()) if each.__module__.startswith("tui.")])
def test_the_keys_that_the_frame_names_are_bound(dialog: type[Dialog[Any]]):
    named = {word for part in dialog.keys_text.split(" · ") for word in takewhile(KEY.fullmatch, part.split())}
    bindings = [each for parent in dialog.__mro__ for each in vars(parent).get("BINDINGS", ())]
    bound = {key.strip() for each in bindings for key in (each.key if isinstance(each, Binding) else each[0]).split(",")}
    assert {word.lower().replace("del", "delete") for word in named} <= bound
