"""Edits of `[selectors.NAME]`: priority databases and their thresholds, as the editor's Priorities tab changes them."""

from __future__ import annotations

from collections.abc import Sequence

from contextdb.errors import safe_text
from contextdb.motion.storage.config import MotionConfig
from contextdb.tables.changes import Edit, Sections
from contextdb.tables.table import Table


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
