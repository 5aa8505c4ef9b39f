"""The undo history as a list: every step by its name, where one is, and what is on the disk."""

from __future__ import annotations

from collections.abc import Sequence

from tui.screens.ask import ChooseDialog


class StepsDialog(ChooseDialog):
    """Go back, or on, to any step. Gives how many steps shall lie behind."""

    keys_text = "↑↓ choose · Enter go there · Esc cancel"

    def __init__(self, names: Sequence[str], position: int) -> None:
        texts = ["the table as it was opened", *names]
        lines = [f"{_sign(i, position)} {i:>4}  {text}" for i, text in enumerate(texts)]
        super().__init__("Undo history", lines, position, about="▶ where the table is · ↷ undone")


def _sign(step: int, position: int) -> str:
    if step == position:
        return "▶"
    return " " if step < position else "↷"
