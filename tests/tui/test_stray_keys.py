"""No key goes astray: what is typed goes to what is shown, and no cell changes that is not seen."""

import pytest
import random_hands
from strategies import IS_FULL

SEQUENCES = 300 if IS_FULL else 2
"""At each size; 300 cost about 70 s of the processor."""
SIZES = {(80, 24): 0, (120, 36): 10_000, (160, 48): 20_000}
"""Sizes of the terminal, with their first seeds."""


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_random_hands_change_no_cell_that_is_not_seen(tmp_path, size):
    broken = random_hands.first_broken(tmp_path, size, range(SIZES[size], SIZES[size] + SEQUENCES))
    assert broken is None, str(broken)


# ---- a cell that is edited


# ---- the empty row


# ---- commas in what is pasted
