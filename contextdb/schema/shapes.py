"""What the keys of contextdb.toml accept, and the settings of `[project]`, `[conditions.NAME]` and `[blueprints.NAME]`.

How the keys of a section go together is for `contextdb.schema.faults` to check.
"""

from __future__ import annotations

import datetime
import math
import numbers
import re
from collections.abc import Callable, Mapping
from pathlib import PureWindowsPath

from contextdb.cells.kinds import KINDS, names_where
from contextdb.disk import TABLE_SUFFIXES
from contextdb.errors import in_quotes, nearest
from contextdb.files.settings import Setting, Settings
from contextdb.files.toml_shapes import Shape, as_toml, file_below, meant_number, meant_text, one_of, what, wrong_name, wrong_text

KIND_SYNONYMS = {synonym: name for name, kind in KINDS.items() for synonym in kind.synonyms}
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
    **{"premise": "when", "if": "when", "any": "some", "all": "every", "forbid": "none", "because": "why"},
    **{"say_once": "once", "matchonce": "once", "cooldown": "cooldown_s", "norepeat": "cooldown_turns"},
}


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
    """What is wrong with the names of outputs; the settings of each are for `contextdb.schema.outputs` to check."""
    if not isinstance(value, Mapping):
        return _wrong_list(value)
    return next((f"the name {as_toml(name)} cannot be used: {wrong}" for name in value if (wrong := wrong_name(name))), None)


def _wrong_fallback(value: object) -> str | None:
    return None if isinstance(value, Mapping) else wrong_name(value)


def _meant_names(separators: str) -> Callable[[object], object]:
    """What a list of names was meant to be; text is taken apart at `separators`, a pattern."""

    def meant(value: object) -> object:
        parts = re.split(separators, value) if isinstance(value, str) else value
        if not isinstance(parts, (list, tuple)):
            return None
        names = [meant_text(part) for part in parts]
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


def _wrong_extends(value: object) -> str | None:
    if not isinstance(value, str) or wrong_name(value):
        return wrong_name(value)
    path = PureWindowsPath(value)
    if path.drive or path.root:
        return "it names a place on one machine"
    if "\\" in value:
        return 'folders are separated by "/" on every system'
    return None if path.suffix == ".toml" else "its ending is not .toml"


def _meant_extends(value: object) -> object:
    if not isinstance(value, str) or PureWindowsPath(value).drive or PureWindowsPath(value).root:
        return None
    path = value.strip().replace("\\", "/").rstrip("/")
    return path if path.endswith(".toml") else f"{path}/contextdb.toml"


TEXT = Shape('text, such as "m/s"', wrong_text, meant_text)
COLUMN = Shape('a name, such as "Asset Name"', wrong_name, meant_text)
EXTENDS = Shape('the path of a contextdb.toml, such as "../studio/contextdb.toml"', _wrong_extends, _meant_extends)
BASE = Shape('the name of a table, such as "hit_human"', wrong_name, meant_text)
EXPRESSION = Shape('an expression as text, such as "speed - target_speed"', wrong_name, meant_text)
EXPRESSIONS = Shape('a list of expressions, such as ["not (IsRunning and IsIdle)"]', _wrong_list, _meant_names(r"\A|\Z"))
NUMBER = Shape("a number, such as -1.5", _wrong_number, meant_number)
WEIGHT = Shape("a number from 0 up, such as 2.0", _wrong_weight, meant_number, float)
HYSTERESIS = Shape("a number from 0 up, such as 0.2", _wrong_weight, meant_number, float)
BOUND = Shape("a number, such as -1.5", _wrong_bound, meant_number)
"""A number as its type writes it; whether that fits is for the type to say."""
NAMES = Shape('a list of different names, such as ["A", "B"]', _wrong_list, _meant_names(","))
OUTPUTS = Shape(
    'a list of different names, such as ["A", "B"], or typed outputs, such as { damage = { type = "number" } }',
    _wrong_outputs,
    _meant_names(","),
)
FALLBACK = Shape('a name, such as "idle", or { asset = "idle", outputs = { damage = 3 } }', _wrong_fallback, meant_text)
VALUES = Shape('a list of different names, such as ["A", "B"]', _wrong_values, _meant_names(r"[,;|\s]+"))
FILE = file_below("a .csv or .parquet file", "table file", TABLE_SUFFIXES)

MIRROR = Shape(
    '"negate" (the other sign), "none", or names that change places, such as { Left = "Right" }', _wrong_mirror, _meant_mirror
)

TRANSITIONS = Shape(
    '{from} and {to}, each once, with text between them, such as "{from}_to_{to}"',
    _wrong_transitions,
    lambda value: "{from}_to_{to}",
)

PROJECT: Settings = {
    "name": Setting(TEXT, "The name of the project.", "", without="none"),
    "extends": Setting(
        EXTENDS, "A contextdb.toml whose conditions and blueprints this project has, too.", None,
        "From the folder of this one. See [shared conditions](#shared-conditions).", "none",
    ),
    "transitions": Setting(TRANSITIONS, "How clips that lead from one state to another are named.", None, without="not declared"),
}  # fmt: skip
_BOUNDED = names_where(lambda kind: kind.is_bounded)
_BEYOND = 'A date is written `"2026-01-01"`. Facts beyond are still compared; `check` reports cells beyond.'
CONDITION: Settings = {
    "type": Setting(one_of(tuple(KINDS), "type", KIND_SYNONYMS), "What a fact of it is.", label="Type"),
    "min": Setting(BOUND, "The least number. Empty: no bound.", None, _BEYOND, "no bound", "Least", types=_BOUNDED),
    "max": Setting(BOUND, "The greatest number. Empty: no bound.", None, _BEYOND, "no bound", "Most", types=_BOUNDED),
    "values": Setting(
        VALUES, "The possible names, in the order in which they are shown.", None, "Required for `enum`.", "none", "Values",
        "The names there are, with spaces between them; one with a space in it in quotes.",
        types=names_where(lambda kind: kind.has_values),
    ),
    "unit": Setting(TEXT, "Such as m/s: shown in the header.", "", without="none", label="Unit"),
    "description": Setting(TEXT, "One sentence for whoever fills cells.", "", without="none", label="Description"),
    "expr": Setting(
        EXPRESSION, "An [expression](#expressions) over other conditions.", None,
        "The fact is *derived*: every query computes it, and you never supply it.", "the fact is given",
    ),
    "mirror": Setting(
        MIRROR, "For clips played mirrored: negate, none, or names that change places, such as Left = Right.", None,
        'See [facts in a mirror](choosing.md#facts-in-a-mirror). Without it only angles are negated.', "none", "Mirror",
    ),
    "weight": Setting(
        WEIGHT, 'What a cell counts where the policy is "specific": 2 as much as two other cells, 0 nothing.', 1.0,
        without="1", label="Weight",
    ),
    "hysteresis": Setting(
        HYSTERESIS, "How far beyond the edges of its cells a row stays valid while its animation plays, in its unit.", 0.0,
        types=names_where(lambda kind: kind.is_decimal),
    ),
    "owner": Setting(TEXT, "Who answers for the condition, such as a team.", "", without="nobody is named", label="Owner"),
}  # fmt: skip
BLUEPRINT: Settings = {
    "conditions": Setting(
        NAMES, "Declared conditions that tables share.", (), more="The editor inserts those that a table lacks.", without="none"
    )
}
