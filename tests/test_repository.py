"""The tree itself: what it ships, and that it runs on other machines than the one it was written on."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import contextdb

ROOT = Path(__file__).parent.parent
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SOURCES = sorted(p for folder in ("contextdb", "tui", "tests", "benchmarks", "examples") for p in (ROOT / folder).rglob("*.py"))
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("tables/**/*.toml"), *ROOT.glob("examples/**/*.toml")]
TEXTS = [*SOURCES, *PAGES, ROOT / "Makefile", ROOT / "pyproject.toml"]
SOMEBODYS_FOLDER = re.compile(r"(?<![\w.])/(home|root|Users|tmp|work)/")


def named(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def test_the_package_names_its_own_version():
    assert contextdb.__version__ == PYPROJECT["project"]["version"]


def test_what_contributing_names_is_there():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found = re.findall(r"`((?:contextdb|tui|tests|docs)/[\w./]+)`(?:: ((?:`\w+`(?:, )?)+))?", text)
    assert len(found) >= 8
    for path, names in found:
        place = ROOT / path.replace("render_NAME", "render_json")
        assert place.exists(), path
        for name in re.findall(r"`(\w+)`", names):
            assert re.search(rf"^(?:def |class )?{name}\b", place.read_text(encoding="utf-8"), re.M), f"{path}: {name}"


def test_the_changelog_has_an_unreleased_section_or_the_version():
    headings = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
    assert {"Unreleased", contextdb.__version__} & set(headings)


def test_the_package_says_that_it_is_typed():
    assert (ROOT / "contextdb" / "py.typed").is_file()


def test_the_sample_tables_travel_in_the_wheel():
    wheel = PYPROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert "/tables" in wheel["include"]
    assert wheel["sources"] == {"tables": "contextdb/_tables"}
    assert (ROOT / "tables" / "contextdb.toml").is_file()


def test_make_help_lists_every_target_that_a_person_calls():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    phony = re.search(r"^\.PHONY: (.+)$", makefile, re.M)
    assert phony is not None
    listed = re.findall(r"\(info make (\w+)", makefile)
    assert sorted(listed) == sorted(set(phony[1].split()) - {"help"})


@pytest.mark.parametrize("path", SOURCES, ids=named)
def test_every_module_says_what_it_is_for(path: Path):
    assert re.match(r'(#!.*\n)?(r?"""|\Z)', path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", TEXTS, ids=named)
def test_no_file_names_a_folder_of_one_machine(path: Path):
    assert not SOMEBODYS_FOLDER.search(path.read_text(encoding="utf-8"))
