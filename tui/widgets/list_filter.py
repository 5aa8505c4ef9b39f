"""The field over a list: what is typed filters it, and the keys that move go through it."""

from __future__ import annotations

from textual.widgets import Input


class ListFilter(Input):
    """A field that leaves Home and End to its list as long as there is no text to move in."""

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        return super().check_action(action, parameters) if self.value or action not in ("home", "end") else False
