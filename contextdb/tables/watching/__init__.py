"""Hot reload: `contextdb.watch(folder)`. The package is not called `watch`, which is the function's name."""

from __future__ import annotations

from contextdb.tables.watching.snapshot import Snapshot, table_like
from contextdb.tables.watching.watcher import Watch, watch

__all__ = ["Snapshot", "Watch", "table_like", "watch"]
