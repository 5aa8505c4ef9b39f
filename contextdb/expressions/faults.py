"""What is wrong with an expression: the characters it is about, why, and the whole text as it was probably meant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from contextdb.errors import SHOWN_CHARACTERS, Fault, SchemaError, in_quotes

MOST_SLIPS = 8
"""So many slips in one text are mended together; with more of them only the first is reported."""


class ExpressionError(SchemaError):
    """An expression that cannot be read, or that does not fit the conditions it is about."""


@dataclass(frozen=True, slots=True)
class ExpressionFault(Fault):
    """A fault with the characters of the expression that it is about: text[start:stop], from 0."""

    text: str = ""
    start: int = 0
    stop: int = 0

    @property
    def pointed(self) -> str:
        """The line of the expression and, under it, marks below the characters that the fault is about."""
        first = self.text.rfind("\n", 0, self.start) + 1
        line = self.text[first:].partition("\n")[0]
        width = max(1, min(self.stop, first + len(line)) - self.start)
        return f"{line}\n{' ' * (self.start - first)}{'^' * width}"


class Refusal(Exception):
    """Raised while an expression is read: text[start:stop] is not accepted. `meant` is what may be there instead."""

    rule = "unreadable"

    def __init__(self, start: int, stop: int, why: str, accepted: str = "", meant: str | None = None) -> None:
        super().__init__(why)
        self.start, self.stop, self.why, self.accepted, self.meant = start, stop, why, accepted, meant


class UnknownName(Refusal):
    """The text names a condition that there is not; there may be one elsewhere."""

    rule = "unknown-fact"


def fault_of(text: str, refusal: Refusal, read: Callable[[str], object]) -> ExpressionFault:
    """The fault of a refusal. Its mend is the whole text when all of its slips can be mended so that `read` takes it."""
    problem = f"{_excerpt(text, refusal.start)}, character {refusal.start + 1}: {refusal.why}."
    whole = _mended(text, refusal, read)
    mend = ""
    if whole is not None and len(whole) <= SHOWN_CHARACTERS:
        mend = in_quotes(whole)
    elif refusal.meant is not None and refusal.meant.strip():
        mend = in_quotes(refusal.meant.strip())
    return ExpressionFault(problem, refusal.accepted, mend, rule=refusal.rule, text=text, start=refusal.start, stop=refusal.stop)


def _excerpt(text: str, start: int) -> str:
    """The text, or of a long one what is round a character."""
    if len(text) <= SHOWN_CHARACTERS:
        return in_quotes(text)
    half = SHOWN_CHARACTERS // 2
    first = max(0, min(start - half, len(text) - 2 * half))
    head, tail = "… " if first else "", " …" if first + 2 * half < len(text) else ""
    return in_quotes(f"{head}{text[first : first + 2 * half]}{tail}", 2 * SHOWN_CHARACTERS)


def _mended(text: str, refusal: Refusal, read: Callable[[str], object]) -> str | None:
    for _ in range(MOST_SLIPS):
        if refusal.meant is None:
            return None
        text = _with(text, refusal.start, refusal.stop, refusal.meant)
        try:
            read(text)
        except Refusal as next_refusal:
            refusal = next_refusal
        else:
            return text
    return None


def _with(text: str, start: int, stop: int, meant: str) -> str:
    """The text with a part replaced; words are kept apart by a space."""
    head, tail = text[:start], text[stop:]
    left = " " if _is_word(head[-1:]) and _is_word(meant[:1]) else ""
    right = " " if _is_word(meant[-1:]) and _is_word(tail[:1]) else ""
    return head + left + meant + right + tail


def _is_word(character: str) -> bool:
    return character.isalnum() or (character in ('"', "_", ".", "`") and character != "")
