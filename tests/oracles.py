"""What every answer is held to: each cell of each row read anew for one context, in the plainest way.

Of contextdb only the data that a table is made of is used: texts, and what is declared of a condition. How cells are read, the
intervals, the classes and the masks are done again here, slowly, with regular expressions and comparisons: their faults show.

A fact is here as `contextdb.cells.facts` would have it: bool, float, str or frozenset of tags; None is missing; a list holds the
values of a set-valued fact.
"""

import datetime
import itertools
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction

from contextdb.cells.domains import Domain
from contextdb.tables.table import Table

Plain = bool | float | str | frozenset[str] | None
Interval = tuple[float, bool, float, bool]
"""Low end, whether it is open, high end, whether it is open."""

SOFT = re.compile(r"(.*)~\s*([\d.eE+-]+)\s*(?:/\s*([\d.eE+-]+)\s*)?", re.DOTALL)
WORD = re.compile(r'([+-]?)(?:"((?:[^"]|"")*)"|(\S+))')
NUMBER = re.compile(r"(?:inf|\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?)", re.IGNORECASE)


DATE = re.compile(r"\d{4}-\d{2}-\d{2}")
EPOCH = datetime.date(1970, 1, 1)
FIRST_DAY, LAST_DAY = ((day - EPOCH).days for day in (datetime.date.min, datetime.date.max))


# ---- one cell


def accepts(text: str, domain: Domain, fact: Plain) -> bool:
    """Whether what a cell says, soft or not, holds for a fact."""
    body, n_negations = without_not(hard_part(text))
    held = is_any_word(body) or READERS[domain.kind](body, domain, fact)
    for _ in range(n_negations):
        held = is_in_domain(fact, domain) and not held
    return held


def passes(text: str, domain: Domain, fact: Plain, unknown: str = "error") -> bool:
    """Whether a cell lets its row be valid: a soft one always does."""
    if penalty(text) is not None or is_any_word(text.strip()):
        return True
    return unknown == "any" if fact is None else accepts(text, domain, fact)


def cost(text: str, domain: Domain, fact: Plain, unknown: str = "error") -> float:
    """What a cell costs its row in a search."""
    if penalty(text) is None or is_any_word(hard_part(text)):
        return 0.0
    is_held = unknown == "any" if fact is None else accepts(text, domain, fact)
    if is_held or not penalty(text):
        return 0.0
    per = SOFT.fullmatch(text)[3]
    apart = None if per is None or fact is None else distance(text, domain, fact)
    return penalty(text) if apart is None else penalty(text) * apart / float(per)


def distance(text: str, domain: Domain, fact: float) -> float | None:
    """How far a number is from the nearest one that a cell accepts; None where it accepts none."""
    accepted = [value for value in representatives([text], domain) if accepts(text, domain, value)]
    apart = [abs(fact - value) for value in accepted]
    if domain.kind == "angle":
        apart = [min(each % 360.0, 360.0 - each % 360.0) for each in apart]
    return min(apart, default=None)


def hard_part(text: str) -> str:
    found = SOFT.fullmatch(text)
    return (found[1] if found else text).strip()


def penalty(text: str) -> float | None:
    found = SOFT.fullmatch(text)
    return float(found[2]) if found else None


def without_not(body: str) -> tuple[str, int]:
    found = re.match(r"((?:not\s+)*)(.*)", body, re.IGNORECASE | re.DOTALL)
    return found[2], len(found[1].split())


def is_any_word(body: str) -> bool:
    return body.lower() in ("", "-", "any")


def is_in_domain(fact: Plain, domain: Domain) -> bool:
    return domain.kind not in ("int", "number", "date") or domain.minimum <= fact <= domain.maximum


# ---- the kinds


def read_bool(body: str, domain: Domain, fact: bool) -> bool:
    return fact is (body.lower() in ("true", "t", "yes", "1"))


def read_numbers(body: str, domain: Domain, fact: float) -> bool:
    return any(is_between(interval(part.strip(), -math.inf, math.inf), fact) for part in body.split("|"))


def read_angles(body: str, domain: Domain, fact: float) -> bool:
    return any(is_on_arc(part.strip(), fact) for part in body.split("|"))


def read_names(body: str, domain: Domain, fact: str) -> bool:
    return fact in [sign + name for sign, name in words(body)]


def read_tags(body: str, domain: Domain, fact: frozenset[str]) -> bool:
    return all(has(tag, fact) is (sign == "+") for sign, tag in words(body))


def read_dates(body: str, domain: Domain, fact: float) -> bool:
    return read_numbers(with_days(body), domain, fact)


def with_days(text: str) -> str:
    """A text with the number of days since 1970-01-01 for each date in it."""
    return DATE.sub(lambda found: str((datetime.date.fromisoformat(found[0]) - EPOCH).days), text)


READERS = {
    "date": read_dates,
    "bool": read_bool,
    "int": read_numbers,
    "number": read_numbers,
    "angle": read_angles,
    "enum": read_names,
    "text": read_names,
    "tags": read_tags,
}


def words(body: str) -> list[tuple[str, str]]:
    return [(sign, bare or quoted.replace('""', '"')) for sign, quoted, bare in WORD.findall(body)]


def has(tag: str, tags: frozenset[str]) -> bool:
    return any(f"{t}.".startswith(f"{tag}.") for t in tags)


def interval(part: str, bottom: float, top: float) -> Interval:
    """One part of a union, with `bottom` and `top` for ends that are left away."""
    if ".." in part:
        low, high = (end.strip() for end in part.strip("[()]").split(".."))
        is_low_open, is_high_open = low != "" and part[0] == "(", high != "" and part[-1] == ")"
        return float(low or bottom), is_low_open, float(high or top), is_high_open
    if found := re.fullmatch(r"(.+?)\s*(?:,|±|\+-)\s*(.+)", part):
        centre, tolerance = float(found[1]), float(found[2])
        return centre - tolerance, False, centre + tolerance, False
    sign, value = re.match("[<>=]*", part)[0], float(part.lstrip("<>= "))
    low, high = (bottom, value) if "<" in sign else (value, top) if ">" in sign else (value, value)
    return low, sign == ">", high, sign == "<"


def is_between(ends: Interval, fact: float) -> bool:
    low, is_low_open, high, is_high_open = ends
    return (low < fact if is_low_open else low <= fact) and (fact < high if is_high_open else fact <= high)


def is_on_arc(part: str, fact: float) -> bool:
    """Whether some turn of the angle lies from the low end upwards to the high end; exact."""
    tolerance = re.fullmatch(r".+?(?:,|±|\+-)\s*(.+)", part)
    if tolerance and float(tolerance[1]) >= 180.0:
        return True
    low, is_low_open, high, is_high_open = interval(part, -180.0, 180.0)
    start, stop, angle = Fraction(low), Fraction(high), Fraction(fact)
    stop += 360 * max(0, math.ceil((start - stop) / 360))
    first = angle + 360 * math.ceil((start - angle) / 360)
    return any(is_between((start, is_low_open, stop, is_high_open), turn) for turn in (first, first + 360))


# ---- tables


def rows(table: Table, context: Mapping[str, Plain | list], unknown: str = "error") -> list[int]:
    """The rows that are valid, or that may be where facts are sets."""
    return _rows(table, context, unknown, any)


def rows_always(table: Table, context: Mapping[str, Plain | list], unknown: str = "error") -> list[int]:
    """The rows that are valid for every value of facts that are sets."""
    return _rows(table, context, unknown, all)


def costs(table: Table, context: Mapping[str, Plain | list], unknown: str = "error") -> list[float]:
    """What each row's soft cells cost; for a set, what its best value does."""
    found = [0.0] * table.n_rows
    for name, domain, texts in columns(table):
        of = {t: min(cost(t, domain, f, unknown) for f in values(context.get(name))) for t in set(texts)}
        found = [total + of[text] for total, text in zip(found, texts, strict=True)]
    return found


def _rows(
    table: Table, context: Mapping[str, Plain | list], unknown: str, some_or_all: Callable[[Iterable[bool]], bool]
) -> list[int]:
    valid = [is_enabled(table, row) for row in range(table.n_rows)]
    for name, domain, texts in columns(table):
        good = {t: some_or_all(passes(t, domain, f, unknown) for f in values(context.get(name))) for t in set(texts)}
        valid = [so_far and good[text] for so_far, text in zip(valid, texts, strict=True)]
    return [row for row in range(table.n_rows) if valid[row]]


def columns(table: Table) -> Iterable[tuple[str, Domain, list[str]]]:
    return [(c.condition.name, c.condition.domain, c.texts.to_list()) for c in table.conditions]


def is_enabled(table: Table, row: int) -> bool:
    name = table.settings.enabled
    return name is None or table.text(row, name).strip().lower() in ("", "true", "t", "yes", "1")


def values(fact: Plain | list) -> list[Plain]:
    return fact if isinstance(fact, list) else [fact]


# ---- values near which the answers change


def numbers_in(texts: Iterable[str]) -> list[float]:
    """Every number that stands in the texts, and the ends of every centre and tolerance."""
    found: set[float] = set()
    for part in (part for text in texts for part in hard_part(text).split("|")):
        given = [float(n) for n in NUMBER.findall(part.replace("..", " "))]
        found.update(given, (-n for n in given))
        if len(given) == 2:
            signed = [given[0], -given[0]]
            found.update(c - given[1] for c in signed)
            found.update(c + given[1] for c in signed)
    return sorted(n for n in found if not math.isnan(n))


def representatives(texts: Sequence[str], domain: Domain) -> list[Plain]:
    """Facts of which one lies in every part of the domain that cells of these texts can tell apart."""
    if domain.kind == "bool":
        return [False, True]
    if domain.kind == "date":
        days = numbers_in(map(with_days, texts))
        near = _numbers_near([*days, domain.minimum, domain.maximum, 0.0, FIRST_DAY, LAST_DAY], domain)
        return [day for day in near if FIRST_DAY <= day <= LAST_DAY]
    if domain.kind in ("int", "number", "angle"):
        return _numbers_near([*numbers_in(texts), domain.minimum, domain.maximum, 0.0], domain)
    if domain.kind == "enum":
        return list(domain.values)
    named = sorted({name if domain.kind == "tags" else sign + name for text in texts for sign, name in _words_in(text)})
    if domain.kind == "text":
        return [*named, "".join(named) + "?"]
    return [frozenset(some) for n in range(len(named) + 1) for some in itertools.combinations(named, n)]


def _words_in(text: str) -> list[tuple[str, str]]:
    body, _ = without_not(hard_part(text))
    return [] if is_any_word(body) else words(body)


def _numbers_near(bounds: Iterable[float], domain: Domain) -> list[float]:
    if domain.kind == "number":
        return sorted(_neighbours(bounds))
    finite = [b for b in bounds if math.isfinite(b)]
    if domain.kind == "angle":
        return sorted({wrapped(n) for n in _neighbours([*finite, *map(wrapped, finite), -180.0])})
    ends = [end(n) for n in _neighbours(finite) if math.isfinite(n) for end in (math.floor, math.ceil)]
    return sorted({-math.inf, math.inf, *(float(end + step) for end in ends for step in (-1, 0, 1))})


def _neighbours(numbers: Iterable[float]) -> set[float]:
    """The numbers, and the doubles beside them."""
    return {math.nextafter(n, to) for n in numbers for to in (-math.inf, n, math.inf)}


def wrapped(degrees: float) -> float:
    """The same angle in [-180, 180), by exact arithmetic."""
    exact = Fraction(degrees)
    return float(exact - 360 * math.floor((exact + 180) / 360))
