"""Numbers as options give them."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

from contextdb.cells.arguments import as_number
from contextdb.errors import in_quotes


def number_of(text: str) -> float | None:
    """The finite number that a text is, None for any other."""
    try:
        return as_number(float(text))
    except ValueError:
        return None


def percent(text: str) -> float:
    """A percentage as a share."""
    number = number_of(text.removesuffix("%"))
    if number is None or not 0.0 <= number <= 100.0:
        raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not a percentage. Accepted: a number from 0 to 100.")
    return number / 100.0


def number_type(is_not: str, least: float = 0.0, most: float = math.inf) -> Callable[[str], float]:
    """The type of an option that is a number between two bounds; `is_not` says what another text is not, and what is accepted."""

    def read(text: str) -> float:
        number = number_of(text)
        if number is None or not least <= number <= most:
            raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not {is_not}")
        return number

    return read


def whole_type(is_not: str, least: int = 0, most: float = math.inf) -> Callable[[str], int]:
    """The same of a whole number."""

    def read(text: str) -> int:
        if not text.isdecimal() or len(text) > 18 or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"{in_quotes(text)} is not {is_not}")
        return int(text)

    return read


rate_of = number_type("a rate. Accepted: 1 to 1000 updates a second, such as 30.", 1.0, 1000.0)
unit_of = number_type("a unit. Accepted: metres, such as 0.01 for centimetres.", 1e-9, 1e9)
