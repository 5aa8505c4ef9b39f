"""Screens of the editor for the documents: the editor runs on a copy of tables/, keys are pressed, and its screen is drawn.

A scene is drawn at 80 × 24 and at 160 × 48 characters, some in a light theme and without colour too.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from typing import Any

from drawing import Look, Run, Sheet, svg
from rich.segment import Segment
from rich.style import Style
from slips import Slip, make
from textual.app import App
from textual.pilot import Pilot
from textual.widgets import Input

sys.path.insert(0, str(Path(__file__).parent.parent))

from tui.app import EditorApp
from tui.model.workspace import Workspace
from tui.themes import DARK, LIGHT

SMALL, WIDE, LARGE = (80, 24), (142, 28), (160, 48)
MARGIN_PX = 10
PAPERS = {DARK: ("#14171c", "#d6dae0"), LIGHT: ("#f2f4f7", "#1f2328"), "": ("#171717", "#dadada")}
"""Ground and text of the frame round a screen, by theme."""


@dataclass(frozen=True)
class Scene:
    """A screen: what it shows in a sentence, the table that is open, and the keys that lead there."""

    title: str
    table: str
    keys: tuple[str | Slip, ...]
    size: tuple[int, int] = SMALL
    theme: str = DARK
    has_colour: bool = True
    before: tuple[Slip, ...] = ()
    """What is changed before the table is opened; a slip among the keys is another's change of the open file."""


def typed(text: str) -> tuple[str, ...]:
    """The keys that type a text."""
    names = {" ": "space", ",": "comma", ";": "semicolon", ".": "full_stop", "_": "underscore", "/": "slash"}
    return tuple(names.get(character, character) for character in text)


_BESIDE = Slip(
    "tables/hit_mid_air.csv",
    '\nMidAir_Tackle_Dive_High_Right_D1_v1,False,False,"-20.0000',
    '\nMidAir_Tackle_Dive_High_Right_D1_v1,False,False,"-25',
)
_INSIDE = Slip("tables/hit_mid_air.csv", "\nMidAir_Weak_Tackle_Dive_High_Left_D1_v1,", "\n@contested_catch,")
_SCENES = {
    "sheet": Scene(
        "The editor: a table under its header, with the test row at its foot. Two rows are valid for it; in the others the cells "
        "that fail are marked.",
        "hit_mid_air",
        ("f8", "down", "right", "right", "right"),
    ),
    "cell-bool": Scene(
        "A list under a cell: True, False, Any.",
        "hit_mid_air",
        ("f8", "right", "right", "f4"),
    ),
    "cell-values": Scene(
        "A list of declared values, some ticked.",
        "contested_catch",
        ("right", "right", "right", "right", "f4"),
    ),
    "cell-number": Scene(
        "A cell with bounds, and a picture of them on the domain of the condition.",
        "locomotion",
        ("right", "right", "down", "down", "f2"),
    ),
    "cell-angle": Scene(
        "A cell with a centre and a tolerance, and a dial of the angles that it accepts.",
        "hit_mid_air",
        ("right", "right", "right", "f2"),
    ),
    "cell-refused": Scene(
        "A text that cannot be read stays in the cell's editor, with the reason and the mend.",
        "hit_mid_air",
        ("right", "right", "right", "down", *typed("20; 9.99"), "enter"),
    ),
    "find": Scene(
        "The bar that finds and replaces texts.",
        "hit_mid_air",
        ("ctrl+f", *typed("weak"), "enter"),
    ),
    "filter": Scene(
        "The bar that filters rows, and the rows it leaves.",
        "locomotion",
        ("ctrl+l", *typed("turn")),
    ),
    "contexts": Scene(
        "Saved contexts, each with what it expects and whether that holds.",
        "locomotion",
        ("f8", "f9"),
    ),
    "why": Scene(
        "Why a row is not valid: each condition with its fact, its cell, and the cell that would accept the fact too.",
        "hit_mid_air",
        ("f8", "down", "f12"),
    ),
    "next-picks": Scene(
        "The next 50 picks for the test row: a strip for each valid row, and why at the pick of the cursor.",
        "locomotion",
        ("f8", "shift+f9", *["right"] * 6),
    ),
    "actors": Scene(
        "Actors for the role Defender, one a row: two who may be cast.",
        "contested_catch",
        (
            *("alt+p", *typed("Ivy"), "tab", *typed("CB"), "tab", "t", "tab", "tab", "tab", "t", "enter"),
            *(*typed("Bo"), "tab", *typed("LB"), "tab", "t", "enter", "home"),
        ),
    ),
    "inside": Scene(
        "A row that refers to another table: how many of that table's rows are valid for the test row.",
        "hit_mid_air",
        ("f8", "down", "down"),
        before=(_INSIDE,),
    ),
    "options": Scene(
        "The settings of a table, and the condition of the column that the cursor was in.",
        "locomotion",
        ("right", "right", "alt+2"),
    ),
    "priorities": Scene(
        "The databases of a selector in order, how many assets of each are valid for the test row, and which one decides.",
        "locomotion",
        ("f8", "f8", "f8", "alt+3"),
    ),
    "coverage": Scene(
        "The covered share of the contexts, and the gaps in which no row is valid, largest first.",
        "locomotion",
        ("alt+4",),
    ),
    "column-sheet": Scene(
        "The sheet of columns: each column a row, with its job, type, unit, bounds and values.",
        "locomotion",
        ("alt+j", "e", "down", "down", "right", "right"),
    ),
    "coverage-pairs": Scene(
        "A map of pairs of conditions: how well the least covered combination of their values is covered.",
        "locomotion",
        ("alt+4", "2"),
    ),
    "coverage-pair": Scene(
        "One pair of conditions: how much of each combination of gait and speed is covered.",
        "locomotion",
        ("alt+4", "2", "enter"),
    ),
    "problems": Scene(
        "What is wrong with the table, errors first.",
        "locomotion",
        ("alt+5",),
        before=(Slip("tables/locomotion.csv", "walk_fast,Walk,", "walk_fast,Wallk,"),),
    ),
    "add-column": Scene(
        "Add column: declared conditions that the table lacks, blueprints, or a new column.",
        "locomotion",
        ("alt+c",),
    ),
    "blueprints": Scene(
        "Blueprints: the columns of each, and which of them the table lacks.",
        "locomotion",
        ("ctrl+p", *typed("blueprints"), "enter"),
    ),
    "import": Scene(
        "Import: what each column of the other file becomes.",
        "locomotion",
        ("ctrl+p", *typed("import"), "enter", *typed("moves.txt"), "enter"),
    ),
    "export": Scene(
        "Export: the file, its format and what would be lost in it.",
        "locomotion",
        ("ctrl+p", *typed("export"), "enter"),
    ),
    "conflicts": Scene(
        "A place that somebody else changed too: what it said before, what is here and what is on the disk.",
        "hit_mid_air",
        ("down", "right", "right", "right", *typed("-30"), "enter", _BESIDE, "ctrl+s"),
    ),
    "steps": Scene(
        "Every step that was made, to go back to any of them.",
        "locomotion",
        ("ctrl+d", "down", "ctrl+b", "right", "delete", "alt+z"),
    ),
    "leaving": Scene(
        "Leaving with edits that are not saved asks.",
        "locomotion",
        ("right", "delete", "ctrl+q"),
    ),
    "help": Scene(
        "Help: how cells are written, what the marks mean, and every key.",
        "locomotion",
        ("f1",),
    ),
    "palette": Scene(
        "The palette of commands.",
        "locomotion",
        ("ctrl+p", *typed("row")),
    ),
}
_IN_LIGHT = ("sheet", "cell-angle", "coverage")
_WITHOUT_COLOUR = ("sheet", "coverage")


def _all() -> Iterator[tuple[str, Scene]]:
    for name, scene in _SCENES.items():
        yield f"{name}.svg", scene
        yield f"{name}-large.svg", replace(scene, size=LARGE)
        if name in _IN_LIGHT:
            yield f"{name}-light.svg", replace(scene, theme=LIGHT)
        if name in _WITHOUT_COLOUR:
            yield f"{name}-without-colour.svg", replace(scene, has_colour=False)
    sheet = replace(_SCENES["sheet"], size=WIDE)
    yield from (("sheet-wide.svg", sheet), ("sheet-wide-light.svg", replace(sheet, theme=LIGHT)))


SCENES: Mapping[str, Scene] = dict(_all())
"""Every scene by the name of its picture."""

MOVES = "asset;gait;top speed\nstrafe_left;Walk;1,4\nstrafe_right;Walk;1,4\nsprint;Run;6,5\n"
"""A file of another program, to import."""


def draw_scene(scene: Scene, folder: Path) -> str:
    """The scene as SVG; tables/ stands in the folder."""
    (folder / "tables" / "moves.txt").write_text(MOVES, encoding="utf-8")
    for slip in scene.before:
        make(slip, folder)
    with contextlib.chdir(folder), _environment(scene.has_colour):
        app = EditorApp(Workspace(f"tables/{scene.table}.csv"), theme=scene.theme)
        lines = asyncio.run(_lines(app, scene, folder))
    ground, colour = PAPERS[scene.theme if scene.has_colour else ""]
    return svg(scene.title, lines, Sheet(scene.size[0], MARGIN_PX, ground, colour))


@contextlib.contextmanager
def _environment(has_colour: bool) -> Iterator[None]:
    """Variables of a terminal with colours, or without."""
    before = dict(os.environ)
    os.environ.pop("NO_COLOR", None)
    os.environ.update({} if has_colour else {"NO_COLOR": "1"})
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


async def _lines(app: EditorApp, scene: Scene, folder: Path) -> list[list[Run]]:
    """What stands on the screen after the keys."""
    app.animation_level = "none"
    async with app.run_test(size=scene.size) as pilot:
        await _settle(pilot)
        for key in scene.keys:
            if isinstance(key, Slip):
                make(key, folder)
                app.main.care.look()
                await _settle(pilot)
            else:
                await pilot.press(key)
            if key in WORKING:
                await _settle(pilot)
        for field in app.screen.query(Input):
            field.cursor_blink = False
        await _settle(pilot)
        return screen_lines(app)


def screen_lines(app: App[Any]) -> list[list[Run]]:
    """What stands on the screen now."""
    return [list(_runs(strip)) for strip in app.screen._compositor.render_strips()]


WAIT_S = 60.0
"""So long a coverage may be counted."""
WORKING = ("enter", "f9", "alt+4", "2")
"""Keys after which something may be worked out before the next one is pressed."""


async def _settle(pilot: Pilot[Any]) -> None:
    """Wait until nothing is being worked out."""
    await pilot.pause()
    await pilot.app.workers.wait_for_complete()
    if isinstance(pilot.app, EditorApp):
        pilot.app.main.coverage.join(WAIT_S)
    await pilot.pause()


def _runs(strip: Any) -> Iterator[Run]:
    segments: list[Segment] = list(strip)
    columns = accumulate((segment.cell_length for segment in segments), initial=0)
    for column, segment in zip(columns, segments, strict=False):
        yield Run(column, segment.text, _look(segment.style or Style()))


def _look(style: Style) -> Look:
    colour, ground = _hex(style.color), _hex(style.bgcolor)
    if style.reverse:
        colour, ground = ground, colour
    return Look(colour, ground, bool(style.bold), bool(style.underline))


def _hex(colour: Any) -> str:
    return "" if colour is None or colour.is_default else colour.get_truecolor().hex
