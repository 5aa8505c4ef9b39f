"""Which rows of two tables are the same ones, by their assets."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray


def rows_of_assets(wanted: Iterable[str], assets: Sequence[str]) -> NDArray[np.int64]:
    """For each wanted asset its row among others, -1 without one; equal assets pair up in their order."""
    rows: dict[str, list[int]] = {}
    for row, asset in enumerate(assets):
        rows.setdefault(asset, []).append(row)
    left = {asset: iter(each) for asset, each in rows.items()}
    return np.array([next(left.get(asset, iter(())), -1) for asset in wanted], np.int64)
