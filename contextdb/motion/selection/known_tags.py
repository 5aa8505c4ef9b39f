"""Let databases know each other's tags, so that one tag filter can be asked of all.

A tag that only another database's markup knows is one that no frame of this database has.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from contextdb.motion.search.database import MotionDatabase


def with_tags(database: MotionDatabase, tags: Iterable[str]) -> MotionDatabase:
    """The same database, its markup knowing some tags more; the same object if it knows them already. The features are shared."""
    marks = database.marks
    new = tuple(tag for tag in tags if tag not in marks.tags)
    if not new:
        return database
    wider = np.pad(marks.kind_tags, ((0, 0), (0, len(new))))
    return replace(database, marks=replace(marks, tags=marks.tags + new, kind_tags=wider))
