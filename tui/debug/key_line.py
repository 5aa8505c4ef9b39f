"""The debugger's foot: its keys as they are typed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ..widgets.key_line import Key, KeyLine
from .keys import TOGETHER, name_of


class DebugKeyLine(KeyLine):
    """The keys that are bound now, letters as they are."""

    def _bound(self) -> Iterator[Key]:
        return (replace(key, name=TOGETHER.get(key.key) or name_of(key.key)) for key in super()._bound())
