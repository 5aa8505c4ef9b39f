"""Write weights of channels and thresholds of databases into contextdb.toml. An edge: this touches the disk.

Only the keys that change are written; every other byte of the file stays. Before the file is replaced, its new text is read, and
must say what it said with these numbers changed.
"""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from contextdb.disk import read_bytes
from contextdb.edits.schema_file import SchemaChange
from contextdb.errors import Fault, Place, SchemaError, in_quotes, mend_for, safe_text, some
from contextdb.files.toml_shapes import Path as KeyPath
from contextdb.motion.storage.config import MotionConfig
from contextdb.schema import toml_edit
from contextdb.tables.changes import Edit, Sections
from contextdb.tables.project import schema_of
from contextdb.tables.table import Table

_BOM = b"\xef\xbb\xbf"


def weights_change(
    path: Path, features: str, weights: Mapping[str, float], selector: str = "", thresholds: Mapping[str, float] | None = None
) -> SchemaChange | None:
    """What is to be written so that contextdb.toml, at `path`, says these weights and thresholds; None when it says so already.

    `weights` are those of the channels of `[features.NAME]`, `thresholds` those of the databases of `[selectors.NAME]`. Raises
    SchemaError where the file cannot be read, or has no such channel, database or section, with the nearest; FileError where it may
    not be read.
    """
    raw = read_bytes(path)
    bom = _BOM if raw.startswith(_BOM) else b""
    schema = schema_of(raw, path)
    config = MotionConfig.from_dict(schema.motion, file=str(path))
    text = raw.removeprefix(_BOM).decode()
    document: dict[str, Any] = tomllib.loads(text)
    expected = copy.deepcopy(document)
    if weights:
        channels = [channel.name for channel in _known("features", features, config.features, path).channels]
        for name, weight in weights.items():
            place = _place(name, channels, f"[features.{features}] has no channel", path)
            text = _set(text, expected, ("features", features, "channels"), place, "weight", weight)
    if thresholds:
        order = [database for database, _ in _known("selectors", selector, config.selectors, path).order]
        for name, threshold in thresholds.items():
            place = _place(name, order, f"[selectors.{selector}] has no database", path)
            text = _set(text, expected, ("selectors", selector, "order"), place, "threshold", threshold)
    if expected == document:
        return None
    if tomllib.loads(text) != expected:
        problem = "the weights cannot be changed without changing more of the file."
        raise SchemaError(Fault(problem, "channels in a list, or as [[features.NAME.channels]]", place=Place(str(path))))
    MotionConfig.from_dict(schema_of(text.encode(), path).motion, file=str(path))
    return SchemaChange(path, bom + text.encode(), raw)


def _known(section: str, name: str, parts: Mapping[str, Any], path: Path) -> Any:
    if name not in parts:
        raise SchemaError(Fault(f"there is no [{section}.{name}].", some(parts) or "none", mend_for(name, parts), Place(str(path))))
    return parts[name]


def _place(name: str, known: list[str], problem: str, path: Path) -> int:
    if name not in known:
        raise SchemaError(Fault(f"{problem} {in_quotes(name)}.", some(known), mend_for(name, known), Place(str(path))))
    return known.index(name)


def _set(text: str, document: dict[str, Any], path: KeyPath, place: int, key: str, value: float) -> str:
    """The text with a number set, and the document too; a number that is there already stays as it is written."""
    item = document[path[0]][path[1]][path[2]][place]
    if item.get(key, 1.0 if key == "weight" else None) == value:
        return text
    item[key] = value
    return toml_edit.set_in_list(text, path, place, key, value)


# ---- edits of `[selectors.NAME]`: priority databases and their thresholds, as the editor's Priorities tab changes them


def set_selector(table: Table, name: str, order: Sequence[tuple[str, float | None]] | None, what: str = "") -> Edit:
    """Set a selector's databases in order, each with its threshold (the last: None), or with None take the selector away.

    Raises SchemaError for an order that `[selectors.NAME]` could not hold, with what is accepted.
    """
    steps = [{"database": one} | ({} if threshold is None else {"threshold": threshold}) for one, threshold in order or ()]
    part = None if order is None else {**table.schema.selectors.get(name, {}), "order": steps}
    if table.schema.selectors.get(name) == part:
        return Edit(what, ())
    edit = Edit(what or f"Change the selector {safe_text(name)}", (Sections(parts={"selectors": {name: part}}),))
    changed = edit.apply(table.with_rows_taken([]))
    MotionConfig.from_dict(changed.schema.motion, file=changed.schema.file)
    return edit
