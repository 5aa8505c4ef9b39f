"""docs/api.md is the interface: every name on it exists, every public name is on it, and its signatures are those of the code.

`python tests/test_api.py --update` writes the signatures of the code into the lists.
"""

import dataclasses
import inspect
import re
import sys
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import get_type_hints

import pytest
from strategies import for_each

import contextdb as cdb
from contextdb import motion, telemetry

DOCS = Path(__file__).parent.parent / "docs"
API = DOCS / "api.md"
MODULES: dict[str, ModuleType] = {"motion": motion, "telemetry": telemetry}
FORMS = (
    'project["jog"]',
    "len(table)",
    "Table[0]",
    "for row in table",
    "Matches[0]",
    "Matches[1:]",
    "a & b",
    "a | b",
    "a - b",
    "a ^ b",
    "many & other",
)
"""Names on the page that are uses of a class, not attributes."""
CODE = re.compile(r"`([^`]+)`")
FIRST_NAMES = re.compile(r"^- (`.*?): ", re.MULTILINE)
NAME = re.compile(r"(\.?[\w.]+)(\(.*\))?")


def names_in(text: str) -> Iterator[tuple[str, bool]]:
    """The names that the lines of the lists begin with, in full, and whether each is written as a call."""
    owner = ""
    for cell in FIRST_NAMES.findall(text):
        for written in CODE.findall(cell):
            if written not in FORMS:
                match = NAME.fullmatch(written)
                assert match, f"{written} is not a name"
                name = owner + match[1] if match[1].startswith(".") else match[1]
                owner = name.rpartition(".")[0]
                yield name, match[2] is not None


def value_of(name: str) -> object:
    """What a name of the page is; a field of a dataclass or an attribute that instances have gives None."""
    first, *rest = name.split(".")
    value: object = MODULES.get(first) or getattr(cdb, first)
    for part in rest:
        if isinstance(value, property):
            value = get_type_hints(value.fget)["return"]
        if isinstance(value, type) and not hasattr(value, part):
            is_field = dataclasses.is_dataclass(value) and part in {f.name for f in dataclasses.fields(value)}
            assert is_field or re.search(rf"\bself\.{part}\b", inspect.getsource(value)), f"there is no {name}"
            return None
        value = getattr(value, part)
    return value


def is_call(value: object) -> bool:
    return inspect.isfunction(value) or inspect.ismethod(value)


def signature_of(call: object) -> str:
    """Parameters and defaults as the page writes them: without types, "..." for a default that is no plain value."""
    parameters = list(inspect.signature(call).parameters.values())  # type: ignore[arg-type]
    parts, is_keyword = [], False
    for parameter in parameters:
        if parameter.name == "self" or parameter.annotation == "Never":  # what is there to be refused with what to write
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and not is_keyword:
            parts.append("*")
            is_keyword = True
        star = {parameter.VAR_POSITIONAL: "*", parameter.VAR_KEYWORD: "**"}.get(parameter.kind, "")
        parts.append(f"{star}{parameter.name}{_default(parameter.default)}")
    return f"({', '.join(parts)})"


def _default(value: object) -> str:
    if value is inspect.Parameter.empty:
        return ""
    if isinstance(value, str):
        return f'="{value}"'
    return f"={value!r}" if value is None or isinstance(value, (bool, int, float)) or value == () else "=..."


def with_signatures(text: str) -> str:
    """The page with the signatures of the code."""
    owner = ""

    def written(match: re.Match[str]) -> str:
        nonlocal owner
        found = NAME.fullmatch(match[1])
        if match[1] in FORMS or not found:
            return match[0]
        name = owner + found[1] if found[1].startswith(".") else found[1]
        owner = name.rpartition(".")[0]
        value = value_of(name)
        return f"`{found[1]}{signature_of(value)}`" if is_call(value) else match[0]

    return FIRST_NAMES.sub(lambda cell: CODE.sub(written, cell[0]), text)


PAGE = API.read_text(encoding="utf-8")
NAMES = dict(names_in(PAGE))
CALLS = [name for name in NAMES if is_call(value_of(name))]


def test_every_name_on_the_page_exists():
    assert len(NAMES) > 200
    for name in NAMES:
        value_of(name)  # fails, with the name, where there is none


def test_every_public_name_is_on_the_page():
    public = [*cdb.__all__, *(f"{where}.{name}" for where, module in MODULES.items() for name in module.__all__)]
    assert [name for name in public if name not in NAMES] == []


def test_the_signatures_on_the_page_are_those_of_the_code():
    assert with_signatures(PAGE) == PAGE, "run: python tests/test_api.py --update"


@for_each(NAMES)
def test_a_public_name_has_a_docstring_and_a_call_says_what_it_raises(name: str):
    value = value_of(name)
    if not (is_call(value) or isinstance(value, (type, property)) or hasattr(value, "func")):
        return  # a constant, a field or a type: said on the page
    said = inspect.getdoc(value) or ""
    assert said, f"{name} has no docstring"
    if name in CALLS and signature_of(value) != "()":
        assert re.search(r"\b[Rr]aise|Never fails", said), f"{name} does not say what it raises"


def names_said_of(name: str) -> set[str]:
    """The names that the page has of a class: those of its own lines, and those in what its line says."""
    said = {full.removeprefix(f"{name}.") for full in NAMES if full.startswith(f"{name}.")}
    for line in PAGE.splitlines():
        names, _, about = line.partition(": ")
        if name in CODE.findall(names):
            said |= {found[1] for code in CODE.findall(about) if (found := NAME.fullmatch(code))}
    return said


TYPES = [name for name in cdb.__all__ if isinstance(kind := getattr(cdb, name), type) and not issubclass(kind, Exception)]
OF_MOTION = [f"motion.{name}" for name in motion.__all__ if isinstance(kind := getattr(motion, name), type)]
PLAIN = (MutableMapping, Sequence, str, int, Exception)
"""Kinds whose own names are those of all of them."""


def unsaid_names(name: str) -> list[str]:
    """What an editor offers after the dot of a class and the page does not say; of motion's records docstrings say the fields."""
    kind = value_of(name)
    assert isinstance(kind, type)
    fields = {field.name for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else set()
    set_at_start = re.findall(r"^ +(self\.\w+.*?)(?::.*?)? = ", inspect.getsource(kind), re.MULTILINE)
    own = {*dir(kind), *fields, *re.findall(r"self\.(\w+)(?![\w.\[(])", " ".join(set_at_start))}
    inherited = {each for plain in PLAIN if issubclass(kind, Mapping if plain is MutableMapping else plain) for each in dir(plain)}
    members = {*kind.__members__} if issubclass(kind, Enum) else set()
    documented = {each for each in fields if name in OF_MOTION and re.search(rf"\b{each}\b", kind.__doc__ or "")}
    said = inherited | members | documented | names_said_of(name)
    return sorted(each for each in own - said if not each.startswith("_"))


@for_each(TYPES)
def test_a_class_shows_the_names_of_the_page_and_no_others(name: str):
    assert unsaid_names(name) == []


@for_each(OF_MOTION)
def test_what_else_a_class_of_motion_shows_has_a_docstring(name: str):
    for each in unsaid_names(name):
        value = value_of(f"{name}.{each}")
        is_field = value is None or inspect.ismemberdescriptor(value)
        assert is_field or inspect.getdoc(value), f"{name}.{each} has no docstring"


def test_motion_has_few_names_of_its_own():
    assert len(motion.__all__) <= 70


def test_a_compiled_table_holds_nothing_else_that_is_public_and_takes_nothing():
    compiled = cdb.Table.from_columns({"Asset": ["a"], "speed": ["1"]}, {"speed": {"type": "number"}}).compile()
    compiled.query({"speed": 1.0})
    assert {name for name in dir(compiled) if not name.startswith("_")} <= set(dir(cdb.CompiledTable))
    for name in ("name", "masks"):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(compiled, name, "another")


@for_each(sorted(DOCS.glob("*.md")))
def test_the_pages_use_public_names_alone(page: Path):
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"(?<![\w.])(?:cdb\.)?(motion\.|telemetry\.|cdb\.)([A-Za-z]\w*)\b", code_of(text))
    names = {f"{where.removeprefix('cdb.')}{name}" for where, name in found} - {"motion"}
    assert sorted(name for name in names if name not in NAMES) == []


def code_of(text: str) -> str:
    """The Python in the blocks of a page."""
    return "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))


if __name__ == "__main__" and "--update" in sys.argv:
    API.write_text(with_signatures(PAGE), encoding="utf-8")
