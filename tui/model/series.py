"""How a text goes on in a series: its last number counts on, and keeps its zeros: Dodge_09, Dodge_10."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from decimal import Decimal

_NUMBER = re.compile(r"\s*-?\d+(?:\.\d+)?\s*")


def continued(begun: Sequence[str], n_more: int) -> list[str]:
    """The next texts of a series. The last two texts that it begins with say the step; one alone counts on by 1, and a text without
    a number is repeated."""
    last = begun[-1] if begun else ""
    before = begun[-2] if len(begun) > 1 else None
    if _NUMBER.fullmatch(last):
        is_alone = before is None or not _NUMBER.fullmatch(before)
        step = Decimal(1) if is_alone or before is None else Decimal(last) - Decimal(before)
        return [format(Decimal(last) + step * at, "f") for at in range(1, n_more + 1)]
    number = _last_number(last)
    if number is None:
        return [last] * n_more
    head, digits, tail = number
    other = _last_number(before) if before is not None else None
    step_by = int(digits) - int(other[1]) if other is not None and (other[0], other[2]) == (head, tail) else 1
    counts = (int(digits) + step_by * at for at in range(1, n_more + 1))
    return [f"{head}{'-' if count < 0 else ''}{abs(count):0{len(digits)}d}{tail}" for count in counts]


def tells_step(first: str, second: str) -> bool:
    """Whether two texts differ by a number only, so that they say the step of a series."""
    if _NUMBER.fullmatch(first) and _NUMBER.fullmatch(second):
        return first.strip() != second.strip()
    one, two = _last_number(first), _last_number(second)
    return one is not None and two is not None and (one[0], one[2]) == (two[0], two[2]) and one[1] != two[1]


def _last_number(text: str) -> tuple[str, str, str] | None:
    """A text before, in and behind its last number; None without one, or where the number is longer than any that is counted."""
    at = re.search(r"(\d+)\D*\Z", text)
    if at is None or len(at[1]) > math.floor(math.log10(2**63)):
        return None
    return text[: at.start(1)], at[1], text[at.end(1) :]
