"""The table of condition types: that code asks it, and that every type has an entry in every table about types."""

import ast
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.facts import read_fact_text
from contextdb.cells.grammar import parse_cell
from contextdb.cells.kinds import KINDS, Kind
from contextdb.cells.sets import SET_OF

ROOT = Path(__file__).parent.parent
ALL = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)

OTHER_WORDS = {
    "contextdb/compiled/artefact.py": "sorts of masks",
    "contextdb/expressions/check.py": "what functions give",
    "contextdb/expressions/parse.py": "tokens",
    "contextdb/files/parquet.py": "sorts of files",
    "contextdb/commands/__init__.py": "formats of reports",
    "contextdb/commands/ci_command.py": "formats of reports",
    "contextdb/commands/coverage_command.py": "formats of reports",
    "contextdb/commands/motion_check_command.py": "formats of reports",
    "contextdb/commands/motion_coverage_command.py": "formats of reports",
    "contextdb/edits/renaming_values.py": "tokens",
    "tui/widgets/grid_paint.py": "looks of cells",
}
"""Modules that compare with words that are names of types too, and what the words mean there."""


@ALL
def test_a_type_is_pickled_by_name_and_comes_back_as_itself(kind: Kind):
    assert pickle.loads(pickle.dumps(kind)) is kind


@ALL
def test_a_type_is_known_by_one_name_and_no_synonym_means_two(kind: Kind):
    assert KINDS[kind.name] is kind
    assert not set(kind.synonyms) & set(KINDS)
    assert not any(set(kind.synonyms) & set(other.synonyms) for other in KINDS.values() if other is not kind)


@ALL
def test_what_messages_call_accepted_can_be_read(kind: Kind):
    domain = Domain(kind.name, ("CB", "InAir", "Stunned") if kind.has_values else None)
    quoted = kind.cells.split('"')[1::2]
    assert quoted
    for text in quoted:
        cell = parse_cell(text, domain)
        assert cell.is_any or isinstance(cell.accepts, SET_OF[kind.family])


@ALL
def test_a_missing_fact_of_any_type_is_an_empty_text(kind: Kind):
    assert read_fact_text("", Condition("x", Domain(kind.name))) is None


def test_code_asks_a_type_for_a_property_and_compares_no_names():
    found = {path for path, tree in _modules() for _ in _compared(tree)}
    assert found == set(OTHER_WORDS)


def test_no_table_by_the_names_of_types_stands_outside_the_table_of_types():
    for path, tree in _modules():
        for node in ast.walk(tree):
            keys = {k.value for k in node.keys if isinstance(k, ast.Constant)} if isinstance(node, ast.Dict) else set()
            assert len(keys & KINDS.keys()) < 3, f"{path}:{node.lineno}"  # type: ignore[attr-defined]


def _modules() -> Iterator[tuple[str, ast.AST]]:
    """The modules that hold the name of a type as a text of its own."""
    named = re.compile(f"[\"']({'|'.join(KINDS)})[\"']")
    for package in ("contextdb", "tui"):
        for path in sorted((ROOT / package).rglob("*.py")):
            source = path.read_text(encoding="utf-8")
            if named.search(source):
                yield path.relative_to(ROOT).as_posix(), ast.parse(source)


def _compared(tree: ast.AST) -> Iterator[ast.AST]:
    """The names of types, alone or in a list, that something is compared with."""
    for node in ast.walk(tree):
        sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
        sides += [node.value] if isinstance(node, ast.MatchValue) else []
        for side in sides:
            parts = side.elts if isinstance(side, (ast.Tuple, ast.Set, ast.List)) else [side]
            yield from (part for part in parts if isinstance(part, ast.Constant) and part.value in tuple(KINDS))
