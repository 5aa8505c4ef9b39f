"""Markup on frames from a side table: which spans of which assets bear which tags.

    asset,tag,from,to,value
    jog_stop_left,DoNotChoose,1.2,,
    jog_*,Move.Jog,,,
    vault,NextNaturalOnly,0.2,1.4,0.15

Plain CSV. Columns in any order; `value` may be left out. Times are seconds since the start of the clip, both ends within; an empty
`from` is the start, an empty `to` the end. `*` in an asset matches any text. A tag is a reserved one, known in any case, or a
plain one of the project's own, with dots for hierarchy. A span is data; `marking.marks_of` turns spans
into frames. Only `load` touches the disk.

Source: the tags DoNotChoose, NextNaturalOnly and root motion weight of EA's talk; ignore tag, soft categories, match range and warp
range of Remedy's; cost modifiers of Unreal's pose search.
"""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path

from contextdb import disk
from contextdb.cells.arguments import require_many, require_path, require_text
from contextdb.errors import Fault, MotionError, Place, in_quotes, mend_for, plural
from contextdb.motion.clips.bvh_words import number_fault
from contextdb.motion.clips.feet import ContactMark, ContactMarks
from contextdb.motion.markup import file as markup_file
from contextdb.motion.markup.file import Row
from contextdb.motion.markup.reserved import CONTACTS, VALUE_RULES, ReservedTag, reserved_of
from contextdb.motion.markup.span_faults import (
    SECONDS,
    TOLERANCE_S,
    WILDCARD,
    Span,
    conflicts,
    faults_alone,
    faults_together,
    fits,
    listed,
)

MOST_FAULTS = 100
"""A file's first faults are reported one by one, the rest counted."""
MOST_MENDS = 20
"""For so many unknown assets the nearest name is looked for; with more, the markup is that of another project."""


@dataclass(frozen=True)
class Markup:
    """The markup of some assets: spans in the order in which they were written.

    Attributes
    ----------
    spans : tuple of Span
    file : str or None
        Where they are, for messages.

    Raises
    ------
    MotionError
        Spans that are invalid, alone or together; with every fault.
    """

    spans: tuple[Span, ...] = ()
    file: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "spans", tuple(require_many(self.spans, "spans", "a list of Span")))
        if not all(isinstance(span, Span) for span in self.spans):
            raise MotionError(Fault("the spans are not a list of spans.", "a Span each"))
        _refuse(_span_faults(self.spans, self.file, {}))

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Markup:
        """Read a markup file. Raises MotionError with every fault of the file: file, line, column, what was read, what is accepted
        and the nearest mend; FileError where the file is missing, or cannot be read."""
        file = str(require_path(path))
        return cls.parse(markup_file.text_of(disk.read_bytes(Path(path)), file), file)

    @classmethod
    def parse(cls, text: str, file: str | None = None) -> Markup:
        """The markup of a text; `file` is its name in messages. A header alone is no markup, and no fault."""
        rows = markup_file.rows_of(require_text(text, "text"), file)
        read = [_span_of(row) for row in rows.rows]
        spans = tuple(span for span, _ in read)
        by_span = {i: wrong for i, (_, wrong) in enumerate(read) if wrong}
        faults = [*rows.faults, *_span_faults(spans, file, by_span)]
        _refuse(sorted(faults, key=lambda fault: fault.place.line or 0))
        return cls(spans, file)

    @cached_property
    def tags(self) -> tuple[str, ...]:
        """All plain tags, sorted: the vocabulary that the databases of this markup share."""
        return tuple(sorted({span.tag for span in self.spans if not reserved_of(span.tag)}))

    def spans_of(self, asset: str) -> tuple[Span, ...]:
        """The spans that hold for an asset, by its name or by a pattern, in order."""
        return tuple(self.spans[i] for i in self._indices_of(asset))

    def is_looping(self, asset: str) -> bool:
        """Whether an asset continues at its start when it ends."""
        return any(reserved_of(span.tag) is ReservedTag.LOOPING for span in self.spans_of(asset))

    def contacts_of(self, asset: str) -> ContactMarks:
        """The marks of both feet of an asset, left first; None of a foot without. Where some name the asset, those with a pattern
        do not count."""
        return _contacts(self.spans_of(asset), CONTACTS[0]), _contacts(self.spans_of(asset), CONTACTS[1])

    def conflicts_of(self, asset: str) -> list[Fault]:
        """Where patterns that all fit an asset say different things of one frame, so that none can be followed."""
        indices = [i for i in self._indices_of(asset) if self.spans[i].is_pattern]
        if len({self.spans[i].asset for i in indices}) < 2:
            return []
        faults = conflicts(self.spans, indices)
        return [
            Fault(f"for the asset {in_quotes(asset)}: {fault.found}", fault.accepted, fault.mend, self._place(i, column))
            for i, column, fault in faults
        ]

    def faults_for(self, assets: Collection[str], durations_s: Mapping[str, float], *, rate: float | None = None) -> list[Fault]:
        """What in the markup does nothing, or contradicts itself, with the assets there are.

        Parameters
        ----------
        assets : collection of str
            The assets of all databases.
        durations_s : mapping of str to float
            Seconds from the first frame of an asset to its last. Assets that are absent are not measured.
        rate : float, optional
            Frames a second. With it, spans that fall between two frames are reported too.

        Returns
        -------
        list of Fault
            Names and patterns that no asset fits, spans that hold no frame, and contradicting patterns, in the order of the file.
        """
        known = dict.fromkeys(assets)
        fitting = {text: _fitting(text, known) for text in self._by_text}
        lost = [text for text, matches in fitting.items() if not matches]
        unknown = [self._unknown(text, known, known if at < MOST_MENDS else ()) for at, text in enumerate(lost)]
        idle = [
            fault
            for i, span in enumerate(self.spans)
            if (fault := self._idle(i, [durations_s[asset] for asset in fitting[span.asset] if asset in durations_s], rate))
        ]
        clashes: dict[Place, Fault] = {}
        for fault in (fault for asset in known for fault in self.conflicts_of(asset)):
            clashes.setdefault(fault.place, fault)
        return sorted([*unknown, *idle, *clashes.values()], key=lambda fault: fault.place.line or fault.place.row or 0)

    @cached_property
    def _by_text(self) -> dict[str, list[int]]:
        """The spans of each name and pattern."""
        assets_by_text = defaultdict[str, list[int]](list)
        for i, span in enumerate(self.spans):
            assets_by_text[span.asset].append(i)
        return dict(assets_by_text)

    @cached_property
    def _patterns(self) -> tuple[str, ...]:
        return tuple(text for text, indices in self._by_text.items() if self.spans[indices[0]].is_pattern)

    def _indices_of(self, asset: str) -> list[int]:
        texts = {asset, *(pattern for pattern in self._patterns if fits(pattern, asset))}
        return sorted(i for text in texts for i in self._by_text.get(text, ()))

    def _place(self, i: int, column: str) -> Place:
        return _place(self.spans, i, column, self.file)

    def _unknown(self, text: str, assets: Collection[str], near_ones: Collection[str]) -> Fault:
        """The fault of a name or pattern that no asset fits, at the first of its spans; the nearest of some names is its mend."""
        indices = self._by_text[text]
        lines = [self.spans[i].line for i in indices[1:]]
        more = f" Nor on lines {listed([line for line in lines if line])}." if any(lines) else ""
        place = self._place(indices[0], "asset")
        accepted = f"one of {plural(len(assets), 'asset')}" if assets else "none: there are no assets"
        if self.spans[indices[0]].is_pattern:
            return Fault(f"no asset fits the pattern {in_quotes(text)}.{more}", accepted, place=place)
        return Fault(f"no database holds the asset {in_quotes(text)}.{more}", accepted, mend_for(text, near_ones), place)

    def _idle(self, i: int, durations_s: Sequence[float], rate: float | None) -> Fault | None:
        """The fault of a span that holds no frame of any clip it is meant for; None when a clip's length is not known."""
        span = self.spans[i]
        if not durations_s:
            return None
        longest_s = max(durations_s)
        if rate is not None and span.to_s == math.inf and longest_s < span.from_s < longest_s + 1.0 / rate:
            return None  # a clip with more frames a second goes on behind its last frame at this rate
        if span.from_s > longest_s + TOLERANCE_S:
            which = "the longest clip that fits" if span.is_pattern else "the clip"
            problem = f"the span starts at {span.from_s:g} s, behind the end of {which}."
            return Fault(problem, f"times up to {longest_s:g} s", place=self._place(i, "from"))
        if rate is None or any(_holds_frame(span, duration_s, rate) for duration_s in durations_s):
            return None
        problem = f"the span from {span.from_s:g} to {span.to_s:g} is between two frames and contains none."
        near = round(span.from_s * rate) / rate
        return Fault(problem, f"times with a frame between them, at {rate:g} frames a second", f"{near:g}", self._place(i, "from"))


def _contacts(spans: Sequence[Span], tag: ReservedTag) -> ContactMark | None:
    marks = [span for span in spans if span.tag == tag]
    strongest = [span for span in marks if not span.is_pattern] or marks
    return tuple((span.from_s, span.to_s, span.value != 0.0) for span in strongest) or None


def _fitting(text: str, assets: Collection[str]) -> list[str]:
    if WILDCARD not in text:
        return [text] if text in assets else []
    return [asset for asset in assets if fits(text, asset)]


def _holds_frame(span: Span, duration_s: float, rate: float) -> bool:
    first = max(0, math.ceil((span.from_s - TOLERANCE_S) * rate))
    return first / rate <= min(span.to_s, duration_s) + TOLERANCE_S


def _refuse(faults: Sequence[Fault]) -> None:
    if len(faults) > MOST_FAULTS:
        rest = Fault(f"there are {len(faults) - MOST_FAULTS:,} more faults.", place=Place(faults[0].place.file))
        raise MotionError(*faults[:MOST_FAULTS], rest)
    if faults:
        raise MotionError(*faults)


# ---- the spans of a file


def _span_of(row: Row) -> tuple[Span, list[tuple[str, Fault]]]:
    """The span of a row, and the faults of its numbers by column; a number that cannot be read counts as left out."""
    wrong: list[tuple[str, Fault]] = []
    from_s, to_s, value = (_number(row, column, wrong) for column in ("from", "to", "value"))
    start, stop = from_s or 0.0, math.inf if to_s is None else to_s
    return Span(row.fields["asset"], row.fields["tag"], start, stop, value, row.line), wrong


def _number(row: Row, column: str, wrong: list[tuple[str, Fault]]) -> float | None:
    text = row.fields.get(column, "")
    if not text:
        return None
    if number_fault(text) is None:
        return float(text)
    rule = VALUE_RULES.get(tag) if column == "value" and (tag := reserved_of(row.fields["tag"])) else None
    accepted = (rule.accepted if rule else "no value") if column == "value" else f"{SECONDS}; empty for the clip's {_END[column]}"
    wrong.append((column, Fault(f"{in_quotes(text)} is not a finite number.", accepted, _meant_number(text))))
    return None


_END = {"from": "start", "to": "end"}
_UNIT = re.compile(r"\s*(s|secs?|seconds?)$", re.IGNORECASE)


def _meant_number(text: str) -> str:
    """The number that was likely meant, quoted: with a point for a comma, or without its unit; "" when there is none near."""
    bare = _UNIT.sub("", text)
    mend = number_fault(bare)
    return in_quotes(bare) if mend is None else mend


def _span_faults(spans: Sequence[Span], file: str | None, read: Mapping[int, list[tuple[str, Fault]]]) -> list[Fault]:
    """The faults of all spans, placed; `read` are those of numbers that could not be read, by span."""
    placed: list[Fault] = []
    good: list[int] = []
    for i, span in enumerate(spans):
        faults = list(read.get(i, ()))
        columns = {column for column, _ in faults}
        faults += [(column, fault) for column, fault in faults_alone(span) if column not in columns]
        placed += [fault.at(_place(spans, i, column, file)) for column, fault in faults]
        if not faults:
            good.append(i)
    return placed + list(_placed_together(spans, good, file))


def _placed_together(spans: Sequence[Span], good: Sequence[int], file: str | None) -> Iterator[Fault]:
    for i, column, fault in faults_together(spans, good):
        yield fault.at(_place(spans, i, column, file))


def _place(spans: Sequence[Span], i: int, column: str, file: str | None) -> Place:
    line = spans[i].line
    return Place(file, line, column, i if line is None else None)
