"""Dates as numbers: whole days since 1970-01-01 of the calendar that ISO 8601 and `datetime.date` use, from year 1 to 9999.

A cell writes them as 2026-01-31. A date and a time is no date: which day it is depends on where one is.
"""

from __future__ import annotations

import datetime
import math

import numpy as np

from contextdb.cells import intervals
from contextdb.cells.intervals import Span, Spans

DATE_TEXT = r"(?:[+-]?inf|[0-9]{4}-[0-9]{2}-[0-9]{2})"
"""A date; or no end at all, as every type of numbers writes it."""

_EPOCH = datetime.date(1970, 1, 1).toordinal()
LIMITS: Span = (float(datetime.date.min.toordinal() - _EPOCH), float(datetime.date.max.toordinal() - _EPOCH))
"""The first and the last day."""

MENDS = (
    (r"\b(\d{4})[/.](\d)\b", r"\1-0\2"),
    (r"\b(\d{4})[/.](\d\d)\b", r"\1-\2"),
    (r"\b(\d{4}-\d\d)[/.-](\d)\b(?!-)", r"\1-0\2"),
    (r"\b(\d{4}-\d\d)[/.](\d\d)\b", r"\1-\2"),
    (r"\b(\d{4})-(\d)-", r"\1-0\2-"),
    (r"\b(\d{4}-\d\d)-(\d)\b", r"\1-0\2"),
    (r"\b(\d{4})(\d\d)(\d\d)\b", r"\1-\2-\3"),
    (r"\b(\d\d)\.(\d\d)\.(\d{4})\b", r"\3-\2-\1"),
    (r"[T ]00:00(?::00(?:\.0+)?)?Z?", ""),
)
"""Other ways in which people write dates."""


def read_date(text: str) -> float:
    """The day that a text of the form 2026-01-31 is; ValueError where the calendar has no such day."""
    if "inf" in text:
        return float(text)
    try:
        return exact_day(datetime.date.fromisoformat(text))
    except ValueError:
        raise ValueError(f'the calendar has no day "{text}"') from None


def write_date(day: float) -> str:
    """A day as 2026-01-31; one before the first or after the last as that."""
    return str(date_of(day)) if math.isfinite(day) else str(day)


def date_of(day: float) -> datetime.date:
    """The date of a day; of one out of the calendar the first or the last date."""
    low, high = LIMITS
    return datetime.date.fromordinal(int(min(max(day, low), high)) + _EPOCH)


def exact_day(value: datetime.date) -> float:
    """The day of a date, which is no date and time; TypeError or ValueError for all else."""
    if isinstance(value, datetime.datetime):
        raise TypeError
    return float(datetime.date.toordinal(value) - _EPOCH)


def day_from_python(value: object) -> float | None:
    """The day that a fact is: a date, of numpy's too, or a whole float, which counts days; None for NaT and NaN. Raises TypeError
    where it is none of these, ValueError where the calendar has no such day."""
    if isinstance(value, np.datetime64):
        if np.isnat(value):
            return None
        day = value.astype("datetime64[D]")
        if day != value:
            raise TypeError
        return _in_calendar(float(day.astype(np.int64)))
    if isinstance(value, float):
        return None if math.isnan(value) else _in_calendar(value)
    if isinstance(value, datetime.date):
        return exact_day(value)
    raise TypeError


def _in_calendar(day: float) -> float:
    if not (LIMITS[0] <= day <= LIMITS[1] and day.is_integer()):
        raise ValueError("a date from 0001-01-01 to 9999-12-31")
    return day + 0.0


def days_within(spans: Spans) -> Spans:
    """The whole days of some spans; what reaches beyond the calendar has no end there."""
    low, high = LIMITS
    inside = [(first, last) for first, last in intervals.whole(spans) if first <= high and last >= low]
    return tuple((first if first >= low else -math.inf, last if last <= high else math.inf) for first, last in inside)
