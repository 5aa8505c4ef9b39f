"""What is wrong with spans of markup: each alone, and those of one asset together."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from contextdb.cells.arguments import as_number
from contextdb.errors import Fault, in_quotes
from contextdb.motion.markup.reserved import MOST_SECONDS, VALUE_RULES, ReservedTag, name_fault, reserved_of

SpanFault = tuple[int, str, Fault]
"""Which span, in which column, is at fault, and how."""

SECONDS = "seconds from the start of the clip, such as 0.25"
_WARPS = (ReservedTag.WARP_POSITION, ReservedTag.WARP_ROTATION)


# ---- one span alone


def faults_alone(span: Span) -> Iterator[tuple[str, Fault]]:
    """What is wrong with one span, by column."""
    if not isinstance(span.asset, str) or not span.asset:
        yield "asset", Fault("there is no asset.", "the name of an asset, or a pattern such as jog_*")
    if not isinstance(span.tag, str):
        yield "tag", Fault(f"the tag is {span.tag!r}.", "the name of a tag")
        return
    fault = name_fault(span.tag)
    if fault:
        yield "tag", fault
        return
    yield from _time_faults(span)
    yield from _value_faults(span)


def _time_faults(span: Span) -> Iterator[tuple[str, Fault]]:
    is_whole = span.from_s == 0.0 and span.to_s == math.inf
    if span.tag == ReservedTag.LOOPING and not is_whole:
        column = "from" if span.from_s != 0.0 else "to"
        yield column, Fault(f"{span.tag} holds for the whole asset.", "from and to empty", "to leave both empty")
        return
    wrong = [("from", span.from_s)] if not _is_time(span.from_s) else []
    wrong += [("to", span.to_s)] if not _is_time(span.to_s) and span.to_s != math.inf else []
    for column, time_s in wrong:
        yield column, Fault(f"{_quoted(time_s)} is not a time in a clip.", SECONDS)
    if not wrong and span.from_s > span.to_s:
        problem = f"the span ends before it starts: from {span.from_s:g} to {span.to_s:g}."
        yield "from", Fault(problem, "from <= to", f"from {span.to_s:g} to {span.from_s:g}")


def _is_time(value: object) -> bool:
    number = as_number(value)
    return number is not None and 0.0 <= number <= MOST_SECONDS


def _value_faults(span: Span) -> Iterator[tuple[str, Fault]]:
    reserved = reserved_of(span.tag)
    rule = VALUE_RULES.get(reserved) if reserved else None
    if rule is None:
        if span.value is not None:
            kind = "reserved" if reserved else "plain"
            problem = f"the {kind} tag {in_quotes(span.tag)} takes no value, but this is {_quoted(span.value)}."
            yield "value", Fault(problem, "no value", "to leave it empty")
    elif span.value is None:
        if rule.is_required:
            yield "value", Fault(f"{span.tag} has no value.", rule.accepted)
    else:
        number = as_number(span.value)
        if number is None or not rule.least <= number <= rule.most:
            yield "value", Fault(f"{_quoted(span.value)} is out of range for {span.tag}.", rule.accepted)
        elif reserved is ReservedTag.NEXT_NATURAL_ONLY:
            yield from _entry_faults(span, number)


def _entry_faults(span: Span, entry_s: float) -> Iterator[tuple[str, Fault]]:
    if _is_time(span.from_s) and _is_time(span.to_s) and span.from_s <= span.to_s < span.from_s + entry_s - TOLERANCE_S:
        length = f"{span.to_s - span.from_s:g}"
        problem = f"the entry zone of {entry_s:g} s is longer than its span, {length} s."
        yield "value", Fault(problem, "at most the length of the span", in_quotes(length))


def _quoted(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else repr(value)


# ---- several together


def faults_together(spans: Sequence[Span], indices: Iterable[int]) -> Iterator[SpanFault]:
    """What is wrong between those of the spans that are right in themselves."""
    good = list(indices)
    twice = list(_duplicates(spans, good))
    yield from twice
    yield from _case_faults(spans, good)
    repeated = {i for i, _, _ in twice}
    by_asset = defaultdict[str, list[int]](list)
    for i in good:
        if i not in repeated:
            by_asset[spans[i].asset].append(i)
    for indices_of_one in by_asset.values():
        yield from conflicts(spans, indices_of_one)


def _duplicates(spans: Sequence[Span], indices: Iterable[int]) -> Iterator[SpanFault]:
    first = dict[Span, int]()
    for i in indices:
        j = first.setdefault(spans[i], i)
        if j != i:
            yield i, "tag", Fault(f"this span is the same as {named(spans, j)}.", "each span once", "to delete one of them")


def _case_faults(spans: Sequence[Span], indices: Iterable[int]) -> Iterator[SpanFault]:
    """Plain tags that differ from an earlier one in case only: to a search they would be two."""
    first = dict[str, int]()
    reported = set[str]()
    for i in indices:
        tag = spans[i].tag
        j = first.setdefault(tag.casefold(), i)
        if spans[j].tag != tag and tag not in reported:
            reported.add(tag)
            problem = f"the tag {in_quotes(tag)} differs in case only from {in_quotes(spans[j].tag)} of {named(spans, j)}."
            yield i, "tag", Fault(problem, "one spelling of each tag", in_quotes(spans[j].tag))


def conflicts(spans: Sequence[Span], indices: Iterable[int]) -> Iterator[SpanFault]:
    """Spans that hold for one asset with the same right, and say different things of one frame, or of its one warp."""
    by_tag = defaultdict[str, list[int]](list)
    for i in indices:
        by_tag[spans[i].tag].append(i)
    for tag in _WARPS:
        for i in by_tag.get(tag, [])[1:]:
            problem = f"{named(spans, by_tag[tag][0])} gives {in_quotes(spans[i].asset)} a {tag} too."
            yield i, "tag", Fault(problem, f"one {tag} for an asset", "to delete one of them")
    yield from _weight_conflicts(spans, by_tag.get(ReservedTag.ROOT_MOTION_WEIGHT, []))


def _weight_conflicts(spans: Sequence[Span], indices: Iterable[int]) -> Iterator[SpanFault]:
    ordered = sorted(indices, key=lambda i: (spans[i].from_s, spans[i].to_s))
    for at, i in enumerate(ordered):
        for j in ordered[at + 1 :]:
            if spans[j].from_s > spans[i].to_s + TOLERANCE_S:
                break
            if spans[i].value != spans[j].value and not _touch(spans[i], spans[j]):
                low, high = sorted((i, j))
                problem = f"on some frames {named(spans, low)} says {spans[low].value:g} and this {spans[high].value:g}."
                yield high, "value", Fault(problem, "one weight for a frame", "to end one span where the other begins")


def _touch(first: Span, second: Span) -> bool:
    """Whether the first span ends as the second begins; the second then holds on the frame that they share."""
    is_before = first.from_s < second.from_s and first.to_s < second.to_s
    return is_before and first.to_s <= second.from_s + TOLERANCE_S


def named(spans: Sequence[Span], i: int) -> str:
    """A span as messages name it: by its line in the file, or by its place among the spans."""
    line = spans[i].line
    return f"span {i}" if line is None else f"line {line}"


def listed(numbers: Sequence[int]) -> str:
    """Numbers with runs of neighbours drawn together: "3-5, 9"."""
    runs = [[n for _, n in run] for _, run in groupby(enumerate(numbers), key=lambda pair: pair[1] - pair[0])]
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)


# ---- spans of markup: what is said of one asset, or of those whose name fits a pattern, from one time to another


TOLERANCE_S = 1e-6
"""A frame this near to an end of a span, in seconds, is within it: a third of a second need not be typed to the last digit."""

WILDCARD = "*"


@dataclass(frozen=True, slots=True)
class Span:
    """One row of markup.

    Attributes
    ----------
    asset : str
        The name of an asset, or a pattern: `*` matches any text, so `jog_*` holds for `jog_left`, and `*` for every asset.
    tag : str
        A reserved tag, in its own spelling, or a plain one.
    from_s, to_s : float
        Seconds since the start of the clip, both within; infinite `to_s`: up to the end.
    value : float or None
        What some reserved tags need.
    line : int or None
        Where it is in a file; spans that differ in this alone are equal.
    """

    asset: str
    tag: str
    from_s: float = 0.0
    to_s: float = math.inf
    value: float | None = None
    line: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        reserved = reserved_of(self.tag) if isinstance(self.tag, str) else None
        if reserved:
            object.__setattr__(self, "tag", str(reserved))

    @property
    def is_pattern(self) -> bool:
        """Whether `asset` is a pattern. A span that names its asset is stronger than one with a pattern."""
        return WILDCARD in self.asset


def fits(pattern: str, asset: str) -> bool:
    """Whether an asset has the name, or a name that fits the pattern. `*` alone has a meaning; case counts."""
    if WILDCARD not in pattern:
        return pattern == asset
    first, *middle, last = pattern.split(WILDCARD)
    at, stop = len(first), len(asset) - len(last)
    if stop < at or not asset.startswith(first) or not asset.endswith(last):
        return False
    for part in middle:
        position = asset.find(part, at, stop)
        if position < 0:
            return False
        at = position + len(part)
    return True
