"""The tree itself: what it ships, and that it runs on other machines than the one it was written on."""

import re
import tomllib
from collections import Counter
from pathlib import Path

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
    assert wheel["sources"]["tables"] == "contextdb/_tables"
    assert (ROOT / "tables" / "contextdb.toml").is_file()


def test_all_that_the_tests_read_travels_in_the_source_archive():
    packed = PYPROJECT["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]
    assert [pattern for pattern in packed if not list(ROOT.glob(pattern.removeprefix("/")))] == []
    assert {"/.ci", "/.github", "/.pre-commit-hooks.yaml", "/*.md", "/CITATION.cff", "/Makefile", "/tests", "/docs"} <= set(packed)


def test_make_help_lists_every_target_that_a_person_calls():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    phony = re.search(r"^\.PHONY: (.+)$", makefile, re.M)
    assert phony is not None
    listed = re.findall(r"\(info make (\w+)", makefile)
    assert sorted(listed) == sorted(set(phony[1].split()) - {"help"})


def test_every_module_says_what_it_is_for():
    assert [named(path) for path in SOURCES if not re.match(r'(#!.*\n)?(r?"""|\Z)', path.read_text(encoding="utf-8"))] == []


def test_no_file_names_a_folder_of_one_machine():
    assert [named(path) for path in TEXTS if SOMEBODYS_FOLDER.search(path.read_text(encoding="utf-8"))] == []


def test_no_two_modules_of_tests_have_one_name():
    names = Counter(path.name for path in SOURCES if path.is_relative_to(ROOT / "tests"))
    assert [name for name, count in names.items() if count > 1] == []


def test_a_wheel_has_the_editor_inside_the_package_and_takes_no_other_name():
    wheel = PYPROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    assert wheel["sources"]["tui"] == "contextdb/_tui"
    absolute = re.compile(r"^\s*(?:from|import) tui\b", re.M)
    assert [str(path) for path in sorted((ROOT / "tui").rglob("*.py")) if absolute.search(path.read_text(encoding="utf-8"))] == []
