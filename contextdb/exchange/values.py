"""Values of other formats as the texts of cells: True, 5, 0.25, empty for nothing."""

from __future__ import annotations

import datetime
import math

from contextdb.cells.words import format_number, quoted

DATES = (datetime.date, datetime.time, datetime.datetime, datetime.timedelta)


def text_of_value(value: object) -> str:
    """The text of a value: a string as it is, a bool True or False, a number in the fewest digits, a list its names, None empty.

    Dates become ISO texts, at midnight without a time; NaN, which no cell can mean, is empty. What is nested deeper becomes its
    Python text.
    """
    if isinstance(value, str):
        return value
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return format_number(value)
    if isinstance(value, datetime.datetime) and value.time() == datetime.time():
        return value.date().isoformat()
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, (list, tuple)):
        return " ".join(quoted(text_of_value(item)) for item in value)
    return str(value)
