"""The lines that a running game publishes, one JSON document each: docs/live.md tells the format, `FORMAT` is its number.

A fact is a JSON value: true or false, a number, a text; tags are a list of texts, a missing fact is null. What JSON has no word for
is a dict: `{"number": "inf"}`, and `{"cell": "0..5"}` for a set of values, written as a cell.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from contextdb.cells.conditions import Condition
from contextdb.cells.facts import FactSet, read_fact
from contextdb.cells.grammar import format_cell
from contextdb.cells.sets import Cell
from contextdb.cells.words import format_number, quoted
from contextdb.errors import ContextError

FORMAT = 1
"""Raised when a reader of the old format would read the new one wrongly. More keys, and more kinds of lines, are no new format."""

HEADER, TABLES, ASK, PICK, DECISION, LOST, END = "header", "tables", "ask", "pick", "decision", "lost", "end"
DATABASES, BONES, POSE = "databases", "bones", "pose"
"""What a line is: the value of its key "line"."""

MOST_BYTES = 1 << 20
"""A longer line is not one of a game."""
MOST_DEPTH = 32
"""Lists and objects in each other."""
MOST_NAME = 1000
"""Characters of the name of a character, a table, an asset or a fact; a game cuts that of a character."""

Line = dict[str, Any]
_AS_IT_IS = (bool, int, str, type(None))


def dumped(line: Mapping[str, object]) -> bytes:
    """A line as it is sent: ASCII, with its line feed."""
    return json.dumps(line, separators=(",", ":"), allow_nan=False).encode("ascii") + b"\n"


def read_line(raw: bytes) -> Line:
    """A line that was sent. Raises ValueError where it is none; the message says why."""
    try:
        line = json.loads(raw, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise ValueError("this is not JSON.") from None
    if not isinstance(line, dict):
        raise ValueError("this is not a JSON object.")
    if raw.count(b"[") + raw.count(b"{") > MOST_DEPTH and _is_deep(line):
        raise ValueError(f"it is nested over {MOST_DEPTH} deep.")
    if not isinstance(line.get("line"), str):
        raise ValueError('the key "line" is missing.')
    _require(line)
    return line


def _is_deep(value: object) -> bool:
    level: list[object] = [value]
    for _ in range(MOST_DEPTH):
        nested = [each.values() if isinstance(each, dict) else each for each in level if isinstance(each, (dict, list))]
        level = [child for children in nested for child in children]
    return bool(level)


def cut_name(name: str) -> str:
    """The name of a character, not too long for a line."""
    return name if len(name) <= MOST_NAME else f"{name[: MOST_NAME - 1]}…"


def _refuse(constant: str) -> None:
    """NaN and Infinity are not JSON, though Python reads them."""
    raise ValueError(constant)


_KEYS: Mapping[str, Mapping[str, tuple[type, ...]]] = {
    HEADER: {"format": (int,), "game": (str,), "pid": (int,), "tables": (dict,)},
    TABLES: {"tables": (dict,)},
    ASK: {"t": (int, float), "who": (str, type(None)), "table": (str,), "facts": (dict,), "rows": (str,), "valid": (int,)},
    PICK: {"t": (int, float), "who": (str, type(None)), "table": (str,), "pick": (dict,)},
    DECISION: {"t": (int, float), "who": (str, type(None)), "decision": (dict,)},
    DATABASES: {"who": (str, type(None)), "databases": (dict,)},
    BONES: {"who": (str, type(None)), "names": (list,), "parents": (list,), "offsets": (list,), "moving": (list,)},
    POSE: {"t": (int, float), "who": (str, type(None)), "root": (list,), "rotations": (list,), "translations": (list,)},
    LOST: {"count": (int,)},
}


def _require(line: Line) -> None:
    """Raise ValueError for a line without what lines of its kind have."""
    for key, kinds in _KEYS.get(line["line"], {}).items():
        if not isinstance(line.get(key), kinds) or (key in line and kinds == (int,) and isinstance(line[key], bool)):
            raise ValueError(f'the key "{key}" is missing.' if key not in line else f'the value of "{key}" is of another type.')
    if line["line"] == ASK:
        try:
            int(line["rows"], 16)
        except ValueError:
            raise ValueError('the value of "rows" is no number in hexadecimal.') from None
        if line.get("actors") is not None and not _is_actors(line["actors"]):
            raise ValueError('the value of "actors" is no object of lists of objects.')
    if isinstance(line.get("t"), (int, float)) and not abs(line["t"]) <= sys.float_info.max:
        raise ValueError('the value of "t" is too large.')
    names = [line.get(key) for key in ("who", "table", "game")]
    for name, table in line["tables"].items() if line["line"] in (HEADER, TABLES) else ():
        names.append(name)
        if not isinstance(table, dict):
            raise ValueError('a table of "tables" is no object of JSON.')
        if not isinstance(table.get("conditions", {}), dict):
            raise ValueError('the value of "conditions" of a table is no object of JSON.')
    if isinstance(line.get("pick"), dict):
        names.append(line["pick"].get("asset"))
        if not isinstance(names[-1], (str, type(None))):
            raise ValueError('the asset of "pick" is no text.')
    if any(isinstance(name, str) and len(name) > MOST_NAME for name in names):
        raise ValueError(f"a name has over {MOST_NAME:,} characters.")


def _is_actors(value: object) -> bool:
    """Whether a value has the shape of actors: for each role a list of facts."""
    if not isinstance(value, dict):
        return False
    return all(isinstance(listed, list) and all(isinstance(facts, dict) for facts in listed) for listed in value.values())


# ---- facts


def sent_facts(facts: Mapping[str, object], conditions: Mapping[str, Condition]) -> dict[str, object]:
    """Facts as JSON has them. Those that no condition is about are sent too, where JSON has a word for them."""
    sent: dict[str, object] = {}
    for name, value in facts.items():
        condition = conditions.get(name)
        if condition is not None:
            sent[name] = sent_fact(value, condition)
        elif isinstance(name, str) and (isinstance(value, _AS_IT_IS) or (type(value) is float and math.isfinite(value))):
            sent[name] = value
    return sent


def sent_fact(value: object, condition: Condition) -> object:
    """One fact of a condition as JSON has it; null for what is no fact of it."""
    kind = type(value)
    if kind is float:
        return _sent_number(value)  # type: ignore[arg-type]
    if kind is bool or kind is int or value is None:
        return value
    if kind is str and not condition.domain.type.is_numeric:
        return value
    if isinstance(value, np.generic):
        return sent_fact(value.item(), condition) if type(value.item()) in (bool, int, float, str) else None
    try:
        fact = read_fact(value, condition)
    except ContextError:
        return None
    if isinstance(fact, Cell):
        return {"cell": format_cell(fact, condition.domain)}
    if isinstance(fact, frozenset):
        return sorted(fact)
    if isinstance(fact, float):
        return _sent_number(fact) if not condition.domain.type.is_whole else _sent_whole(fact, condition)
    return fact


def _sent_number(value: float) -> object:
    if math.isfinite(value):
        return value
    return None if value != value else {"number": "inf" if value > 0.0 else "-inf"}


def _sent_whole(value: float, condition: Condition) -> object:
    """A whole number, or a date by its name."""
    if not math.isfinite(value):
        return _sent_number(value)
    return int(value) if condition.domain.type.is_decimal else condition.domain.type.spelling.write(value)


def given_fact(sent: object) -> object:
    """A fact that was sent, as a query takes it. Raises ValueError where it is none."""
    if sent is None or isinstance(sent, (bool, int, float, str)):
        return sent
    if isinstance(sent, list) and all(isinstance(tag, str) for tag in sent):
        return frozenset(sent)
    if isinstance(sent, dict) and len(sent) == 1:
        if isinstance(text := sent.get("cell"), str):
            return FactSet(text)
        if (number := sent.get("number")) in ("inf", "-inf"):
            return float(number)
    raise ValueError("this is not a fact.")


def given_facts(sent: Mapping[str, object]) -> dict[str, object]:
    """Facts that were sent, as a query takes them."""
    return {name: given_fact(value) for name, value in sent.items()}


def fact_text(sent: object) -> str | None:
    """A fact that was sent as it is written on the command line; None where it is missing. Raises ValueError where it is none."""
    if sent is None:
        return None
    if isinstance(sent, (bool, int)):
        return str(sent)
    if isinstance(sent, float):
        return format_number(sent) if math.isfinite(sent) else ("inf" if sent > 0 else "-inf") if sent == sent else None
    if isinstance(sent, str):
        return name_text(sent)
    given = given_fact(sent)
    if isinstance(given, frozenset):
        return " ".join(map(name_text, sent)) or '""'  # type: ignore[call-overload]
    return given.text if isinstance(given, FactSet) else format_number(given)  # type: ignore[arg-type]


def name_text(text: str) -> str:
    """A name that is read as that name, even first in a fact."""
    return '"' + text.replace('"', '""') + '"' if text.startswith("-") else quoted(text)
