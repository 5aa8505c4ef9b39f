"""What a DMN file says of the values of an input: its type, its item definition, and the values that either allows.

    boolean                            bool
    number, double, decimal            number; `[0..10]` or `>= 0` as its allowed values give its bounds
    integer, long                      int, the same
    string with allowed values         enum
    string where every test is one     text
    an item definition                 what it refers to, with its allowed values or its type constraint

Source: OMG, Decision Model and Notation 1.5, 7.3.2 (ItemDefinition) and 8.3.2 (input values).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from xml.etree import ElementTree

from contextdb.cells.domains import BOOL, INT, NUMBER, TEXT, Domain
from contextdb.cells.kinds import KINDS
from contextdb.errors import in_quotes
from contextdb.exchange.feel import STRINGS, number_in, strings_of
from contextdb.exchange.reading import Remark

MOST_LINKS = 20
"""How many item definitions may stand for one another, and how deep the parts of a structure are looked at."""

Element = ElementTree.Element
_NUMBER = r"(?:[+-]?(?:\d+(?:\.\d+)?|\.\d+)(?:[eE][+-]?\d+)?|\w+\(\s*\"[^\"]*\"\s*\)|@\"[^\"]*\")"
"""A number, or what FEEL writes as a function of a text."""
_BOUNDS = (
    re.compile(rf"\[\s*(?P<low>{_NUMBER})\s*\.\.\s*(?P<high>{_NUMBER})\s*\]"),
    re.compile(rf">=\s*(?P<low>{_NUMBER})"),
    re.compile(rf"<=\s*(?P<high>{_NUMBER})"),
)
_NUMBERS = {"number": NUMBER, "double": NUMBER, "decimal": NUMBER, "integer": INT, "long": INT} | {
    name: Domain(name) for name, kind in KINDS.items() if kind.is_spelt
}


@dataclass(frozen=True)
class InputType:
    """A type by its name, and the text of the unary tests that its values must pass, which may be empty."""

    kind: str = ""
    allowed: str = ""


def tag_of(element: Element) -> str:
    """An element's tag without its namespace."""
    return str(element.tag).rpartition("}")[2]


def children_of(element: Element, tag: str) -> list[Element]:
    """The elements of one tag that stand right in another."""
    return [child for child in element if tag_of(child) == tag]


def text_of(element: Element | None) -> str:
    """The text of the <text> in an element."""
    element_text = next(iter(children_of(element, "text")), None) if element is not None else None
    return (element_text.text or "").strip() if element_text is not None else ""


@dataclass(frozen=True)
class Types:
    """The types that a file defines, by name; those of the parts of a structure by their path: tApplicant.age."""

    items: dict[str, Element]
    facts: dict[str, str]
    """The type of each input datum and each decision's result, by its name."""

    @classmethod
    def of(cls, root: Element) -> Types:
        items = dict(_items(root))
        named = [one for tag in ("inputData", "decision") for one in children_of(root, tag)]
        variables = [(one, next(iter(children_of(one, "variable")), None)) for one in named]
        facts = {(one.get("name") or ""): variable.get("typeRef") or "" for one, variable in variables if variable is not None}
        return cls(items, facts)

    def of_input(self, expression: Element | None, text: str) -> InputType:
        """The type of an input, by its own reference or by that of the datum that it names."""
        own = expression.get("typeRef") if expression is not None else None
        return self.named(own or self._type_of_path(text))

    def paths(self) -> list[str]:
        """The names of all facts, and of the parts of those that are structures: Applicant.age."""
        paths = list(self.facts)
        for fact, kind in self.facts.items():
            start = f"{_plain(kind)}."
            paths += [f"{fact}.{name[len(start) :]}" for name in self.items if name.startswith(start)]
        return [name for name in paths if name]

    def _type_of_path(self, path: str) -> str:
        name, _, rest = path.partition(".")
        return f"{_plain(self.facts.get(name, ''))}.{rest}" if rest else self.facts.get(path, "")

    def named(self, name: str) -> InputType:
        """A type by its name, with the values that it allows."""
        allowed = ""
        for _ in range(MOST_LINKS):
            item = self.items.get(name, self.items.get(_plain(name)))
            if item is None:
                break
            constraints = [one for tag in ("typeConstraint", "allowedValues") for one in children_of(item, tag)]
            allowed = allowed or next(filter(None, map(text_of, constraints)), "")
            name = next((one.text or "" for one in children_of(item, "typeRef")), "").strip()
        return InputType(_plain(name).lower(), allowed)


def _items(root: Element) -> Iterator[tuple[str, Element]]:
    level = [(one.get("name") or "", one) for one in children_of(root, "itemDefinition")]
    for _ in range(MOST_LINKS):
        yield from level
        level = [(f"{name}.{part.get('name') or ''}", part) for name, one in level for part in children_of(one, "itemComponent")]


def _plain(name: str) -> str:
    """The name of a type without the prefix of its namespace: feel:string is string."""
    return name.rpartition(":")[2].strip()


def domain_of(kind: InputType, cells: list[str], place: str) -> tuple[Domain | None, list[Remark]]:
    """The domain that a type means, None where the cells must tell; and what of it could not be kept. `cells` are the unary tests
    of the column."""
    if kind.kind == "boolean":
        return BOOL, []
    if kind.kind in _NUMBERS:
        return _bounded(_NUMBERS[kind.kind], kind.allowed, place)
    if STRINGS.fullmatch(kind.allowed):
        return Domain("enum", tuple(dict.fromkeys(strings_of(kind.allowed)))), []
    remarks = [_unkept(kind.allowed, place)] if kind.allowed not in ("", "-") else []
    are_strings = kind.kind == "string" and any(map(strings_of, cells)) and all(map(_is_string_test, cells))
    return (TEXT if are_strings else None), remarks


def _is_string_test(test: str) -> bool:
    return test in ("", "-") or bool(re.fullmatch(r"not\s*\((.*)\)", test, re.DOTALL) or STRINGS.fullmatch(test))


def _bounded(domain: Domain, allowed: str, place: str) -> tuple[Domain, list[Remark]]:
    """A domain of numbers, with the bounds that allowed values give where they are closed."""
    ends = next((ends_match for pattern in _BOUNDS if (ends_match := pattern.fullmatch(allowed))), None)
    if ends is not None:
        low, high = (None if end is None else _read(end, domain) for end in map(ends.groupdict().get, ("low", "high")))
        is_fitting = not any(end is not None and (end != end or (domain.type.is_whole and end % 1)) for end in (low, high))
        is_sound = (low is None or high is None or low < high) and is_fitting
        if is_sound:
            return replace(domain, minimum=-math.inf if low is None else low, maximum=math.inf if high is None else high), []
    return domain, [_unkept(allowed, place)] if allowed not in ("", "-") else []


def _read(end: str, domain: Domain) -> float:
    """The number of a bound; NaN where it is none of the type."""
    text, spelling = number_in(end), domain.type.spelling
    try:
        return spelling.read(text) if re.fullmatch(spelling.number, text) else math.nan
    except ValueError:
        return math.nan


def _unkept(allowed: str, place: str) -> Remark:
    return Remark(f"the allowed values {in_quotes(allowed)} are not kept.", place, True)
