"""Data that never changes: a copy is the thing itself, and a pickle holds what it was made of.

What was worked out from it meanwhile (look-ups, masks as integers, generated functions) is not pickled, but worked out again where
it is needed. So a thing can be pickled at any time, before and after it was asked, and its pickle is the same.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any, Self


class Unchanging:
    """The base of frozen dataclasses that are copied by sharing and pickled by their fields."""

    __slots__ = ()

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        return type(self), tuple(getattr(self, field.name) for field in fields(self) if field.init)  # type: ignore[arg-type]
