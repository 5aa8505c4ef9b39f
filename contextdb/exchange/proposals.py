"""What type a column of another program has most likely, from its cells and its name, and why."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from contextdb.cells.domains import ANGLE, BOOL, DATE, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.grammar import parse_cell, reads
from contextdb.cells.kinds import KINDS
from contextdb.cells.numbers import doubtful
from contextdb.cells.sets import Cell, TagSet, ValueSet
from contextdb.cells.words import quoted, says_any
from contextdb.columns import TextColumn
from contextdb.errors import CellError, in_quotes, plural
from contextdb.exchange.everyday import as_truths, compared, with_any, without_unit
from contextdb.exchange.reading import DECIMAL_COMMA, ERRORS, listed, pair_in
from contextdb.files.toml_shapes import wrong_name
from contextdb.tables.condition_column import READABLE_SHARE

MOST_ENUM_VALUES = 40
"""A column with more different names than this is a text: nobody wants to keep such a list."""
FEW_ROWS = 10
"""Of so few rows nobody can tell whether their names are all there are."""
_ANGLE_NAME = re.compile(
    r"angle|direction|facing|heading|bearing|orientation|azimuth|yaw|rotation|degrees|°(?![CF])|(?:^|_)(?:dir|deg|rot)(?:_|$)",
    re.IGNORECASE,
)
_SHORT = re.compile(r"[^\s,;!?]+(?: +[^\s,;!?]+){0,3}")
_WHOLE = re.compile(r"\s*=?\s*[+-]?\d+\s*(?:\|\s*=?\s*[+-]?\d+\s*)*")
"""Whole numbers that a fact must be equal to, as only something that is counted is."""
_UNIT = re.compile(r"\(\s*[^\d\s()]{1,8}\s*\)|\[\s*[^\d\s\[\]]{1,8}\s*\]|%")
_MEASURE = re.compile(
    "accel|acceleration|angle|cm|deg|degrees|depth|dist|distance|duration|elapsed|fov|force|fraction|height|km|kmh|kph|length|mass|"
    "met(?:er|re)s?|mm|mph|ms|mps|percent|pitch|radius|ratio|roll|rotation|scale|sec|seconds|share|speed|time|velocity|weight|width|yaw",
    re.IGNORECASE,
)
_RANGE = re.compile(r"\s*([+-]?\d+(?:\.\d+)?)(\s*)(?:[-–—]|to|bis|à|hasta|até|tot|do)\2([+-]?\d+(?:\.\d+)?)\s*")
"""Two ends as people write them: "20 - 60", "20 to 60"; a cell of ours has ".." between them."""
_DEGREES = re.compile(r"(?<=\d)\s*°(?!\s*[CF])")
_NUMBER = r"[+-]?\d+(?:[.,]\d+)?"
_SURE = re.compile(rf"\s*(?:(?:[<>]=?|[≤≥])\s*{_NUMBER}|{_NUMBER}\s*(?:\.\.|[-–—]|to)\s*{_NUMBER})\s*")
"""A comparison or a range: a comma in one of its numbers can only be a decimal one."""
_BETWEEN_NAMES = re.compile(r"\s*[,;/|\n]\s*")
_AROUND = re.compile(r"^\s*±\s*(?=[\d.])")
_FRACTION = re.compile(r"\d\.\d|(?<!\.)\.\d|\de-?\d", re.IGNORECASE)


@dataclass(frozen=True)
class Proposal:
    """A type for a column: what `[conditions.NAME]` would say, and why. None: the cells are not a condition's."""

    declared: Mapping[str, object] | None
    why: str
    n_unreadable: int = 0
    """Rows whose cell cannot be read as this type."""
    cells: TextColumn | None = None
    """The cells that the texts become, where some are written differently: each text one name, or "20 - 60" as 20..60."""


@dataclass(frozen=True)
class _CountedTexts:
    """The texts of a column that say something, the commonest first, and how many rows hold each."""

    texts: Sequence[str]
    counts: Sequence[int]
    n_rows: int
    n_errors: int
    """Rows with an error of Excel, which say nothing of the type and can be read as none."""

    @classmethod
    def by(cls, column: TextColumn) -> _CountedTexts:
        counts = np.bincount(column.codes, minlength=len(column.texts)).tolist()
        counted = [(t, n) for t, n in zip(column.texts, counts, strict=True) if n and not says_any(t)]
        n_errors = sum(n for t, n in counted if t.strip() in ERRORS)
        counted = sorted((item for item in counted if item[0].strip() not in ERRORS), key=lambda item: -item[1])
        return cls([t for t, _ in counted], [n for _, n in counted], sum(n for _, n in counted), n_errors)

    def reads(self, domain: Domain) -> Iterator[tuple[bool, int]]:
        """Whether a domain reads each text, and how many rows hold it. No text is left out, however many there are."""
        rest = doubtful(self.texts, domain)  # of many number cells nearly all are surely read
        included = None if rest is None else frozenset(rest.tolist())
        for at, (text, n) in enumerate(zip(self.texts, self.counts, strict=True)):
            yield (included is not None and at not in included) or reads(text, domain), n

    def n_unread(self, domain: Domain) -> int:
        """How many rows cannot be read as a domain."""
        return self.n_errors + sum(n for is_read, n in self.reads(domain) if not is_read)

    def read_as(self, domain: Domain) -> list[str]:
        return [text for text, (is_read, _) in zip(self.texts, self.reads(domain), strict=True) if is_read]

    @property
    def is_numeric(self) -> bool:
        """Whether half of the rows read as numbers and the others have digits: numbers with slips among them, as in "2; 5"."""
        has_digits = all(any(map(str.isdigit, text)) for text in self.texts)
        return has_digits and 2 * (self.n_unread(NUMBER) - self.n_errors) <= self.n_rows

    def mostly(self, domain: Domain) -> bool:
        """Whether nearly all rows read as a domain; stops at the row that decides."""
        return self._are_mostly(self.reads(domain))

    def are_mostly(self, claim: Callable[[str], bool]) -> bool:
        """Whether something is true of the texts of nearly all rows."""
        return self._are_mostly(zip(map(claim, self.texts), self.counts, strict=True))

    def _are_mostly(self, flags: Iterable[tuple[bool, int]]) -> bool:
        may_fail = (1 - READABLE_SHARE) * self.n_rows
        for is_so, n in flags:
            may_fail -= 0 if is_so else n
            if may_fail < 0:
                return False
        return True


def propose_type(column: TextColumn, names: TextColumn | None = None) -> Proposal:
    """The type that a column's cells most likely have. `names` is the same column with each text as one whole name: what its cells
    become when they are names."""
    if (said := with_any(column)) is not None and not all(map(says_any, said.texts)):
        proposal = propose_type(said, names and with_any(names))
        cells = said if proposal.cells is None else proposal.cells
        if proposal.declared is None:
            return proposal
        why = proposal.why if proposal.cells is not None else proposal.why + rewritten(column, cells)
        return replace(proposal, why=why, cells=cells)
    if (numbers := as_numbers(column, _is_measure(column.name))) is not None:
        has_degrees = any(map(_DEGREES.search, column.texts))
        proposal = propose_type(replace(numbers, name=f"{column.name} (°)") if has_degrees else numbers)
        if proposal.declared is not None and KINDS[str(proposal.declared["type"])].is_numeric:
            return replace(proposal, why=proposal.why + rewritten(column, numbers), cells=numbers)
    counted = _CountedTexts.by(column)
    if not counted.texts:
        return _with_unread("no cell says anything but Any", counted, TEXT)
    if all(text.strip() in ("0", "1") for text in counted.texts):
        if _is_measure(column.name):
            return _number(column.name, counted)
        return _with_unread("the cells are 0 and 1; bool, if they mean False and True", counted, INT)
    if (truths := as_truths(column)) is not None:
        why = f"{plural(counted.n_rows, 'cell')} of True and False{rewritten(column, truths)}"
        return replace(_with_unread(why, _CountedTexts.by(truths), BOOL), cells=truths)
    if counted.mostly(BOOL):
        return _with_unread(f"{plural(counted.n_rows, 'cell')} of True and False", counted, BOOL)
    if counted.mostly(NUMBER) or counted.is_numeric:
        return _number(column.name, counted)
    if counted.mostly(DATE):
        return _with_unread(f"{plural(counted.n_rows, 'cell')} of dates", counted, DATE)
    if counted.mostly(TAGS):
        return _with_unread("every word has a + or a - before it", counted, _tags(counted))
    if (lists := as_lists(column)) is not None:
        proposal = _names(_CountedTexts.by(lists), True)
        return replace(proposal, why=proposal.why + rewritten(column, lists), cells=lists)
    if names is None:
        return _names(counted, counted.mostly(TEXT))
    proposal = _names(_CountedTexts.by(names), counted.are_mostly(_is_short))
    return proposal if proposal.declared is None else replace(proposal, cells=names)


def as_numbers(column: TextColumn, is_measure: bool = True) -> TextColumn | None:
    """A column of numbers as cells of ours: "20 - 60" as 20..60, "±30" as 0 ± 30, "30°" as 30, beside "> 1,5" also "0,5" as 0.5.
    None where every text stays as it is. `is_measure`: the column surely has numbers, then "20-60" without blanks is a range too,
    and no name."""
    plain = [_AROUND.sub("0 ± ", compared(_DEGREES.sub("", text))) for text in without_unit(column.texts)]
    if any("," in text and _SURE.fullmatch(text) for text in plain):
        plain = [DECIMAL_COMMA.sub(".", text) for text in plain]
    matches = [_RANGE.fullmatch(text) for text in plain]
    ranges = [one for one in matches if one]
    if any(float(one[1]) > float(one[3]) or not (one[2] or is_measure) for one in ranges):
        return None
    texts = [f"{one[1]}..{one[3]}" if one else text for one, text in zip(matches, plain, strict=True)]
    return None if texts == list(column.texts) else TextColumn.of(column.name, (texts[code] for code in column.codes.tolist()))


def as_lists(column: TextColumn) -> TextColumn | None:
    """A column of lists of names as cells of ours: "Low / Mid" as Low Mid. None where the parts do not come back in other texts; of
    lists with semicolons, which no name has, it is enough that one does."""
    parts = {text: _BETWEEN_NAMES.split(text.strip()) for text in column.texts if not says_any(text)}
    n_times = Counter(part for each in parts.values() for part in set(each))
    alone = {each[0] for each in parts.values() if len(each) == 1}
    lists = [each for each in parts.values() if len(each) > 1]
    names = {part for each in lists for part in each}
    is_sure = all(len(text.split(";")) == len(each) for text, each in parts.items())
    if not all((is_sure or part in alone or n_times[part] > 1) and _is_short(part) for part in names):
        return None
    if not names & alone:
        return None
    texts = [" ".join(map(quoted, parts[text])) if text in parts else text for text in column.texts]
    return TextColumn.of(column.name, (texts[code] for code in column.codes.tolist()))


def as_cells(column: TextColumn, domain: Domain) -> TextColumn | None:
    """A column as cells of a domain, of which people write some otherwise; None where every text stays as it is."""
    said = with_any(column)
    one = column if said is None else said
    form = (
        as_lists if domain.type.is_named else as_numbers if domain.type.is_numeric else as_truths if domain.type.is_truth else None
    )
    return (form and form(one)) or said


def rewritten(column: TextColumn, cells: TextColumn) -> str:
    """What is said of a column whose texts become other cells: the first of them."""
    row = next(row for row in range(column.n_rows) if column[row] != cells[row])
    return f"; {in_quotes(column[row])} is read as {cells[row]}"


def _with_unread(why: str, counted: _CountedTexts, domain: Domain) -> Proposal:
    declared: dict[str, object] = {"type": domain.kind} | ({} if domain.values is None else {"values": list(domain.values)})
    n_unread = counted.n_unread(domain)
    return Proposal(declared, f"{why}; {plural(n_unread, 'cell')} cannot be read so" if n_unread else why, n_unread)


def _number(name: str, counted: _CountedTexts) -> Proposal:
    proposal = _number_type(name, counted)
    return replace(proposal, why=proposal.why + pair_in(counted.texts))


def _number_type(name: str, counted: _CountedTexts) -> Proposal:
    texts = counted.read_as(NUMBER)
    backwards = next((t for t in texts if _runs_backwards(t)), None)
    is_angle = _ANGLE_NAME.search(name) is not None or backwards is not None
    if is_angle and all(_is_within_turn(text) and reads(text, ANGLE) for text in texts):
        why = f'"{backwards}" runs through 180' if backwards else "the name suggests an angle, and no number is above 360"
        return _with_unread(why, counted, ANGLE)
    measured = _measured(name, texts)
    if measured is None:
        return _with_unread("whole numbers alone, as counts are", counted, INT)
    return _with_unread(measured, counted, NUMBER)


def _measured(name: str, texts: Sequence[str]) -> str | None:
    """Why the numbers are measured, so that a fact such as 3.7 must be allowed; None where they seem to be counted."""
    if fraction := next((text for text in texts if _FRACTION.search(text)), None):
        return f"numbers with fractions, such as {in_quotes(fraction)}"
    if extent := next((text for text in texts if not _WHOLE.fullmatch(text)), None):
        return f"a fact may be between whole numbers in {in_quotes(extent)}"
    return "its name suggests a measurement" if _is_measure(name) else None


def _is_measure(name: str) -> bool:
    """Whether a name has a unit in brackets, or a word for a unit or a quantity: "Speed (m/s)", target_dist, timeToImpact."""
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    return bool(_UNIT.search(name)) or any(map(_MEASURE.fullmatch, words))


def _runs_backwards(text: str) -> bool:
    """Whether an interval ends below where it starts, as only one on the circle does."""
    match = re.fullmatch(r"\s*[\[(]?\s*(-?[\d.]+?)\s*\.\.\s*(-?[\d.]+)\s*[\])]?\s*", text)
    try:
        return match is not None and float(match[1]) > float(match[2])
    except ValueError:
        return False


def _is_within_turn(text: str) -> bool:
    return all(abs(float(number)) <= 360 for number in re.findall(r"\d+(?:\.\d+)?", text))


def _tags(counted: _CountedTexts) -> Domain:
    tags: dict[str, None] = {}
    for cell in _cells(counted, TAGS):
        if isinstance(cell.accepts, TagSet):
            tags |= dict.fromkeys(sorted(cell.accepts.needs | cell.accepts.bans))
    return replace(TAGS, values=tuple(sorted(tags))) if tags and _can_be_declared(tags) else TAGS


def _can_be_declared(names: Iterable[str]) -> bool:
    """Whether contextdb.toml takes all of the names as values."""
    return not any(map(wrong_name, names))


def _is_short(text: str) -> bool:
    """Whether a text with blanks in it is as short as a name, and no sentence."""
    return _SHORT.fullmatch(text.strip()) is not None


def _names(counted: _CountedTexts, are_names: bool) -> Proposal:
    """An enum of the names there are, where those are few and come back; a text; or, of whole sentences, no condition at all."""
    if not are_names:
        return Proposal(None, "the cells are not names, numbers or tags: data for the game, or a note")
    names: dict[str, None] = {}
    for cell in _cells(counted, TEXT):
        if isinstance(cell.accepts, ValueSet):
            names |= dict.fromkeys(_in_order(cell.accepts))
    if len(names) <= MOST_ENUM_VALUES and _can_be_declared(names) and (len(names) < counted.n_rows or counted.n_rows < FEW_ROWS):
        why = f"{plural(len(names), 'name')} in {plural(counted.n_rows, 'cell')}: {listed(list(names), 4)}"
        return _with_unread(why, counted, Domain("enum", tuple(names)))
    if len(names) == counted.n_rows:
        return Proposal(None, "every row has a different name: data for the game, or a note")
    return _with_unread(f"{plural(len(names), 'different name')}", counted, TEXT)


def _in_order(accepts: ValueSet) -> list[str]:
    return sorted(str(value) for value in accepts.values)


def _cells(counted: _CountedTexts, domain: Domain) -> list[Cell]:
    cells = []
    for text in counted.texts:
        try:
            cells.append(parse_cell(text, domain, wants_mend=False))
        except CellError:
            continue
    return cells


def names_of(column: TextColumn) -> list[str]:
    """The names in a column's cells that contextdb.toml takes as values, in order."""
    cells = _cells(_CountedTexts.by(column), TEXT)
    names = {name for cell in cells if isinstance(cell.accepts, ValueSet) for name in _in_order(cell.accepts)}
    return sorted(name for name in names if not wrong_name(name))


def n_unreadable(column: TextColumn, domain: Domain) -> tuple[int, str]:
    """How many rows of a column a domain cannot read, and the first such text."""
    counts = np.bincount(column.codes, minlength=len(column.texts)).tolist()
    wrong = [(text, n) for text, n in zip(column.texts, counts, strict=True) if n and not reads(text, domain)]
    return sum(n for _, n in wrong), wrong[0][0] if wrong else ""
