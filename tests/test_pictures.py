"""docs/pictures.py: the pictures show what the commands and the editor show now, and load nothing."""

import importlib
import re
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from quick_apps import quick
from strategies import IS_FULL, for_each, some

DOCS = Path(__file__).parent.parent / "docs"
sys.path.insert(0, str(DOCS))
drawing, pictures, screens, slips = (importlib.import_module(name) for name in ("drawing", "pictures", "screens", "slips"))
Look, Run, Sheet = drawing.Look, drawing.Run, drawing.Sheet
NAMES = sorted(pictures.PICTURES)
PAPER = Sheet(n_columns=10, margin_px=0, ground="#000000", colour="#ffffff")


def drawn(*lines: list[Run]) -> str:
    return drawing.svg("A title", lines, PAPER)


LOOKS = re.compile("-(large|light|without-colour).svg$")
"""One scene in another look: every day half of the scenes are drawn, each in one."""


@pytest.mark.parametrize("name", some([name for name in NAMES if IS_FULL or not LOOKS.search(name)], 4))
def test_a_picture_shows_what_is_shown_now(name: str):
    with quick(paints=True):
        now = pictures.draw(pictures.PICTURES[name])
    assert (pictures.FOLDER / name).read_text(encoding="utf-8") == now, "run: make docs"


@for_each(NAMES)
def test_a_picture_is_sound_and_loads_nothing(name: str):
    text = (pictures.FOLDER / name).read_text(encoding="utf-8")
    ET.fromstring(text)
    assert re.findall(r"https?:[^\"']+", text) == ["http://www.w3.org/2000/svg"]
    assert not re.search(r"url\(|@import|@font-face|<script|<image|href", text)


@for_each(NAMES)
def test_a_picture_holds_no_path_of_the_machine_it_was_drawn_on(name: str):
    text = (pictures.FOLDER / name).read_text(encoding="utf-8")
    assert not re.search(r"/(tmp|home|root|Users|var)\b|[A-Z]:\\", text)


def test_no_picture_lies_about_that_nothing_draws():
    assert {path.name for path in pictures.FOLDER.glob("*.svg")} == set(NAMES)


def test_every_screen_is_drawn_small_and_large():
    small = {name.removesuffix(".svg") for name, scene in screens.SCENES.items() if scene.size == screens.SMALL}
    large = {name.removesuffix("-large.svg") for name, scene in screens.SCENES.items() if scene.size == screens.LARGE}
    assert large < small
    assert all(re.sub("-(light|without-colour)$", "", name) in large for name in small)


def test_a_picture_without_colour_has_greys_only():
    for name in (n for n in NAMES if "without-colour" in n):
        text = (pictures.FOLDER / name).read_text(encoding="utf-8")
        shapes = text.partition("<path")[2] + "".join(re.findall(r"\.s\d+\{[^}]*\}", text))
        for red, green, blue in re.findall(r"#(..)(..)(..)\b", shapes):
            assert red == green == blue


def test_every_word_stands_at_its_own_column_with_its_look():
    text = drawn([Run(0, "two words", Look("#f0938a", is_bold=True)), Run(9, "   <third>")])
    assert ".s0{fill:#f0938a;font-weight:bold}" in text
    assert '<text y="14"><tspan x="0" class="s0">two words</tspan><tspan x="100.8">&lt;third&gt;</tspan></text>' in text


def test_a_ground_of_several_lines_is_one_shape():
    filled = Run(1, "ab", Look(ground="#112233"))
    assert '<path fill="#112233" d="M8.4 0h16.8v40h-16.8z"/>' in drawn([filled], [filled])


def test_frames_blocks_and_dots_are_shapes_and_no_text():
    text = drawn([Run(0, "╭──█░⣿")])
    assert "<text" not in text
    assert "h16.8" in text  # two lines side by side are one stroke
    assert text.count("h2.6v2.6") == 8  # the dots of a full braille character


def test_a_terminal_colour_becomes_a_look():
    first, second = pictures.runs("\x1b[31mred\x1b[0m plain")
    assert first == Run(0, "red", Look("#f0938a"))
    assert second == Run(3, " plain", Look())


def test_a_slip_that_is_not_there_is_an_error(tmp_path: Path):
    (tmp_path / "a.csv").write_text("x,x\n", encoding="utf-8")
    with pytest.raises(ValueError, match="stands 2 times"):
        slips.make(slips.Slip("a.csv", "x", "y"), tmp_path)


def test_a_picture_tells_those_who_cannot_see_it_what_it_shows():
    assert "<title>A &amp; B</title>" in drawing.svg("A & B", [], PAPER)
