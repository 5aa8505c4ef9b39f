"""What the keys of contextdb.toml accept: in words, as a check, and what a wrong value was likely meant to be.

`SECTIONS` describes the file. How the keys of a section go together is for `contextdb.schema.settings` to check.
"""

from __future__ import annotations

import datetime
import math
import numbers
import re
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath, PureWindowsPath
from typing import Literal, get_args

from contextdb.cells.kinds import KINDS
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import in_quotes, nearest
from contextdb.files.toml_shapes import Shape, meant_number, one_of, wrong_text
from contextdb.files.toml_text import as_toml, what

Policy = Literal["collect", "first", "unique", "priority", "specific", "cheapest"]
POLICIES: tuple[Policy, ...] = get_args(Policy)

KIND_SYNONYMS = {synonym: name for name, kind in KINDS.items() for synonym in kind.synonyms}
POLICY_SYNONYMS = {
    **{"all": "collect", "any": "collect", "single": "unique", "highest": "priority"},
    **dict.fromkeys(("most specific", "specificity", "score", "best"), "specific"),
    **dict.fromkeys(("cost", "least cost", "least penalty", "lowest"), "cheapest"),
}
RANKED: tuple[Policy, ...] = ("priority", "specific", "cheapest")
"""The policies that are there to prefer some rows; a row that they never choose is worth a warning."""
CHANCE: tuple[Policy, ...] = ("collect", "priority", "specific", "cheapest")
"""The policies under which chance decides, by weight, between the rows that are left, so that one of weight 0 is never picked."""
MIRRORS = ("negate", "none")
MIRROR_SYNONYMS = {
    **dict.fromkeys(("negative", "sign", "flip", "invert", "minus", "true"), "negate"),
    **dict.fromkeys(("no", "off", "keep", "same", "false", "any", "-", ""), "none"),
}
KEY_SYNONYMS = {
    **{"kind": "type", "minimum": "min", "lower": "min", "maximum": "max", "upper": "max", "formula": "expr", "expression": "expr"},
    **dict.fromkeys(("options", "choices", "enum", "tags", "set"), "values"),
    **{"desc": "description", "help": "description", "comment": "description", "path": "file", "columns": "conditions"},
    **dict.fromkeys(("mirrored", "swap", "mirroring"), "mirror"),
    **{"default": "fallback", "assumptions": "assume", "hit_policy": "policy"},
    **{"say_once": "once", "matchonce": "once", "cooldown": "cooldown_s", "norepeat": "cooldown_turns"},
}


def wrong_name(value: object) -> str | None:
    """What is wrong with a name: of a condition, a table, a column, a value."""
    if not isinstance(value, str) or not value.strip():
        return wrong_text(value) or "this is empty"
    return None if value == value.strip() else "a space is before or after it"


def _wrong_number(value: object) -> str | None:
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        return f"this is {what(value)}, not a number"
    try:
        number = float(value)
    except OverflowError:
        return "this is too large for a number"
    if math.isnan(number):
        return "nothing is above or below it"
    return None if number == value else f"no double is equal to it; the nearest is {number!r}"


def _wrong_weight(value: object) -> str | None:
    return _wrong_number(value) or (None if 0.0 <= value < math.inf else "this is below 0 or infinite")  # type: ignore[operator]


def _wrong_bound(value: object) -> str | None:
    return None if isinstance(value, (str, datetime.date)) else _wrong_number(value)


def _wrong_list(value: object) -> str | None:
    if not isinstance(value, (list, tuple)):
        return f"this is {what(value)}, not a list"
    seen: set[str] = set()
    for i, name in enumerate(value):
        if wrong := wrong_name(name):
            return f"entry {i + 1} cannot be used: {wrong}"
        if name in seen:
            return f"{in_quotes(name)} appears twice"
        seen.add(name)
    return None


def _wrong_values(value: object) -> str | None:
    return _wrong_list(value) or (None if value else "the list is empty")


def _wrong_outputs(value: object) -> str | None:
    """What is wrong with the names of outputs; what is said of each is for `contextdb.schema.outputs` to check."""
    if not isinstance(value, Mapping):
        return _wrong_list(value)
    return next((f"the name {as_toml(name)} cannot be used: {wrong}" for name in value if (wrong := wrong_name(name))), None)


def _wrong_fallback(value: object) -> str | None:
    return None if isinstance(value, Mapping) else wrong_name(value)


def _wrong_file(value: object) -> str | None:
    if not isinstance(value, str) or wrong_name(value):
        return wrong_name(value)
    path = PureWindowsPath(value)
    if path.drive or path.root:
        return "it names a place on one machine"
    if ".." in path.parts:
        return "it leaves the folder of contextdb.toml"
    if "\\" in value:
        return 'folders are separated by "/" on every system'
    return None if path.suffix.casefold() in TABLE_SUFFIXES else "its ending is that of no table file"


def _meant_file(value: object) -> object:
    if not isinstance(value, str):
        return None
    path = PureWindowsPath(value.strip())
    if path.drive or path.root:
        return path.name
    inside = PurePosixPath(*(part for part in path.parts if part != ".."))
    return str(inside) if inside.suffix else f"{inside}.csv" if inside.name else None


def _meant_text(value: object) -> object:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        return None
    return str(value).strip()


def _meant_names(separators: str) -> Callable[[object], object]:
    """What a list of names was meant to be; text is taken apart at `separators`, a pattern."""

    def meant(value: object) -> object:
        parts = re.split(separators, value) if isinstance(value, str) else value
        if not isinstance(parts, (list, tuple)):
            return None
        names = [_meant_text(part) for part in parts]
        return list(dict.fromkeys(name for name in names if name)) if None not in names else None

    return meant


def _wrong_mirror(value: object) -> str | None:
    if isinstance(value, str):
        return None if value in MIRRORS else "there is no such way to mirror"
    if not isinstance(value, Mapping):
        return f"this is {what(value)}, neither a word nor names that change places"
    for left, right in value.items():
        for name in (left, right):
            if wrong := wrong_name(name):
                return f"the name {as_toml(name)} cannot be used: {wrong}"
    return None if value else "no names change places"


def _meant_mirror(value: object) -> object:
    """What was likely meant: pairs may have been written as a list, or as "Left = Right"."""
    if isinstance(value, str):
        sides = [side.strip(" \"'") for side in re.split(r"[=:,/]|<->|->", value)]
        if len(sides) == 2 and all(sides):
            return {sides[0]: sides[1]}
        return MIRROR_SYNONYMS.get(value.strip().casefold()) or nearest(value, MIRRORS)
    if isinstance(value, bool):
        return "negate" if value else "none"
    pairs = [value] if isinstance(value, (list, tuple)) and all(isinstance(side, str) for side in value) else value
    if isinstance(pairs, (list, tuple)) and all(isinstance(pair, (list, tuple)) and len(pair) == 2 for pair in pairs):
        return dict(map(tuple, pairs)) if all(isinstance(side, str) for pair in pairs for side in pair) else None
    return None


def _wrong_transitions(value: object) -> str | None:
    if wrong := wrong_text(value):
        return wrong
    is_pattern = re.fullmatch(r"[^{}]*\{from\}[^{}]+\{to\}[^{}]*", str(value))
    return None if is_pattern else "this is not a pattern for names of transitions"


TEXT = Shape('text, such as "m/s"', wrong_text, _meant_text)
NAME = Shape('a name, such as "Asset Name"', wrong_name, _meant_text)
EXPRESSION = Shape('an expression as text, such as "speed - target_speed"', wrong_name, _meant_text)
EXPRESSIONS = Shape('a list of expressions, such as ["not (IsRunning and IsIdle)"]', _wrong_list, _meant_names(r"\A|\Z"))
NUMBER = Shape("a number, such as -1.5", _wrong_number, meant_number)
WEIGHT = Shape("a number from 0 up, such as 2.0", _wrong_weight, meant_number)
HYSTERESIS = Shape("a number from 0 up, such as 0.2", _wrong_weight, meant_number)
BOUND = Shape("a number, such as -1.5", _wrong_bound, meant_number)
"""A number as its type writes it; whether that fits is for the type to say."""
NAMES = Shape('a list of different names, such as ["A", "B"]', _wrong_list, _meant_names(","))
OUTPUTS = Shape(
    'a list of different names, such as ["A", "B"], or typed outputs, such as { damage = { type = "number" } }',
    _wrong_outputs,
    _meant_names(","),
)
FALLBACK = Shape('a name, such as "idle", or { asset = "idle", outputs = { damage = 3 } }', _wrong_fallback, _meant_text)
VALUES = Shape('a list of different names, such as ["A", "B"]', _wrong_values, _meant_names(r"[,;|\s]+"))
FILE = Shape("a .csv or .parquet file in the folder of contextdb.toml or below it", _wrong_file, _meant_file)

MIRROR = Shape(
    '"negate" (the other sign), "none", or names that change places, such as { Left = "Right" }', _wrong_mirror, _meant_mirror
)

TRANSITIONS = Shape(
    '{from} and {to}, each once, with text between them, such as "{from}_to_{to}"',
    _wrong_transitions,
    lambda value: "{from}_to_{to}",
)

SECTIONS: dict[str, Mapping[str, Shape] | None] = {
    "project": {"name": TEXT, "transitions": TRANSITIONS},
    "conditions": {
        "type": one_of(tuple(KINDS), "type", KIND_SYNONYMS),
        "min": BOUND,
        "max": BOUND,
        "values": VALUES,
        "unit": TEXT,
        "description": TEXT,
        "expr": EXPRESSION,
        "mirror": MIRROR,
        "weight": WEIGHT,
        "hysteresis": HYSTERESIS,
    },
    "tables": {
        "file": FILE,
        "asset": NAME,
        "outputs": OUTPUTS,
        "enabled": NAME,
        "priority": NAME,
        "weight": NAME,
        "once": NAME,
        "cooldown_s": NAME,
        "cooldown_turns": NAME,
        "fallback": FALLBACK,
        "policy": one_of(POLICIES, "policy", POLICY_SYNONYMS),
        "assume": EXPRESSIONS,
        "when": NAME,
    },
    "blueprints": {"conditions": NAMES},
    "features": None,
    "databases": None,
    "selectors": None,
    "controllers": None,
    "output": None,
}
"""The sections and their keys; None: kept as they are. All but `project` hold named tables."""
