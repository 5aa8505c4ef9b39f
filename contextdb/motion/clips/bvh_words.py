"""The words of a BVH file one after another, with their line, and how to refuse one.

Line ends may be LF, CRLF, CR or a mixture; words stand apart by any white space, braces also by none.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NoReturn

from contextdb.errors import ClipError, Fault, Place, in_quotes, nearest

WORD = re.compile(r"[{}]|[^\s{}]+")
REST = re.compile(r"[^\n{}]*")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class Words:
    """A place in a BVH text that moves on word by word."""

    def __init__(self, text: str, file: str | None = None) -> None:
        self.text = text.replace("\r\n", "\n").replace("\r", "\n")
        self.file = file
        self.position = 0
        self.line = 1
        """The line of the last word taken, from 1."""

    def take(self) -> str:
        """The next word, or "" at the end of the text."""
        match = WORD.search(self.text, self.position)
        self.move(match.start() if match else len(self.text))
        if match is None:
            return ""
        self.position = match.end()
        return match.group()

    def take_rest(self) -> str:
        """What follows on this line, up to a brace: a name may hold spaces."""
        match = REST.match(self.text, self.position)
        assert match is not None, "the expression matches the empty text"
        self.position = match.end()
        return match.group().strip()

    def move(self, position: int) -> None:
        """Go forward to a position in the text, and count the lines on the way."""
        self.line += self.text.count("\n", self.position, position)
        self.position = position

    def expect(self, wanted: str, accepted: str | None = None) -> None:
        """Take a word that must be `wanted`, in any case."""
        word = self.take()
        if word.casefold() != wanted.casefold():
            self.fail(word, accepted or in_quotes(wanted), [wanted])

    def number(self, what: str) -> float:
        """Take a word that must be a finite number."""
        word = self.take()
        fault = number_fault(word)
        if fault is not None:
            self.refuse(f"{what} is {quoted(word)}.", "a finite number", fault)
        return float(word)

    def fail(self, word: str, accepted: str, known: Sequence[str] = ()) -> NoReturn:
        """Refuse a word where others are accepted; the nearest of `known` is offered."""
        near = nearest(word, known) if word else None
        self.refuse(f"found {quoted(word)}.", accepted, in_quotes(near) if near else "")

    def refuse(self, problem: str, accepted: str = "", mend: str = "") -> NoReturn:
        """Raise a ClipError at the line of the last word."""
        raise ClipError(Fault(problem, accepted, mend, Place(self.file, self.line)))


def quoted(word: str) -> str:
    """A word in quotes, or that the file ended."""
    return in_quotes(word) if word else "the end of the file"


def number_fault(word: str) -> str | None:
    """None when the word is a finite number; otherwise the number that was likely meant, quoted, or "" when there is none near."""
    if NUMBER.fullmatch(word):
        return None if math.isfinite(float(word)) else ""
    meant = word.strip(",;").replace(",", ".").replace("−", "-").replace("_", "")
    return in_quotes(meant) if NUMBER.fullmatch(meant) else ""
