"""What the list under a cell editor offers, and what a pick makes of the text.

A list is one of two: of whole texts, where a pick takes the place of the text (bool, assets, outputs), or of values to tick, where
a text names several (enum, text, tags) and the word at the caret is completed. Row None is Any; in the test row no fact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from contextdb.cells.conditions import Condition
from contextdb.cells.words import says_any

from .completion import (
    Tick,
    Vocabulary,
    Word,
    Words,
    alone,
    completed,
    signed,
    take_apart,
    tick_of,
    toggled,
    vocabulary,
)

Row = str | None


@dataclass(frozen=True)
class Offer:
    """What a list shows."""

    rows: Sequence[Row] = ()
    word: Word | None = None
    """The word that a pick completes; None: a pick ticks a value, or takes the place of the text."""

    @property
    def n_values(self) -> int:
        """How many rows are values."""
        return len(self.rows) - (bool(self.rows) and None in (self.rows[0], self.rows[-1]))


class Chooser:
    """The list of one column. `kind` and `known` are those of the editor."""

    def __init__(self, condition: Condition | None, kind: str, known: Sequence[str], is_fact: bool) -> None:
        self.condition = condition
        self.kind = kind
        self.is_fact = is_fact
        self._known = known
        self._type = condition.domain.type if condition is not None else None
        self.is_truth = kind == "enabled" or (self._type is not None and self._type.is_truth)
        self.has_ticks = self._type is not None and self._type.is_swapped

    @cached_property
    def values(self) -> Vocabulary:
        """All values there are to choose from."""
        if self.is_truth:
            return Vocabulary(("True", "False"), True)
        if self.condition is None:
            return Vocabulary(tuple(text for text in self._known if text.strip()) if self.kind in ("asset", "output") else ())
        if self.condition.domain.type.is_numeric:
            return Vocabulary(())
        return vocabulary(self.condition.domain, self._known)

    @property
    def has_list(self) -> bool:
        """Whether there is anything to choose."""
        return bool(self.values.values)

    @property
    def any_text(self) -> str:
        """What picking row None writes."""
        return "" if self.is_fact else "Any"

    def offer(self, text: str, caret: int, is_open: bool) -> Offer:
        """The rows for a text: all of them where the list was opened, else what the word at the caret may become."""
        if not self.has_list:
            return Offer()
        if not self.has_ticks:
            return Offer(self._whole(text, is_open))
        words = self.words(text)
        word = words.at(caret)
        taken = {w.name for w in words.words if w is not word}
        if word is not None and word.name and not self._is_complete(word):
            stem = take_apart(text[word.start : caret], self.has_signs).words
            return Offer(self.values.matching(stem[0].name if stem else "", taken), word)
        if is_open:
            return Offer([None, *self.values.values])
        if word is not None and (longer := self.values.matching(word.name, {*taken, word.name})):
            return Offer(longer, word)
        return Offer([v for v in self.values.values if v not in taken and (word is None or v != word.name)])

    def _whole(self, text: str, is_open: bool) -> Sequence[Row]:
        if self.condition is not None:
            return [*self.values.values, None]
        if is_open or self.kind == "enabled":
            return self.values.values
        return self.values.matching(text.strip(), (text,)) if text.strip() else ()

    def words(self, text: str) -> Words:
        return take_apart(
            text, self.has_signs, self.values.known if self.is_fact and self._type is not None and self._type.needs_values else ()
        )

    @property
    def has_signs(self) -> bool:
        """Whether words have a sign before them."""
        return self._type is not None and self._type.is_tags

    def _is_complete(self, word: Word) -> bool:
        return word.name in self.values.known and (bool(word.sign) or not self._wants_signs(word))

    def _wants_signs(self, word: Word) -> bool:
        return self.has_signs and not self.is_fact

    def _ticks_signs(self, text: str) -> bool:
        """Whether a tick has three states: cells of tags, and facts that are written like them."""
        words = self.words(text)
        return self.has_signs and (not self.is_fact or words.is_signed or words.n_negations > 0)

    def ticks(self, text: str) -> Callable[[Row], Tick]:
        """What the text says of each row."""
        if not self.has_ticks:
            return lambda row: "on" if self.same(text, row) else "off"
        words = self.words(text)
        any_tick: Tick = "on" if not words.words and not words.is_negated else "off"
        return lambda row: any_tick if row is None else tick_of(words, row)

    def same(self, text: str, row: Row) -> bool:
        """Whether a text is what picking a row writes; for a bool its first letters are enough."""
        stripped = text.strip()
        if not self.is_truth:
            return stripped == (row or "").strip()
        written = self.any_text if row is None else row
        return written.casefold().startswith(stripped.casefold()) if stripped else row is None

    def toggle(self, text: str, row: Row, sign: str = "") -> str:
        """The text with a row ticked or unticked, or given a sign."""
        if row is None:
            return self.any_text
        if sign:
            return signed(self.words(text), row, sign)
        changed = toggled(self.words(text), row, self._ticks_signs(text))
        return self.any_text if changed == "Any" else changed

    def pick(self, text: str, row: Row, word: Word | None) -> tuple[str, int]:
        """The text with a row chosen, and where the caret is then."""
        if word is not None and row is not None:
            return completed(self.words(text), word, row, "+" if self._wants_signs(word) else "")
        if row is None:
            changed = self.any_text
        elif self.has_ticks:
            changed = alone(self.words(text), row, "+" if self._ticks_signs(text) else "")
        else:
            changed = row
        return changed, len(changed)

    def typed(self, text: str, typed: str) -> tuple[str, int]:
        """The text when something is typed into the open list, where it begins another word; and where the caret is then."""
        if not self.has_ticks or says_any(text):
            return typed, len(typed)
        tail = self.words(text).tail
        begun = f"{text[: text.rindex('~')].rstrip() if tail else text.rstrip()} {typed}".lstrip()
        return f"{begun} {tail}".rstrip(), len(begun)
