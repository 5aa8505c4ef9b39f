"""docs/messages.md: a section for each rule, examples that are true, and the words of the reports that carry their own help."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from strategies import for_each

from contextdb import report
from contextdb.checks.rules import RULES, TABLE_RULES
from contextdb.commands.check_command import check_path
from contextdb.findings import LEVELS

ROOT = Path(__file__).parent.parent.parent
PAGE = (ROOT / "docs" / "messages.md").read_text(encoding="utf-8")
SECTIONS = {
    part.partition("\n")[0].strip(): part for part in re.split(r"^### ", re.sub(r"^## .*", "", PAGE, flags=re.M), flags=re.M)[1:]
}
RULE_ARGUMENT = {"Finding": 0, "finding_at": 2, "Fault": 4, "_of_schema": 1}
"""Where calls that make a finding or a fault take the name of a rule."""
COMPANIONS = {"identical-rows": {"never-chosen"}, "equal-row": {"never-chosen"}}
"""Rules that an example of another cannot but break too: under the policy "first" the later of two equal rows never plays."""
METHODS = ("_at", "_whole")
"""Methods that make a finding, and take the rule before its level."""
SAID_BY = re.compile(rf"\b(rule|{'|'.join(RULE_ARGUMENT)})\b|[\"']({'|'.join(LEVELS)})[\"']")
"""A module without one of these words names no rule in any of the ways that `rules_in` looks for."""


def rules_in(tree: ast.AST, in_tuples: bool) -> Iterator[str]:
    """Every rule that a module names: as an argument, as a default, or before a level, in a tuple only where that is asked."""
    for node in ast.walk(tree):
        found: list[ast.expr | None] = []
        if isinstance(node, ast.keyword):
            found = [node.value] if node.arg == "rule" else []
        elif isinstance(node, ast.AnnAssign):
            found = [node.value] if isinstance(node.target, ast.Name) and node.target.id == "rule" else []
        elif isinstance(node, ast.Assign):
            found = [node.value for target in node.targets if isinstance(target, ast.Name) and target.id == "rule"]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id != "partial":
            at = RULE_ARGUMENT.get(node.func.id, len(node.args))
            found = [*node.args[at : at + 1]]
        elif isinstance(node, ast.Call) and (not isinstance(node.func, ast.Attribute) or node.func.attr in METHODS):
            found = [a for a, b in pairwise(node.args) if isinstance(b, ast.Constant) and b.value in LEVELS]
        elif in_tuples and isinstance(node, ast.Tuple):
            found = [a for a, b in pairwise(node.elts) if isinstance(b, ast.Constant) and b.value in LEVELS]
        yield from (f.value for f in found if isinstance(f, ast.Constant) and isinstance(f.value, str) and f.value not in LEVELS)


@cache
def rules_by_module(package: str) -> dict[Path, set[str]]:
    """The rules that each module of a package names."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted((ROOT / package).rglob("*.py"))}
    in_tuples = package == "contextdb"
    return {path: set(rules_in(ast.parse(text), in_tuples)) if SAID_BY.search(text) else set() for path, text in texts.items()}


def rules_of(*patterns: str, package: str = "contextdb") -> set[str]:
    """Every rule that the modules of a package name."""
    named = rules_by_module(package)
    return {rule for pattern in patterns for path in (ROOT / package).glob(pattern) for rule in named[path]}


def module_of(path: Path) -> str:
    """The name of a module below contextdb."""
    return ".".join(path.relative_to(ROOT / "contextdb").with_suffix("").parts).removesuffix(".__init__")


@cache
def modules() -> dict[str, set[str]]:
    """The rules that each module reports."""
    return {module_of(path): rules for path, rules in rules_by_module("contextdb").items()}


def fenced(section: str, language: str) -> str | None:
    """The block of a language in a section."""
    found = re.search(rf"^```{language}\n(.*?)^```$", section, re.M | re.S)
    return found and found[1]


EXAMPLES = [rule for rule, section in SECTIONS.items() if fenced(section, "csv")]


def printed(section: str, folder: Path) -> str:
    """What a check of a section's example prints."""
    (folder / "example.csv").write_text(fenced(section, "csv") or "", encoding="utf-8")
    (folder / "contextdb.toml").write_text(fenced(section, "toml") or "", encoding="utf-8")
    return report.render("text", check_path("example.csv"))


def test_every_rule_that_the_code_names_has_its_section_and_the_other_way_round():
    assert rules_of("**/*.py") | rules_of("**/*.py", package="tui") == set(SECTIONS)


def test_every_rule_of_a_check_carries_its_own_help():
    assert rules_of("checks/run.py", "cells/grammar.py", "tables/alike.py", "errors.py") <= set(RULES) <= rules_of("**/*.py")
    assert set(TABLE_RULES) < set(RULES)


@for_each(RULES)
def test_a_rule_is_reported_by_the_modules_that_the_catalogue_names_and_by_no_other(rule: str):
    assert RULES[rule].modules == tuple(module for module, rules in modules().items() if rule in rules)


def test_no_rule_has_two_sections():
    assert len(re.findall(r"^### ", PAGE, re.M)) == len(SECTIONS)


@for_each(RULES)
def test_a_section_and_the_help_of_a_report_agree(rule: str):
    words = " ".join(SECTIONS[rule].replace("`", "").split())
    assert RULES[rule].summary.rstrip(".").replace("`", "") in words
    assert "Fix: " in words
    if rule != "more":
        assert f"*{RULES[rule].level}*" in words


@for_each(SECTIONS)
def test_every_section_tells_the_fix(rule: str):
    assert re.search(r"^Fix: ", SECTIONS[rule], re.M)


@pytest.mark.parametrize("rule", EXAMPLES)
def test_an_example_is_found_as_the_page_says(rule: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    section = SECTIONS[rule]
    assert printed(section, tmp_path) == fenced(section, "text")
    assert {f.rule for f in check_path("example.csv").findings} == {rule} | COMPANIONS.get(rule, set())
