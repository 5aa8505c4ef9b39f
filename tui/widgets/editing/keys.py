"""The keys of the cell editor. Which of them mean something at present is for `CellEditor.check_action` to say."""

from __future__ import annotations

from textual.binding import Binding, BindingType


def _key(keys: str, action: str, label: str, show: bool = False) -> Binding:
    """A key that comes before those of the entry line."""
    return Binding(keys, action, label, show=show, priority=True)


KEYS: list[BindingType] = [
    _key("enter", "enter", "OK", show=True),
    _key("shift+enter", "commit(-1, 0)", "OK, go up"),
    _key("tab", "tab", "OK, go right"),
    _key("shift+tab", "commit(0, -1)", "OK, go left"),
    _key("ctrl+j,ctrl+enter", "fill", "Fill the selection", show=True),
    _key("escape", "cancel", "Cancel", show=True),
    _key("f2", "edit_mode", "Move in the text", show=True),
    _key("up", "vertical(-1)", "Up"),
    _key("down", "vertical(1)", "Down"),
    _key("left", "sideways(-1)", "OK, go left"),
    _key("right", "sideways(1)", "OK, go right"),
    _key("pageup", "page(-1)", "A page up; a number: ten steps more"),
    _key("pagedown", "page(1)", "A page down; a number: ten steps less"),
    _key("home", "to_end(0)", "First of the list"),
    _key("end", "to_end(1)", "Last of the list"),
    _key("f4,alt+down", "list", "List", show=True),
    _key("f4", "other_form", "Other form", show=True),
    _key("alt+up,alt+right", "nudge(1)", "More"),
    _key("alt+down,alt+left", "nudge(-1)", "Less"),
    _key("space", "tick", "Tick", show=True),
    _key("plus", "sign('+')", "Has"),
    _key("minus", "sign('-')", "Has not"),
    _key("ctrl+t", "take", "Accept suggestion", show=True),
    _key("ctrl+n", "declare", "Add the value", show=True),
]
