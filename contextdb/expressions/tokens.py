"""The words of an expression, each with its place.

number   3  0.5  .5  1e-3
text     "CB" or 'CB'; a quote inside is doubled
name     speed  Defender.DepthChart; any other name is in backquotes: `Asset Name`
sign     + - * / // % ** == != < <= > >= ( ) [ ] ,
end      after the last character
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from contextdb.errors import SHOWN_CHARACTERS, Fault, SchemaError, in_quotes

MOST_CHARACTERS = 4000
"""A longer expression is refused: nobody could read it, and the work on it stays bounded."""

RESERVED = frozenset(("and", "or", "not", "in", "like", "if", "else", "True", "False"))
"""Words of the language; a condition of such a name is in backquotes."""

TokenKind = Literal["number", "text", "name", "sign", "end"]

_SPACE = re.compile(r"\s*")
_NUMBER = re.compile(r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_NAME = re.compile(r"[^\W\d]\w*(?:\.\w+)*")
_QUOTED = re.compile(r'"(?:[^"]|"")*"|' r"'(?:[^']|'')*'|" r"`(?:[^`]|``)*`")
_SIGN = re.compile(r"\*\*|//|==(?!=)|!=(?!=)|<=(?![>=])|>=(?!=)|<(?!>)|[-+*/%>(),\[\]]")
_SLIP = re.compile(r"===|!==|&&|\|\||<>|<=>|=>|=<|:=|\.\.+|.", re.DOTALL)

_MEANT = {
    "=": "==", "===": "==", "!==": "!=", "<>": "!=", "≠": "!=", "=>": ">=", "≥": ">=", "=<": "<=", "≤": "<=", "&&": "and",
    "&": "and", "||": "or", "|": "or", "!": "not ", "~": "not ", "¬": "not ", "∧": "and", "\u2228": "or", "∈": "in", "^": "**",
    "²": "**2", "³": "**3", "×": "*", "·": "*", "÷": "/", "−": "-", "–": "-", "“": '"', "”": '"', "„": '"', "\u2018": "'", "’": "'",
    "{": "(", "}": ")", "°": "", ";": "", "$": "", "@": "",
}  # fmt: skip
_WHY = {
    "=": '"=" would set a value, and nothing is set here',
    ":=": '":=" would set a value, and nothing is set here',
    "?": '"?" is not an operator',
    ":": '":" is not an operator',
    ".": "a dot is allowed only inside the name of a condition",
    "#": "there are no comments inside an expression",
}
_ACCEPTED = {
    "?": "A if CONDITION else B",
    ":": "A if CONDITION else B",
    "..": 'an interval as a cell, such as speed in "0..5"',
    ".": "a name such as Defender.DepthChart",
}


@dataclass(frozen=True, slots=True)
class Token:
    """One word: `text` as it is written, `value` what it refers to (a name without backquotes, a text without quotes)."""

    kind: TokenKind
    text: str
    start: int
    value: str = ""

    @property
    def stop(self) -> int:
        """Where the next character stands."""
        return self.start + len(self.text)

    @property
    def is_bare(self) -> bool:
        """Whether it is a name without backquotes, which may be a word of the language."""
        return self.kind == "name" and self.text[0] != "`"


def tokens_of(text: str) -> list[Token]:
    """Take an expression apart; the last token is the end. Raises Refusal where the text is too long, or a character has no place
    in an expression."""
    if len(text) > MOST_CHARACTERS:
        raise Refusal(0, len(text), f"the expression has {len(text):,} characters", f"at most {MOST_CHARACTERS:,}")
    tokens: list[Token] = []
    at = _next(text, 0)
    while at < len(text):
        token = _token(text, at)
        tokens.append(token)
        at = _next(text, token.stop)
    return [*tokens, Token("end", "", len(text.rstrip()))]


def _next(text: str, at: int) -> int:
    space = _SPACE.match(text, at)
    return space.end() if space else at


def _token(text: str, at: int) -> Token:
    if number := _NUMBER.match(text, at):
        return _number(text, number)
    if name := _NAME.match(text, at):
        return Token("name", name[0], at, name[0])
    if quoted := _QUOTED.match(text, at):
        mark, body = quoted[0][0], quoted[0][1:-1]
        value = body.replace(mark * 2, mark)
        return Token("name" if mark == "`" else "text", quoted[0], at, value)
    if sign := _SIGN.match(text, at):
        return Token("sign", sign[0], at, sign[0])
    raise _slip(text, at)


def _number(text: str, number: re.Match[str]) -> Token:
    after = text[number.end() : number.end() + 1]
    if after == "." or after == "_" or after.isalnum():
        rest = re.compile(r"[\w.]*").match(text, number.end())
        stop = rest.end() if rest else number.end()
        word = text[number.start() : stop]
        plain = word.replace("_", "")
        meant = plain if plain != word and _NUMBER.fullmatch(plain) else None
        accepted = _ACCEPTED[".."] if ".." in word else "a number such as 3, 0.5 or 1e-3"
        raise Refusal(number.start(), stop, f"{in_quotes(word)} is not a number", accepted, meant)
    return Token("number", number[0], number.start(), number[0])


def _slip(text: str, at: int) -> Refusal:
    match = _SLIP.match(text, at)
    sign = match[0] if match else text[at]
    if sign in ('"', "'", "`"):
        return Refusal(
            at, len(text), f"the quote {sign} is not closed", "a text in quotes; a quote inside is doubled", text[at:] + sign
        )
    why = _WHY.get(sign, f"{in_quotes(sign)} is not a sign of an expression")
    meant = _MEANT.get(sign)
    accepted = _ACCEPTED.get(sign[:2], "" if meant else "+ - * / // % ** == != < <= > >= and or not in like if else")
    return Refusal(at, at + len(sign), why, accepted, meant)


def written_name(name: str) -> str:
    """The name of a condition as an expression has it: bare where it can be, else in backquotes."""
    is_bare = bool(_NAME.fullmatch(name)) and name not in RESERVED
    return name if is_bare else "`" + name.replace("`", "``") + "`"


def written_text(value: str) -> str:
    return '"' + value.replace('"', '""') + '"'


# ---- what is wrong with an expression: the characters it is about, why, and the whole text as it was probably meant


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


# ---- the names of facts in the text of an expression, without reading what it says of them


def names_in(text: str) -> tuple[str, ...]:
    """The names of facts in a text, in the order of their first mention; none in one that cannot be taken apart."""
    return tuple(dict.fromkeys(token.value for token in _names(text)))


def unknown_in(text: str, known: Container[str]) -> tuple[str, int] | None:
    """The first name of a fact that is not known, and the character from 0 where it is."""
    return next(((token.value, token.start) for token in _names(text) if token.value not in known), None)


def with_names(text: str, new_names: Mapping[str, str]) -> str:
    """The text with facts under other names; every other character stays. One that cannot be taken apart stays as it is."""
    for token in reversed(list(_names(text))):
        if token.value in new_names:
            text = text[: token.start] + written_name(new_names[token.value]) + text[token.stop :]
    return text


def _names(text: str) -> Iterator[Token]:
    try:
        tokens = tokens_of(text)
    except Refusal:
        return
    for token, after in pairwise(tokens):
        if token.kind == "name" and not (token.is_bare and (token.text in RESERVED or after.text == "(")):
            yield token
