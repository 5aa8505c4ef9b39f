"""docs/pictures.py: the pictures show what the commands print now, and load nothing."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree as ET

import pytest

SCRIPT = Path(__file__).parent.parent / "docs" / "pictures.py"


def load(path: Path) -> ModuleType:
    """A script as a module; docs/ is no package."""
    spec = importlib.util.spec_from_file_location("docs_pictures", path)
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


pictures = load(SCRIPT)
NAMES = sorted(pictures.PICTURES)


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_shows_what_its_commands_print_now(name: str):
    drawn = pictures.draw(pictures.PICTURES[name])
    assert (pictures.FOLDER / name).read_text(encoding="utf-8") == drawn, "run: make docs"


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_is_sound_and_loads_nothing(name: str):
    text = (pictures.FOLDER / name).read_text(encoding="utf-8")
    ET.fromstring(text)
    assert re.findall(r"https?:[^\"']+", text) == ["http://www.w3.org/2000/svg"]
    assert not re.search(r"url\(|@import|<script|<image|href", text)


def test_no_picture_lies_about_that_nothing_draws():
    assert {path.name for path in pictures.FOLDER.iterdir()} == set(NAMES)


def test_every_word_stands_at_its_own_column_with_its_colour():
    first, second = pictures.texts("\x1b[31mtwo words\x1b[0m   <third>", 38)
    assert first == '<text x="24" y="38" fill="#f0938a">two words</text>'
    assert second == '<text x="124.8" y="38">&lt;third&gt;</text>'


def test_a_slip_that_is_not_there_is_an_error(tmp_path: Path):
    (tmp_path / "a.csv").write_text("x,x\n", encoding="utf-8")
    with pytest.raises(ValueError, match="stands 2 times"):
        pictures.make(pictures.Slip("a.csv", "x", "y"), tmp_path)


def test_a_picture_tells_those_who_cannot_see_it_what_it_shows():
    assert "<title>A &amp; B</title>" in pictures.draw(pictures.Picture("A & B", ()))
