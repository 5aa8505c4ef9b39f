"""The grammar of a cell: text to the set of values that a row accepts, and back.

    every kind    Any  -  (empty)          every value
                  not CELL                 what CELL does not hold, within the domain
                  CELL ~2.5                soft: a row that does not match is not excluded, it costs 2.5 more in a search
                  CELL ~2.5/10             of numbers: it costs 2.5 more for each 10 that the fact is away from CELL
    bool          True  False              t f yes no 1 0 in any case
    int, number   20, 9.99  20 ± 9.99      centre and tolerance, in double arithmetic
                  10..30  (10..30]  10..   closed, half open, without an end
                  5  =5  <5  <=5  >5  >=5
                  0..5 | 10..15            union
    angle         as number, in degrees on the circle: 170..-170 runs upwards through 180
    enum, text    CB FS "Half Back"        one of; text is an enum without declared values
    tags          +InAir -Stunned          has all the +, none of the -; Move covers Move.Run

`tests/cells.csv` holds the same as examples. Nothing here knows a file or a table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

from contextdb.cells import intervals
from contextdb.cells.domains import TAGS, Domain
from contextdb.cells.intervals import Spans
from contextdb.cells.mends import candidates
from contextdb.cells.sets import Accepted, Cell, NumberSet, TagSet, ValueSet, complement, covers
from contextdb.cells.words import NUMBER_TEXT, format_number, is_name, is_reserved, quoted, says_any, truth_of
from contextdb.errors import CellError, Fault, in_quotes, safe_text, some

_NUMBER = re.compile(NUMBER_TEXT)
_TOKEN = re.compile(r'([+-]?)(?:"((?:[^"]|"")*)"|([^\s"]+))(?=\s|$)\s*')
_NOT = re.compile(r"not(?=\s|$)\s*", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class _Patterns:
    """The shapes of number cells, for one spelling of numbers."""

    centre: re.Pattern[str]
    interval: re.Pattern[str]
    compare: re.Pattern[str]


@lru_cache
def _patterns(number: str, step: str) -> _Patterns:
    return _Patterns(
        re.compile(rf"({number})\s*(?:,|±|\+-)\s*({step})"),
        re.compile(rf"([\[(]?)\s*({number})?\s*\.\.\s*({number})?\s*([\])]?)"),
        re.compile(rf"(<=|>=|<|>|=)?\s*({number})"),
    )


def parse_cell(text: str, domain: Domain, wants_mend: bool = True) -> Cell:
    """Read a cell. Looking for a mend costs a thousand times the reading; a caller with many faults may leave it out. Raises
    CellError with what was found, what is accepted for the kind and, where one is near, a text that would be read."""
    try:
        return _read(text, domain)
    except CellError as error:
        if not wants_mend or error.faults[0].rule == "unreadable-penalty":
            raise
        raise CellError(replace(error.faults[0], mend=_mend(text, domain))) from None


def parse_tags(text: str) -> frozenset[str]:
    """A plain set of tags, as a fact is written: names with spaces between, odd ones in double quotes; "" is no tag at all."""
    return frozenset(sign + name for sign, name in _tokens(text.strip(), TAGS) if name)


def _mend(text: str, domain: Domain) -> str:
    """The nearest text that reads, quoted for a message, or nothing."""
    short = text[:1000].strip()
    return next((in_quotes(c) for c in candidates(short, domain) if c and c != short and reads(c, domain)), "")


def reads(text: str, domain: Domain) -> bool:
    """Whether a text is in the grammar."""
    try:
        _read(text, domain)
    except CellError:
        return False
    return True


def _read(text: str, domain: Domain) -> Cell:
    body, penalty, per = _split_penalty(text.strip(), domain)
    return Cell(_read_set(body, domain), penalty, per)


def _split_penalty(text: str, domain: Domain) -> tuple[str, float | None, float | None]:
    """The text before a penalty, the penalty, and the distance that it is for."""
    body, tilde, tail = text.rpartition("~")
    if not tilde or tail.count('"') % 2:
        return text, None, None
    first, slash, last = tail.strip().partition("/")
    penalty, per = _positive(first), _positive(last) if slash else 1.0
    if not 0.0 <= penalty < math.inf:
        raise _no_penalty(text, domain, f'the penalty after "~" must be a number from 0 up, not {in_quotes(tail.strip())}')
    if not 0.0 < per < math.inf:
        raise _no_penalty(text, domain, f'the distance after "/" must be a number above 0, not {in_quotes(last.strip())}')
    if slash and not domain.type.is_numeric:
        raise _no_penalty(text, domain, 'only numbers have a distance that a penalty can grow with, such as "~2.5/10"')
    return body.strip(), penalty, per if slash else None


def _positive(text: str) -> float:
    """A number; NaN for what is none."""
    number = _NUMBER.fullmatch(text.strip())
    return float(number[0]) if number else math.nan


def _no_penalty(text: str, domain: Domain, why: str) -> CellError:
    return CellError(replace(_unreadable(text, domain, why).faults[0], rule="unreadable-penalty"))


def _read_set(text: str, domain: Domain) -> Accepted | None:
    if not text:
        return None
    at, n_negations = 0, 0
    while negation := _NOT.match(text, at):
        at, n_negations = negation.end(), n_negations + 1
    if n_negations and at == len(text):
        raise _unreadable(text, domain, 'after "not" a value is missing')
    accepts = _read_plain_set(text[at:], domain)
    for _ in range(n_negations):
        accepts = complement(accepts, domain)
    return accepts


def _read_plain_set(text: str, domain: Domain) -> Accepted | None:
    if says_any(text):
        return None
    if domain.type.is_numeric:
        spans = [span for part in text.split("|") for span in _read_spans(part.strip(), text, domain)]
        joined = intervals.union(spans)
        return NumberSet(domain.type.fitted(joined), domain.type.is_circular)
    if domain.type.is_truth:
        value = truth_of(text)
        if value is None:
            raise _unreadable(text, domain)
        return ValueSet(frozenset((value,)))
    return _read_tags(text, domain) if domain.type.is_tags else _read_names(text, domain)


def _read_spans(part: str, text: str, domain: Domain) -> Spans:
    patterns = _patterns(domain.type.spelling.number, domain.type.spelling.step)
    if match := patterns.centre.fullmatch(part):
        return _centred(_number(match[1], text, domain), float(match[2]), text, domain)
    if match := patterns.interval.fullmatch(part):
        left, low, high, right = match.groups()
        if low is None and high is None:
            raise _unreadable(text, domain, '".." needs a number before or after it')
        if (left and left not in "[(") or (low is None and left == "[") or (high is None and right == "]"):
            raise _unreadable(text, domain, "a bracket is at a missing end")
        return _between(_end(low, text, domain), _end(high, text, domain), left == "(", right == ")", text, domain)
    if match := patterns.compare.fullmatch(part):
        return _compared(match[1] or "=", _number(match[2], text, domain), text, domain)
    raise _unreadable(text, domain)


def _end(end: str | None, text: str, domain: Domain) -> float | None:
    return None if end is None else _number(end, text, domain)


def _number(number: str, text: str, domain: Domain) -> float:
    try:
        value = domain.type.spelling.read(number)
    except ValueError as error:
        raise _unreadable(text, domain, str(error)) from None
    if math.isinf(value) and ("inf" not in number.casefold() or domain.type.is_circular):
        raise _unreadable(text, domain, f'"{safe_text(number)}" is too large for a number')
    return value + 0.0


def _centred(centre: float, tolerance: float, text: str, domain: Domain) -> Spans:
    if tolerance < 0.0 or math.isinf(centre) or math.isinf(tolerance):
        raise _unreadable(text, domain, "a centre is a finite number and a tolerance one from 0 up")
    low, high = centre - tolerance, centre + tolerance
    if not domain.type.is_circular:
        return ((low, high),)
    return (intervals.CIRCLE,) if tolerance >= 180.0 else intervals.arc(low, high)


def _between(low: float | None, high: float | None, is_low_open: bool, is_high_open: bool, text: str, domain: Domain) -> Spans:
    if domain.type.is_circular:
        return _angles_between(low, high, is_low_open, is_high_open, text, domain)
    if (is_low_open and low == math.inf) or (is_high_open and high == -math.inf):
        return ()
    first = -math.inf if low is None else intervals.above(low) if is_low_open else low
    last = math.inf if high is None else intervals.below(high) if is_high_open else high
    return ((first, last),)


def _angles_between(
    low: float | None, high: float | None, is_low_open: bool, is_high_open: bool, text: str, domain: Domain
) -> Spans:
    given = high if low is None else low if high is None else None
    if given is not None and not -180.0 <= given <= 180.0:
        raise _unreadable(text, domain, f"a missing end means -180 or 180, and {given:g} is outside; write both ends")
    is_low_open, is_high_open = is_low_open and low is not None, is_high_open and high is not None
    return intervals.arc(-180.0 if low is None else low, 180.0 if high is None else high, is_low_open, is_high_open)


def _compared(sign: str, value: float, text: str, domain: Domain) -> Spans:
    if sign == "=":
        return intervals.arc(value, value) if domain.type.is_circular else ((value, value),)
    is_open = sign in ("<", ">")
    low, high = (None, value) if sign[0] == "<" else (value, None)
    return _between(low, high, is_open, is_open, text, domain)


def _tokens(text: str, domain: Domain) -> Iterator[tuple[str, str]]:
    """Each word of an enum, text or tags cell, unquoted, with the sign before it."""
    at = 0
    while at < len(text):
        token = _TOKEN.match(text, at)
        if not token:
            raise _unreadable(text, domain, "a double quote is unpaired; inside quotes it is doubled")
        sign, in_quotes, bare = token.groups()
        if in_quotes is not None:
            yield sign, in_quotes.replace('""', '"')
        elif domain.type.is_tags:
            yield sign, _bare(bare, text, domain)
        else:
            yield "", _bare(sign + bare, text, domain)
        at = token.end()


def _bare(word: str, text: str, domain: Domain) -> str:
    if is_name(word):
        return word
    why = "reads like a number or a word of the grammar" if is_reserved(word) else "has characters that need quotes"
    raise _unreadable(text, domain, f'"{safe_text(word)}" {why}')


def _read_names(text: str, domain: Domain) -> ValueSet:
    names: list[bool | str] = []
    plain = None if '"' in text else (("", _bare(word, text, domain)) for word in text.split())
    for sign, name in plain or _tokens(text, domain):
        if sign:
            raise _unreadable(text, domain, f'"{sign}" comes before a quoted value')
        if domain.values is not None and name not in domain.known:
            raise _unknown_value(name, text, domain, domain.values)
        names.append(name)
    return ValueSet(frozenset(names))


def _read_tags(text: str, domain: Domain) -> TagSet:
    signed: dict[str, list[str]] = {"+": [], "-": []}
    for sign, tag in _tokens(text, domain):
        if not sign:
            raise _unreadable(text, domain, f'before the tag "{safe_text(tag)}" a + (has) or - (has not) is missing')
        if domain.values is not None and not covers(tag, domain.known):
            raise _unknown_value(tag, text, domain, domain.values)
        signed[sign].append(tag)
    return TagSet(frozenset(signed["+"]), frozenset(signed["-"]))


def _unknown_value(name: str, text: str, domain: Domain, known: tuple[str, ...]) -> CellError:
    what = "tag" if domain.type.is_tags else "value"
    return CellError(Fault(f"{in_quotes(name)} is not a declared {what}.", some(known), rule="unknown-value"))


def _unreadable(text: str, domain: Domain, why: str = "") -> CellError:
    reason = f": {why}." if why else "."
    problem = f"cannot read {in_quotes(text)} as {domain.type.noun}{reason}"
    return CellError(Fault(problem, domain.type.cells, rule="unreadable-cell"))


def format_cell(cell: Cell, domain: Domain) -> str:
    """The shortest common way to write a cell; reading it gives an equal cell."""
    body = "Any" if cell.accepts is None else _format_set(cell.accepts, domain)
    if cell.penalty is None:
        return body
    return f"{body} ~{format_number(cell.penalty)}{'' if cell.per is None else f'/{format_number(cell.per)}'}"


def _format_set(accepts: Accepted, domain: Domain) -> str:
    if isinstance(accepts, TagSet):
        return _format_tags(accepts)
    if accepts.is_empty:
        return "not Any"
    if isinstance(accepts, NumberSet):
        return _format_spans(accepts.spans, domain)
    if domain.type.is_truth:
        return "not not Any" if len(accepts.values) == 2 else str(next(iter(accepts.values)))
    order = domain.values if domain.values is not None else sorted(str(v) for v in accepts.values)
    names = " ".join(quoted(v) for v in order if v in accepts.values)
    return names if not accepts.is_complement else f"not {names}" if names else "not not Any"


def _format_tags(tags: TagSet) -> str:
    words = [f"+{quoted(t)}" for t in sorted(tags.needs)] + [f"-{quoted(t)}" for t in sorted(tags.bans)]
    if not words:
        return "not Any" if tags.is_complement else "not not Any"
    return f"not {' '.join(words)}" if tags.is_complement else " ".join(words)


def _format_spans(spans: Spans, domain: Domain) -> str:
    if not domain.type.is_circular:
        return " | ".join(_format_span(low, high, domain.type.spelling.write) for low, high in spans)
    if spans == (intervals.CIRCLE,):
        return "-180..180"
    rest = intervals.complement(spans, *intervals.CIRCLE)
    if len(spans) > 1 and len(rest) == 1 and rest[0][0] == rest[0][1]:
        return f"not {format_number(rest[0][0])}"
    first, last = spans[0], spans[-1]
    if len(spans) > 1 and first[0] == -180.0 and last[1] == intervals.CIRCLE[1]:
        spans = (*spans[1:-1], (last[0], _displayed_end(first[1])))
    return " | ".join(
        _format_span(_displayed_end(low) if low == high else low, _displayed_end(high) if low == high else high, format_number)
        for low, high in spans
    )


def _displayed_end(degrees: float) -> float:
    """Half a turn is shown as 180, not as the -180 that is stored."""
    return 180.0 if degrees == -180.0 else degrees


def _format_span(low: float, high: float, write: Callable[[float], str]) -> str:
    if low == high:
        return write(low)
    opened, closed = _is_rung_after(low, intervals.below), _is_rung_after(high, intervals.above)
    first = "" if low == -math.inf else write(intervals.below(low) if opened else low)
    last = "" if high == math.inf else write(intervals.above(high) if closed else high)
    if not first and not last:
        return "-inf..inf"
    left = "(" if opened else "[" if closed and first else ""
    right = ")" if closed else "]" if opened and last else ""
    return f"{left}{first}..{last}{right}"


def _is_rung_after(value: float, step: Callable[[float], float]) -> bool:
    """Whether a double is best written as the open end at its neighbour: 4.999999999999999 is just below 5."""
    near = step(value)
    return math.isfinite(value) and math.isfinite(near) and (near == 0.0 or len(repr(near)) + 4 <= len(repr(value)))
