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

from contextdb.cells.output_types import MOST_NUMBERS, OUTPUT_TYPES, OutputValue, names_where
from contextdb.cells.outputs import SLOT_COLUMNS, Output
from contextdb.cells.row_play import KINDS as PLAY_KINDS
from contextdb.errors import Fault, in_quotes, mend_for, nearest, some
from contextdb.files.settings import Setting, Settings
from contextdb.files.toml_shapes import Shape, between, dotted, key_value, near_key, no_key, nothing, one_of, what, wrong_name
from contextdb.schema.shapes import KEY_SYNONYMS, KIND_SYNONYMS, NUMBER, TEXT, VALUES

PathFault = tuple[tuple[str, ...], Fault]
Part = Mapping[str, Any]

TYPE_SYNONYMS = {
    **{synonym: name for synonym, name in KIND_SYNONYMS.items() if name in OUTPUT_TYPES},
    **dict.fromkeys(("vector", "vec2", "vec3", "vec4", "tuple", "array", "color", "list of numbers"), "numbers"),
    **dict.fromkeys(("angle", "seconds"), "number"),
    **dict.fromkeys(("tags", "date"), "text"),
}


_NUMERIC = names_where(lambda kind: kind.is_numeric)
_BEYOND = "A cell beyond is an [error](messages.md#output-out-of-bounds)."
OUTPUT: Settings = {
    "type": Setting(one_of(tuple(OUTPUT_TYPES), "type", TYPE_SYNONYMS), "What a value of it is."),
    "default": Setting(Shape("a value of the output's type", nothing), "The value of an empty cell.", None, without="none"),
    "min": Setting(NUMBER, "The least value.", -math.inf, _BEYOND, "no bound", types=_NUMERIC),
    "max": Setting(NUMBER, "The greatest value.", math.inf, _BEYOND, "no bound", types=_NUMERIC),
    "values": Setting(VALUES, "The possible names, in order.", types=names_where(lambda kind: kind.has_values)),
    "size": Setting(
        between("a whole number", 1, MOST_NUMBERS, 3, is_whole=True),
        "How many numbers each cell has.",
        types=names_where(lambda kind: kind.has_size),
    ),
    "unit": Setting(TEXT, "Its unit, for people.", "", without="none"),
    "description": Setting(TEXT, "A sentence for people.", "", without="none"),
}
"""The keys of one output."""

FALLBACK_KEYS = ("asset", "outputs")
MOST_SHOWN = 120
"""Characters of a key and its value in a message."""


def outputs_faults(section: Part) -> Iterator[PathFault]:
    """What is wrong with `outputs` and `fallback` among the keys of a table, as far as each can be used by itself."""
    outputs, fallback = section.get("outputs"), section.get("fallback")
    faults = list(_declaration_faults(outputs)) if isinstance(outputs, Mapping) else []
    yield from faults
    if isinstance(fallback, Mapping):
        yield from _fallback_faults(fallback, None if faults else declared_outputs(outputs or ()))


def declared_outputs(section: Any) -> tuple[Output, ...]:
    """The outputs that a sound `outputs` declares, in its order."""
    if not isinstance(section, Mapping):
        return tuple(map(Output, section))
    return tuple(_output(name, part) for name, part in section.items())


def fallback_of(section: Any, declared: Iterable[Output]) -> tuple[str | None, tuple[tuple[str, OutputValue], ...]]:
    """The asset and the outputs that a sound `fallback` gives."""
    if not isinstance(section, Mapping):
        return section, ()
    outputs = {output.name: output for output in declared}
    return section["asset"], tuple((name, outputs[name].taken(value)) for name, value in section.get("outputs", {}).items())


def outputs_to_toml(names: Sequence[str], declared: Iterable[Output]) -> list[str] | dict[str, dict[str, object]]:
    """What `outputs` says of some names: a list where nothing else is declared of them."""
    typed = {output.name: output for output in declared}
    if not any(name in typed for name in names):
        return list(names)
    return {name: _output_to_toml(typed.get(name, Output(name))) for name in names}


def fallback_to_toml(asset: str | None, outputs: Iterable[tuple[str, OutputValue]]) -> str | dict[str, object] | None:
    """What contextdb.toml says of a fallback: its asset, or a table of the asset and its outputs."""
    values = {name: _plain(value) for name, value in outputs}
    return {"asset": asset, "outputs": values} if values and asset is not None else asset


# ---- faults


def _declaration_faults(outputs: Part) -> Iterator[PathFault]:
    for name, part in outputs.items():
        path = ("outputs", name)
        if wrong_name(name):
            continue
        if not isinstance(part, Mapping):
            mend = _typed(name, {"type": part}) if isinstance(part, str) and part in OUTPUT_TYPES else ""
            wrong = f"output {_typed(name, part)}: this is {what(part)}, not a table."
            yield path, Fault(wrong, _typed(name, {"type": "number"}), mend)
            continue
        faults = list(_key_faults(path, part))
        yield from faults
        if not faults:
            yield from _joint_faults(path, part)


def _key_faults(path: tuple[str, ...], part: Part) -> Iterator[PathFault]:
    about = f"output {in_quotes(path[-1])}"
    for key, value in part.items():
        if key not in OUTPUT:
            yield (*path, key), no_key(about, key, OUTPUT, _near_key(key))
        elif fault := OUTPUT[key].shape.fault(about, key, value, MOST_SHOWN):
            yield (*path, key), fault
    if "type" not in map(_near_key, part):
        guess = _typed("type", _guess(part)) if part else ""
        yield path, Fault(f"{about} has no type.", OUTPUT["type"].shape.accepted, guess)


def _joint_faults(path: tuple[str, ...], part: Part) -> Iterator[PathFault]:
    """What is wrong with keys that are sound by themselves."""
    about, kind = f"output {in_quotes(path[-1])}", OUTPUT_TYPES[part["type"]]
    faults: list[PathFault] = []
    for key in part:
        if not OUTPUT[key].has_place(kind.name):
            types = " or ".join(OUTPUT[key].types)
            wrong = f"{about} {_typed(key, part[key])} has no place here: its type is {in_quotes(kind.name)}."
            faults.append(((*path, key), Fault(wrong, f"{key} in an output of type {types}", "to leave it out")))
    for key, is_needed, example in (("values", kind.has_values, ["A", "B"]), ("size", kind.has_size, 3)):
        if is_needed and key not in part:
            faults.append((path, Fault(f"{about} is of type {in_quotes(kind.name)} and has no {key}.", _typed(key, example))))
    if path[-1] in SLOT_COLUMNS and (not kind.is_free or "default" in part):
        wrong = f"{about} says which roles a row fills, so it is a text without a default."
        faults.append((path, Fault(wrong, _typed("type", "text"))))
    if kind.name not in PLAY_KINDS.get(path[-1], (kind.name,)):
        wrong = f"{about} says how a row plays, and is of type {in_quotes(kind.name)}."
        faults.append((path, Fault(wrong, some(PLAY_KINDS[path[-1]]), _typed("type", PLAY_KINDS[path[-1]][0]))))
    ends = {key: (part[key], float(part[key])) for key in ("min", "max") if key in part}
    faults += [((*path, key), fault) for key, fault in bound_faults(about, ends, "an int", kind.is_whole)]
    yield from faults
    if not faults and "default" in part:
        bare = _output(path[-1], {key: value for key, value in part.items() if key != "default"})
        try:
            bare.taken(part["default"])
        except ValueError as error:
            yield (*path, "default"), Fault(f"{about} {_typed('default', part['default'])}: {error}.", bare.accepted)


def bound_faults(about: str, ends: Mapping[str, tuple[object, float]], noun: str, is_whole: bool) -> Iterator[tuple[str, Fault]]:
    """What is wrong with `min` and `max`, each as it is written and its number."""
    if len(ends) == 2 and ends["min"][1] > ends["max"][1]:
        low, high = ends["min"][0], ends["max"][0]
        mend = f"{_typed('min', high)} and {_typed('max', low)}"
        yield "min", Fault(f"{about} {_typed('min', low)} is above {_typed('max', high)}.", "a min that is not above max", mend)
    for key, (written, bound) in ends.items():
        if bound == (math.inf if key == "min" else -math.inf):
            yield key, Fault(f"{about} {_typed(key, written)} leaves no number.", "a finite number", "to leave it out")
        elif is_whole and math.isfinite(bound) and bound != math.floor(bound):
            mend = _typed(key, math.ceil(bound) if key == "min" else math.floor(bound))
            yield key, Fault(f"{about} {_typed(key, written)}: {noun} has whole bounds.", "a whole number", mend)


def _fallback_faults(fallback: Part, declared: Iterable[Output] | None) -> Iterator[PathFault]:
    """What is wrong with a fallback that is a table; what it gives to outputs is looked at where those are known."""
    for key in fallback:
        if key not in FALLBACK_KEYS:
            fault = no_key("fallback", key, FALLBACK_KEYS, nearest(str(key), FALLBACK_KEYS))
            is_output = declared is not None and key in (output.name for output in declared)
            yield ("fallback", key), replace(fault, mend=_typed("outputs", {key: fallback[key]})) if is_output else fault
    if "asset" not in fallback:
        yield ("fallback",), Fault("fallback names no asset.", _typed("asset", "idle"))
    elif wrong := wrong_name(fallback["asset"]):
        yield ("fallback", "asset"), Fault(f"fallback {_typed('asset', fallback['asset'])}: {wrong}.", 'a name, such as "idle"')
    given = fallback.get("outputs", {})
    if not isinstance(given, Mapping):
        wrong = f"fallback {_typed('outputs', given)}: this is {what(given)}, not a table."
        yield ("fallback", "outputs"), Fault(wrong, _typed("outputs", {"damage": 3}))
    elif declared is not None:
        yield from _given_faults(given, {output.name: output for output in declared})


def _given_faults(given: Part, declared: Mapping[str, Output]) -> Iterator[PathFault]:
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
            yield path, Fault(f"fallback {_typed(name, value)}: {error}.", declared[name].accepted)


# ---- parts


def _near_key(key: str) -> str | None:
    return near_key(key, OUTPUT, KEY_SYNONYMS | dict.fromkeys(("length", "count", "dimensions"), "size"))


def _guess(part: Part) -> str:
    """The type that keys without one likely mean."""
    if "values" in part:
        return "enum"
    default = part.get("default")
    if isinstance(default, bool):
        return "bool"
    if isinstance(default, (list, tuple)) or "size" in part:
        return "numbers"
    return "int" if isinstance(default, int) else "text" if isinstance(default, str) else "number"


def _typed(key: str, value: object) -> str:
    return key_value(dotted((str(key),)), value, MOST_SHOWN)


def _output(name: str, part: Part) -> Output:
    bare = Output(
        name,
        part["type"],
        None,
        float(part.get("min", -math.inf)) + 0.0,
        float(part.get("max", math.inf)) + 0.0,
        tuple(part.get("values", ())),
        int(part.get("size", 1)),
        part.get("unit", ""),
        part.get("description", ""),
    )
    default = bare.taken(part["default"]) if "default" in part else None
    if default is None or (bare.type.is_free and default == ""):
        return bare
    return replace(bare, default=default)


def _output_to_toml(output: Output) -> dict[str, object]:
    part: dict[str, object] = {"type": output.kind}
    part |= {} if output.default is None else {"default": _plain(output.default)}
    bounds = {"min": output.minimum, "max": output.maximum}
    part |= {key: int(end) if output.type.is_whole else end for key, end in bounds.items() if math.isfinite(end)}
    part |= {"values": list(output.values)} if output.values else {}
    part |= {"size": output.size} if output.type.has_size else {}
    texts = {"unit": output.unit, "description": output.description}
    return part | {key: text for key, text in texts.items() if text}


def _plain(value: OutputValue) -> object:
    return list(value) if isinstance(value, tuple) else value
