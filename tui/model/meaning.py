"""What a text in a cell editor means, in a few words: fit for every key, so mends are not looked for here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.facts import describe, read_fact_text
from contextdb.cells.grammar import parse_cell, reads
from contextdb.cells.mends import candidates
from contextdb.cells.sets import Cell, TagSet, ValueSet
from contextdb.cells.words import format_number
from contextdb.errors import CellError, ContextError, Fault, Place, plural, safe_text
from contextdb.exchange.reading import PAIR, as_pair

from .interval_picture import number_words

_MOST_TAGS = 4
_MOST_MENDED = 1000


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a text says, or why it cannot be read. `cell` is the set of values to draw; None where there is none."""

    words: str = ""
    fault: Fault | None = None
    cell: Cell | None = None


def meaning(text: str, condition: Condition, is_fact: bool = False) -> Meaning:
    """What a text says as a cell of a condition, or as a fact."""
    try:
        return _fact_meaning(text, condition) if is_fact else _cell_meaning(text, condition)
    except (CellError, ContextError) as error:
        return Meaning(fault=replace(error.faults[0], place=Place(), mend=""))


def _cell_meaning(text: str, condition: Condition) -> Meaning:
    cell = parse_cell(text, condition.domain, wants_mend=False)
    words = _words_of(text, cell, condition)
    if cell.penalty is not None:
        each = "" if cell.per is None else f" for each {format_number(cell.per)} that they are away"
        words += f"; others cost {format_number(cell.penalty)} more{each}"
    return Meaning(words, cell=cell)


def _fact_meaning(text: str, condition: Condition) -> Meaning:
    domain = condition.domain
    if not text.strip():
        return Meaning("not given")
    if not domain.type.is_tags and not reads(text, domain) and text.strip() not in domain.known:
        parse_cell(text, domain, wants_mend=False)
    fact = read_fact_text(text, condition)
    if fact is None:
        return Meaning("not given")
    if isinstance(fact, Cell):
        words = _words_of(text, fact, condition)
        return Meaning(f"{words}; it may have others" if domain.type.is_tags else f"may be {words}", cell=fact)
    description = describe(fact, domain)
    if domain.type.is_numeric:
        return Meaning(f"exactly {description} {condition.unit}".rstrip(), cell=parse_cell(description, domain))
    return Meaning(f"has {description}" if isinstance(fact, frozenset) else f"is {description}")


def _words_of(text: str, cell: Cell, condition: Condition) -> str:
    """A set of values in words; of "0,5", which could be meant as 0.5, first that it is centre and tolerance."""
    words = set_words(cell, condition.domain, condition.unit)
    return f"{as_pair(text)}: {words}" if condition.domain.type.is_numeric and PAIR.fullmatch(text) else words


def set_words(cell: Cell, domain: Domain, unit: str = "") -> str:
    """A set of values in words."""
    if domain.type.is_numeric:
        return number_words(cell, domain, unit)
    accepts = cell.accepts
    if accepts is None:
        return "any set of tags" if domain.type.is_tags else "every value"
    if cell.is_empty:
        return "no value: the row never matches"
    if isinstance(accepts, TagSet):
        return _tag_words(accepts)
    assert isinstance(accepts, ValueSet)
    return _value_words(accepts, domain)


def _value_words(accepts: ValueSet, domain: Domain) -> str:
    n_named = len(accepts.values)
    if domain.type.is_truth:
        return "True or False" if n_named != 1 else f"only {next(iter(accepts.values))}"
    if domain.values is None:
        return f"every value but {n_named:,}" if accepts.is_complement else f"{plural(n_named, 'value')}"
    return f"{n_named:,} of {plural(len(domain.values), 'declared value')}"


def _tag_words(accepts: TagSet) -> str:
    has = [f"{verb} {_listed(tags)}" for verb, tags in (("has", accepts.needs), ("has not", accepts.bans)) if tags]
    words = ", ".join(has) or "any set of tags"
    return f"anything but: {words}" if accepts.is_complement else words


def _listed(tags: frozenset[str]) -> str:
    names = [safe_text(tag) for tag in sorted(tags)]
    return (
        " and ".join(names)
        if len(names) <= _MOST_TAGS
        else f"{' and '.join(names[:_MOST_TAGS])} and {len(names) - _MOST_TAGS} more"
    )


# ---- mends


def mend_of(text: str, fault: Fault, domain: Domain | None, check: Callable[[str], Fault | None]) -> str:
    """The nearest text that `check` accepts, as it would be typed, or nothing.

    The mend in a message may be shortened, so where it cannot be taken as it is the candidates are looked through again.
    """
    named = fault.mend[1:-1] if fault.mend[:1] in ("'", '"') else ""
    near = (named, *(candidates(text[:_MOST_MENDED], domain) if domain is not None else ()))
    return next((c for c in near if c and c != text.strip() and (domain is None or reads(c, domain)) and check(c) is None), "")
