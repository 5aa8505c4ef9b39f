"""The grammar of a cell: every line of cells.csv, and what holds for any text and any cell."""

import csv
import math
import shlex
from pathlib import Path

import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.grammar import format_cell, parse_cell
from contextdb.cells.intervals import CIRCLE, arc, complement, union
from contextdb.cells.kinds import KINDS
from contextdb.cells.sets import Cell, NumberSet, TagSet, ValueSet
from contextdb.errors import CellError, Fault, in_quotes

CELLS = Path(__file__).with_name("cells.csv")
HEADER = ["rule", "type", "declared", "cell", "matches", "fails", "same as", "refused because", "did you mean"]

Line = dict[str, str]


def read_lines() -> list[tuple[int, Line]]:
    """The lines of cells.csv with their numbers in the file."""
    with CELLS.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        return [(reader.line_num, line) for line in reader]


def line_id(item: tuple[int, Line]) -> str:
    number, line = item
    return f"{number} {line['type']} {line['cell'] or '(empty)'}"


LINES = read_lines()
READABLE = [item for item in LINES if not item[1]["refused because"]]
REFUSED = [item for item in LINES if item[1]["refused because"]]


def parts(text: str) -> list[str]:
    return [part.strip() for part in text.split(";") if part.strip()]


def domain_of(line: Line) -> Domain:
    """What the column `declared` says: values with semicolons between, or bounds such as `min=0 max=10`."""
    kind, declared = line["type"], line["declared"]
    if kind in ("int", "number", "date"):
        bounds = dict(word.split("=") for word in oracles.with_days(declared).split())
        return Domain(kind, None, float(bounds.get("min", "-inf")), float(bounds.get("max", "inf")))
    return Domain(kind, tuple(parts(declared)) or None)


def fact_of(text: str, kind: str) -> object:
    """One of the facts in the columns `matches` and `fails`."""
    if kind == "bool":
        return {"True": True, "False": False}[text]
    if kind in ("int", "number", "angle", "date"):
        return float(oracles.with_days(text))
    if kind == "tags":
        return frozenset(() if text == "(none)" else shlex.split(text))
    return text[1:-1] if text[0] == text[-1] == '"' else text


def test_the_examples_have_the_columns_that_this_test_reads():
    assert CELLS.read_text(encoding="utf-8").splitlines()[0].split(",") == HEADER
    assert all(None not in line and None not in line.values() for _, line in LINES)


def test_every_type_has_examples_that_are_read_and_examples_that_are_refused():
    assert {line["type"] for _, line in READABLE} == set(KINDS)
    assert {line["type"] for _, line in REFUSED} == set(KINDS)


def test_no_example_stands_twice():
    keys = [(line["type"], line["declared"], line["cell"]) for _, line in LINES]
    assert sorted({key for key in keys if keys.count(key) > 1}) == []


@for_each(READABLE)
def test_a_cell_means_what_its_example_says(number: int, line: Line):
    domain = domain_of(line)
    cell = parse_cell(line["cell"], domain)
    assert [f for f in parts(line["matches"]) if not cell.holds(fact_of(f, domain.kind))] == []
    assert [f for f in parts(line["fails"]) if cell.holds(fact_of(f, domain.kind))] == []
    assert line["same as"] in ("", format_cell(cell, domain))


@for_each(REFUSED)
def test_a_cell_is_refused_as_its_example_says(number: int, line: Line):
    with pytest.raises(CellError) as caught:
        parse_cell(line["cell"], domain_of(line))
    (fault,) = caught.value.faults
    assert line["refused because"] in fault.message
    assert fault.mend == (in_quotes(line["did you mean"]) if line["did you mean"] else "")


# ---- what holds for any text and any cell

PIECES = [*"0123456789.,;|<>=()[]{}~±+-/:! \t\"'", "..", "inf", "1e", "not ", "Any", "CB", "FS", "Half Back", "InAir", "Move.Run"]
GRAMMAR = st.lists(st.sampled_from(PIECES), max_size=8).map("".join)
ANY_TEXT = GRAMMAR | st.text(max_size=20) | st.text(st.characters(), max_size=20)
DOMAINS = strategies.domains() | st.sampled_from([Domain("enum", ("CB", "FS", "Half Back")), Domain("tags", ("InAir", "Move.Run"))])
DEGREES = st.floats(-180.0, 179.0) | st.integers(-180, 179).map(float)
FLOATS = st.floats(allow_nan=False).map(lambda x: x + 0.0)


def read_or_refuse(text: str, domain: Domain) -> Cell | Fault:
    try:
        return parse_cell(text, domain)
    except CellError as error:
        return error.faults[0]


@given(DOMAINS, st.data())
@strategies.examples(4)
def test_reading_what_is_written_gives_an_equal_cell(domain: Domain, data: st.DataObject):
    cell = parse_cell(data.draw(strategies.cells(domain)), domain)
    assert parse_cell(format_cell(cell, domain), domain) == cell


@given(st.lists(st.tuples(FLOATS, FLOATS).map(sorted).map(tuple), max_size=4), FLOATS.filter(math.isfinite).map(abs))
def test_reading_what_is_written_gives_an_equal_set_of_any_doubles(spans: list[tuple[float, float]], cost: float):
    cell = Cell(NumberSet(union(spans)), cost)
    assert parse_cell(format_cell(cell, NUMBER), NUMBER) == cell


@given(st.lists(st.tuples(DEGREES, DEGREES) | DEGREES.map(lambda angle: (angle, angle)), max_size=4), st.booleans())
def test_reading_what_is_written_gives_an_equal_set_of_any_angles(ends: list[tuple[float, float]], is_complement: bool):
    spans = union(span for low, high in ends for span in arc(low, high))
    cell = Cell(NumberSet(complement(spans, *CIRCLE) if is_complement else spans, is_circular=True))
    assert parse_cell(format_cell(cell, ANGLE), ANGLE) == cell


@given(st.frozensets(st.text(max_size=5), min_size=1, max_size=4), st.booleans())
def test_reading_what_is_written_gives_an_equal_set_of_any_texts(values: frozenset[str], is_complement: bool):
    cell = Cell(ValueSet(values, is_complement))
    assert parse_cell(format_cell(cell, TEXT), TEXT) == cell


@given(st.frozensets(st.text(max_size=3), max_size=3), st.frozensets(st.text(max_size=3), max_size=3), st.booleans())
def test_reading_what_is_written_gives_an_equal_set_of_any_tags(needs: frozenset[str], bans: frozenset[str], is_complement: bool):
    cell = Cell(TagSet(needs, bans, is_complement))
    assert parse_cell(format_cell(cell, TAGS), TAGS) == cell


@given(DOMAINS, st.data())
@strategies.examples(3)
def test_a_cell_holds_what_the_plainest_reading_of_it_says(domain: Domain, data: st.DataObject):
    text = data.draw(strategies.cells(domain))
    fact = data.draw(strategies.plain_facts(domain, (text,))).plain
    assert parse_cell(text, domain).holds(fact) is oracles.accepts(text, domain, fact)


@given(ANY_TEXT, DOMAINS)
@strategies.examples(6)
def test_any_text_is_read_or_refused_with_its_find_and_what_is_accepted(text: str, domain: Domain):
    found = read_or_refuse(text, domain)
    assert isinstance(found, Cell) or (found.found and found.accepted)


@given(ANY_TEXT, DOMAINS)
@strategies.examples(6)
def test_a_mend_that_is_offered_can_itself_be_read(text: str, domain: Domain):
    found = read_or_refuse(text, domain)
    if isinstance(found, Fault) and found.mend.isprintable() and "\\" not in found.mend and "…" not in found.mend:
        assert not found.mend or isinstance(read_or_refuse(found.mend[1:-1], domain), Cell)


@given(ANY_TEXT.filter(str.strip), DOMAINS)
def test_a_mend_never_offers_an_empty_cell(text: str, domain: Domain):
    assert read_or_refuse(text, domain) is not None
    assert getattr(read_or_refuse(text, domain), "mend", "") != '""'


HOSTILE = {
    "digits": "1" * 100_000,
    "points": "1." * 50_000,
    "exponents": "1e" * 50_000,
    "a long exponent": "1e" + "9" * 100_000,
    "dots": "." * 100_000,
    "spaces between numbers": "1" + " " * 100_000 + "2",
    "spaces in a comparison": ">1" + " " * 50_000 + "<",
    "brackets": "(" * 100_000,
    "a union of thousands": "1|" * 20_000 + "2",
    "a union of nothing": "|" * 100_000,
    "tildes": "~" * 100_000,
    "quotes": '"' * 100_001,
    "quotes and letters": '"a' * 50_001,
    "pluses": "+" * 100_000,
    "signs and words": "+a -b " * 20_000,
    "words that nobody declared": "unknown " * 20_000,
    "words that are nearly declared": " ".join(f"+valeu{i}" for i in range(1000)),
    "not, many times": "not " * 20_000 + "5",
    "not, many times, of a name": "not " * 20_000 + "value7",
    "not, without end": "not " * 20_000,
    "minus signs of all kinds": "−–—" * 30_000,
    "one word": "a" * 1_000_000,
    "one word in quotes": '"' + "a" * 1_000_000 + '"',
    "nothing": " " * 1_000_000,
    "null characters": "\0" * 1000,
    "half a character": "\ud800\udfff",
    "both directions": "\u202e5\u202d",
    "digits of other scripts": "٣٤..٥٦",
    "a byte order mark": "\ufeffAny",
}
MANY_VALUES = Domain("enum", tuple(f"value{i}" for i in range(1000)))
MANY_TAGS = Domain("tags", tuple(f"Tag.{i}" for i in range(1000)))


@for_each(HOSTILE.values(), [BOOL, INT, NUMBER, ANGLE, TEXT, MANY_VALUES, MANY_TAGS])
def test_a_hostile_text_is_read_or_refused_in_a_short_message(text: str, domain: Domain):
    found = read_or_refuse(text, domain)
    assert isinstance(found, Cell) or len(found.message) < 1000
