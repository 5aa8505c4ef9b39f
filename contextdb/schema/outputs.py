"""What `outputs` and `fallback` of `[tables.NAME]` say: the declared outputs of a table, and what the game reads where no row is
valid.

    outputs = ["Slots", "Line"]                                  texts
    outputs = { Damage = { type = "int", default = 0 }, Line = { type = "text" } }
    fallback = "idle"
    fallback = { asset = "idle", outputs = { Damage = 3 } }

A fault is given with the path of the key below the table's section. Nothing here reads a file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from contextdb.cells.output_types import MOST_NUMBERS, OUTPUT_TYPES, OutputType, OutputValue, names_where
from contextdb.cells.outputs import SLOT_COLUMNS, Output
from contextdb.errors import Fault, in_quotes, mend_for, nearest, some
from contextdb.files.toml_shapes import Shape, near_key, no_key, nothing, one_of, said_of
from contextdb.files.toml_text import dotted, what
from contextdb.schema.shapes import KEY_SYNONYMS, KIND_SYNONYMS, NUMBER, TEXT, VALUES, wrong_name

Found = tuple[tuple[str, ...], Fault]
Said = Mapping[str, Any]

TYPE_SYNONYMS = {
    **{synonym: name for synonym, name in KIND_SYNONYMS.items() if name in OUTPUT_TYPES},
    **dict.fromkeys(("vector", "vec2", "vec3", "vec4", "tuple", "array", "color", "list of numbers"), "numbers"),
    **dict.fromkeys(("angle", "seconds"), "number"),
    **dict.fromkeys(("tags", "date"), "text"),
}
_NUMERIC = names_where(lambda kind: kind.is_numeric)
_KEYS_OF = {
    "min": _NUMERIC,
    "max": _NUMERIC,
    "values": names_where(lambda kind: kind.has_values),
    "size": names_where(lambda kind: kind.has_size),
}
"""The types that a key has a place in; the others have one in all."""


def _wrong_size(value: object) -> str | None:
    if isinstance(value, bool) or not isinstance(value, int):
        return f"this is {what(value)}, not a whole number"
    return None if 1 <= value <= MOST_NUMBERS else "there are no cells of so many numbers"


OUTPUT_KEYS: Mapping[str, Shape] = {
    "type": one_of(tuple(OUTPUT_TYPES), "type", TYPE_SYNONYMS),
    "default": Shape("a value of the output's type", nothing),
    "min": NUMBER,
    "max": NUMBER,
    "values": VALUES,
    "size": Shape(f"a whole number from 1 to {MOST_NUMBERS}", _wrong_size),
    "unit": TEXT,
    "description": TEXT,
}
"""The keys of one output and what they accept."""

FALLBACK_KEYS = ("asset", "outputs")
MOST_SHOWN = 120
"""Characters of a key and its value in a message."""


def outputs_faults(said: Said) -> Iterator[Found]:
    """What is wrong with `outputs` and `fallback` among the keys of a table, as far as each can be used by itself."""
    outputs, fallback = said.get("outputs"), said.get("fallback")
    found = list(_declaration_faults(outputs)) if isinstance(outputs, Mapping) else []
    yield from found
    if isinstance(fallback, Mapping):
        yield from _fallback_faults(fallback, None if found else declared_outputs(outputs or ()))


def declared_outputs(said: Any) -> tuple[Output, ...]:
    """The outputs that a sound `outputs` declares, in its order."""
    if not isinstance(said, Mapping):
        return tuple(map(Output, said))
    return tuple(_output(name, part) for name, part in said.items())


def fallback_of(said: Any, declared: Iterable[Output]) -> tuple[str | None, tuple[tuple[str, OutputValue], ...]]:
    """The asset and the outputs that a sound `fallback` gives."""
    if not isinstance(said, Mapping):
        return said, ()
    outputs = {output.name: output for output in declared}
    return said["asset"], tuple((name, outputs[name].taken(value)) for name, value in said.get("outputs", {}).items())


def outputs_to_toml(names: Sequence[str], declared: Iterable[Output]) -> list[str] | dict[str, dict[str, object]]:
    """What `outputs` says of some names: a list where nothing else is declared of them."""
    typed = {output.name: output for output in declared}
    if not any(name in typed for name in names):
        return list(names)
    return {name: _output_to_toml(typed.get(name, Output(name))) for name in names}


def fallback_to_toml(asset: str | None, outputs: Iterable[tuple[str, OutputValue]]) -> str | dict[str, object] | None:
    values = {name: _plain(value) for name, value in outputs}
    return {"asset": asset, "outputs": values} if values and asset is not None else asset


# ---- faults


def _declaration_faults(outputs: Said) -> Iterator[Found]:
    for name, part in outputs.items():
        path = ("outputs", name)
        if wrong_name(name):
            continue
        if not isinstance(part, Mapping):
            mend = _said(name, {"type": part}) if isinstance(part, str) and part in OUTPUT_TYPES else ""
            yield path, Fault(f"{_said(name, part)}: this is {what(part)}, not a table.", _said(name, {"type": "number"}), mend)
            continue
        found = list(_key_faults(path, part))
        yield from found
        if not found:
            yield from _joint_faults(path, part)


def _key_faults(path: tuple[str, ...], part: Said) -> Iterator[Found]:
    about = f"output {in_quotes(path[-1])}"
    for key, value in part.items():
        if key not in OUTPUT_KEYS:
            yield (*path, key), no_key(about, key, OUTPUT_KEYS, _near_key(key))
        elif fault := OUTPUT_KEYS[key].fault(about, key, value, MOST_SHOWN):
            yield (*path, key), fault
    if "type" not in map(_near_key, part):
        guess = _said("type", _guess(part)) if part else ""
        yield path, Fault(f"{about} has no type.", OUTPUT_KEYS["type"].accepted, guess)


def _joint_faults(path: tuple[str, ...], part: Said) -> Iterator[Found]:
    """What is wrong with keys that are sound by themselves."""
    about, kind = f"output {in_quotes(path[-1])}", OUTPUT_TYPES[part["type"]]
    found: list[Found] = []
    for key, kinds in _KEYS_OF.items():
        if key in part and kind.name not in kinds:
            wrong = f"{about} {_said(key, part[key])} has no place here: its type is {in_quotes(kind.name)}."
            found.append(((*path, key), Fault(wrong, f"{key} in an output of type {' or '.join(kinds)}", "to leave it out")))
    for key, is_needed, said in (("values", kind.has_values, ["A", "B"]), ("size", kind.has_size, 3)):
        if is_needed and key not in part:
            found.append((path, Fault(f"{about} is of type {in_quotes(kind.name)} and has no {key}.", _said(key, said))))
    if path[-1] in SLOT_COLUMNS and (not kind.is_free or "default" in part):
        wrong = f"{about} says which roles a row fills, so it is a text without a default."
        found.append((path, Fault(wrong, _said("type", "text"))))
    found += _bound_faults(path, kind, {key: part[key] for key in ("min", "max") if key in part})
    yield from found
    if not found and "default" in part:
        bare = _output(path[-1], {key: value for key, value in part.items() if key != "default"})
        try:
            bare.taken(part["default"])
        except ValueError as error:
            yield (*path, "default"), Fault(f"{about} {_said('default', part['default'])}: {error}.", bare.accepted)


def _bound_faults(path: tuple[str, ...], kind: OutputType, bounds: Said) -> Iterator[Found]:
    about = f"output {in_quotes(path[-1])}"
    low, high = bounds.get("min", -math.inf), bounds.get("max", math.inf)
    if low > high:
        mend = f"{_said('min', high)} and {_said('max', low)}"
        yield (
            (*path, "min"),
            Fault(f"{about} {_said('min', low)} is above {_said('max', high)}.", "a min that is not above max", mend),
        )
    for key, bound in bounds.items():
        if bound == (math.inf if key == "min" else -math.inf):
            yield (*path, key), Fault(f"{about} {_said(key, bound)} leaves no number.", "a finite number", "to leave it out")
        elif kind.is_whole and math.isfinite(bound) and bound != math.floor(bound):
            mend = _said(key, math.ceil(bound) if key == "min" else math.floor(bound))
            yield (*path, key), Fault(f"{about} {_said(key, bound)}: an int has whole bounds.", "a whole number", mend)


def _fallback_faults(fallback: Said, declared: Iterable[Output] | None) -> Iterator[Found]:
    """What is wrong with a fallback that is a table; what it gives to outputs is looked at where those are known."""
    for key in fallback:
        if key not in FALLBACK_KEYS:
            fault = no_key("fallback", key, FALLBACK_KEYS, nearest(str(key), FALLBACK_KEYS))
            is_output = declared is not None and key in (output.name for output in declared)
            yield ("fallback", key), replace(fault, mend=_said("outputs", {key: fallback[key]})) if is_output else fault
    if "asset" not in fallback:
        yield ("fallback",), Fault("fallback names no asset.", _said("asset", "idle"))
    elif wrong := wrong_name(fallback["asset"]):
        yield ("fallback", "asset"), Fault(f"fallback {_said('asset', fallback['asset'])}: {wrong}.", 'a name, such as "idle"')
    given = fallback.get("outputs", {})
    if not isinstance(given, Mapping):
        wrong = f"fallback {_said('outputs', given)}: this is {what(given)}, not a table."
        yield ("fallback", "outputs"), Fault(wrong, _said("outputs", {"damage": 3}))
    elif declared is not None:
        yield from _given_faults(given, {output.name: output for output in declared})


def _given_faults(given: Said, declared: Mapping[str, Output]) -> Iterator[Found]:
    for name, value in given.items():
        path = ("fallback", "outputs", name)
        if name not in declared:
            accepted = some(declared) or "no name: the table has no outputs"
            yield (
                path,
                Fault(f"fallback gives {in_quotes(str(name))}, which is not an output.", accepted, mend_for(str(name), declared)),
            )
            continue
        try:
            declared[name].taken(value)
        except ValueError as error:
            yield path, Fault(f"fallback {_said(name, value)}: {error}.", declared[name].accepted)


# ---- parts


def _near_key(key: str) -> str | None:
    return near_key(key, OUTPUT_KEYS, KEY_SYNONYMS | dict.fromkeys(("length", "count", "dimensions"), "size"))


def _guess(part: Said) -> str:
    """The type that keys without one likely mean."""
    if "values" in part:
        return "enum"
    default = part.get("default")
    if isinstance(default, bool):
        return "bool"
    if isinstance(default, (list, tuple)) or "size" in part:
        return "numbers"
    return "int" if isinstance(default, int) else "text" if isinstance(default, str) else "number"


def _said(key: str, value: object) -> str:
    return said_of(dotted((str(key),)), value, MOST_SHOWN)


def _output(name: str, part: Said) -> Output:
    bare = Output(
        name,
        part["type"],
        None,
        float(part.get("min", -math.inf)) + 0.0,
        float(part.get("max", math.inf)) + 0.0,
        tuple(part.get("values", ())),
        part.get("size", 1),
        part.get("unit", ""),
        part.get("description", ""),
    )
    default = bare.taken(part["default"]) if "default" in part else None
    if default is None or (bare.type.is_free and default == ""):
        return bare
    return replace(bare, default=default)


def _output_to_toml(output: Output) -> dict[str, object]:
    said: dict[str, object] = {"type": output.kind}
    said |= {} if output.default is None else {"default": _plain(output.default)}
    bounds = {"min": output.minimum, "max": output.maximum}
    said |= {key: int(end) if output.type.is_whole else end for key, end in bounds.items() if math.isfinite(end)}
    said |= {"values": list(output.values)} if output.values else {}
    said |= {"size": output.size} if output.type.has_size else {}
    texts = {"unit": output.unit, "description": output.description}
    return said | {key: text for key, text in texts.items() if text}


def _plain(value: OutputValue) -> object:
    return list(value) if isinstance(value, tuple) else value
