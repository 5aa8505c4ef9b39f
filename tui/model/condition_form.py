"""A condition as a form of texts: what a person typed, what it declares, and what is wrong with which field."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from contextdb.cells.conditions import Condition, Mirror
from contextdb.cells.kinds import KINDS
from contextdb.cells.words import quoted
from contextdb.errors import Fault, SchemaError
from contextdb.schema.sections import has_place
from contextdb.schema.settings import conditions_from_dict

from .options import CONDITION_OPTIONS

TYPED = tuple(key for key in CONDITION_OPTIONS if key != "type")
"""The keys of a condition that are typed; the type is picked."""
_NAME = re.compile(r'"((?:[^"]|"")*)"|([^\s,;"]+)')


@dataclass(frozen=True)
class ConditionForm:
    """The fields of a condition, as texts; an empty one says nothing."""

    kind: str = next(iter(KINDS))
    min: str = ""
    max: str = ""
    unit: str = ""
    values: str = ""
    """Names, with spaces or commas between them; one with a space in it is in quotes."""
    description: str = ""
    mirror: str = ""
    """"negate", "none", or names that change places: Left = Right, Up = Down."""
    weight: str = ""
    """What a cell counts under the policy "specific"; empty: 1."""
    owner: str = ""

    @classmethod
    def of(cls, condition: Condition) -> ConditionForm:
        """The form that says what a condition is."""
        domain = condition.domain
        low, high = (domain.type.spelling.write(x) if math.isfinite(x) else "" for x in (domain.minimum, domain.maximum))
        values = " ".join(quoted(value) for value in domain.values or ())
        weight = "" if condition.weight == 1.0 else repr(condition.weight).removesuffix(".0")
        mirror = _mirror_text(condition.mirror)
        return cls(domain.kind, low, high, condition.unit, values, condition.description, mirror, weight, condition.owner)

    def of_kind(self, kind: str) -> ConditionForm:
        """The same for another type, without a mirror that has no place there."""
        has_names = isinstance(_mirror(self.mirror), dict)
        fits = self.mirror.strip() in ("", "none") or has_names is KINDS[kind].is_swapped
        return replace(self, kind=kind, mirror=self.mirror if fits else "")

    def declared(self) -> tuple[dict[str, object], dict[str, str]]:
        """What `[conditions.NAME]` would say, and for each field that cannot be read why; fields without a place are left out."""
        texts = {"unit": self.unit, "description": self.description, "owner": self.owner}
        keys: dict[str, object] = {"type": self.kind, **{key: text.strip() for key, text in texts.items()}}
        wrong: dict[str, str] = {}
        for key, text in (("min", self.min), ("max", self.max)):
            if has_place(key, self.kind) and text.strip():
                number = text.strip() if KINDS[self.kind].is_spelt else _number(text)
                keys[key] = number
                if number is None:
                    wrong[key] = f'"{text.strip()}" is not a number.'
        if has_place("values", self.kind) and self.values.strip():
            keys["values"] = list(dict.fromkeys(names_in(self.values)))
        keys["mirror"] = _mirror(self.mirror)
        if self.weight.strip():
            keys["weight"] = _number(self.weight)
            if keys["weight"] is None:
                wrong["weight"] = f'"{self.weight.strip()}" is not a number.'
        keys = {key: value for key, value in keys.items() if value not in ("", None)}
        return keys, wrong or _faults(keys)


def names_in(text: str) -> Iterable[str]:
    """The names that a person typed: with spaces, commas or semicolons between them, those in quotes as they are."""
    return (match[1].replace('""', '"') if match[1] is not None else match[2] for match in _NAME.finditer(text))


def undeclared(text: str, values: Sequence[str]) -> list[str]:
    """The names in a cell that are no declared values: without signs, a penalty, and the words of the grammar."""
    names, known = (name.lstrip("+-") for name in names_in(text.partition("~")[0])), frozenset(values)
    return [name for name in dict.fromkeys(names) if name and name not in known and name.casefold() not in ("not", "any")]


def _mirror_text(mirror: Mirror | None) -> str:
    if isinstance(mirror, tuple):
        return ", ".join(f"{quoted(left)} = {quoted(right)}" for left, right in mirror)
    return mirror or ""


def _mirror(text: str) -> str | dict[str, str]:
    """What a person typed: pairs of names with "=" between them, or a word, as it is."""
    parts = [re.split(r"\s*=\s*", part.strip()) for part in text.split(",")]
    names = [[name for side in part for name in names_in(side)] for part in parts]
    is_pairs = all(len(part) == len(names_in_part) == 2 for part, names_in_part in zip(parts, names, strict=True))
    pairs = {pair[0]: pair[1] for pair in names} if is_pairs else {}
    return pairs if pairs and len(pairs) == len(names) else text.strip()


def _number(text: str) -> float | int | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return int(value) if value.is_integer() and abs(value) < 2.0**53 else value


def _faults(keys: dict[str, object]) -> dict[str, str]:
    """What is wrong with each field of what is declared."""
    try:
        conditions_from_dict({"x": keys})
    except SchemaError as error:
        return {_field_of(fault): plain(fault) for fault in reversed(error.faults)}
    return {}


def _field_of(fault: Fault) -> str:
    key = re.match(rf"\[conditions\.x\] ({'|'.join(TYPED)})\b", fault.found)
    return key[1] if key else "values" if "values" in fault.found + fault.accepted else "type"


def plain(fault: Fault) -> str:
    """A fault as a form shows it, without the section in which contextdb.toml would have it."""
    text = re.sub(r"^\[conditions\.[^\]]*\] ", "", fault.message)
    return text[:1].upper() + text[1:]
