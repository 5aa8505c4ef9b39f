"""The lines of a link: facts come out as they went in, whatever they are; what is no line is refused."""

import datetime
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import for_each

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.cells.facts import FactSet, read_fact, read_fact_text
from contextdb.telemetry.link import lines
from contextdb.telemetry.link.lines import dumped, fact_text, given_fact, read_line, sent_fact, sent_facts

HOSTILE = [
    "Any",
    "not",
    "-x",
    "5",
    "nan",
    "",
    " ",
    'say "no"',
    "a\nb",
    "\x1b[31m",
    "é\u2028",
    "x" * 500,
    "1..2",
    "+a -b",
    "]}",
    "null",
]
NAMES = tuple(dict.fromkeys(["A", "Half Way", *(name for name in HOSTILE if name.strip())]))
CONDITIONS = {
    kind: Condition(kind, Domain(kind, values=NAMES if kind in ("enum", "tags") else None))
    for kind in ("bool", "int", "number", "angle", "date", "enum", "text", "tags")
}
DOUBLES = st.floats(allow_nan=True, allow_infinity=True)
FACTS = {
    "bool": st.booleans() | st.sampled_from([np.True_, 0, 1, None]),
    "int": st.integers(-(2**53), 2**53) | st.sampled_from([np.int32(3), 4.0, math.inf, None, FactSet("1..3"), "1..3"]),
    "number": DOUBLES | st.integers(-(2**60), 2**60) | st.sampled_from([np.float32(1.1), None, FactSet("0 ± 90"), "0..5", "not 3"]),
    "angle": st.floats(-1e6, 1e6) | st.sampled_from([None, math.nan, FactSet("170 ± 20"), np.float64(-180.0)]),
    "date": st.dates() | st.sampled_from([None, datetime.date(1, 1, 1), "2026-02-28", FactSet("2026-01-01..2026-12-31")]),
    "enum": st.sampled_from(NAMES)
    | st.sets(st.sampled_from(NAMES), min_size=2)
    | st.sampled_from([None, np.str_("A"), FactSet("not A")]),
    "text": st.text(st.characters(exclude_categories=["Cs"])) | st.sampled_from([*HOSTILE, None]),
    "tags": st.sets(st.sampled_from(NAMES)) | st.frozensets(st.sampled_from(NAMES)) | st.sampled_from([None, FactSet("+A")]),
}


def same(a: object, b: object) -> bool:
    return a == b and type(a) is type(b)


@pytest.mark.parametrize("kind", CONDITIONS)
@given(data=st.data())
def test_a_fact_of_any_type_comes_out_as_it_went_in(kind: str, data: st.DataObject):
    condition = CONDITIONS[kind]
    fact = data.draw(FACTS[kind])
    line = dumped({"fact": sent_fact(fact, condition)})
    assert line.endswith(b"\n")
    assert line.isascii()
    assert line.count(b"\n") == 1
    expected = read_fact(fact, condition)
    assert same(read_fact(given_fact(json.loads(line)["fact"]), condition), expected)


@pytest.mark.parametrize("kind", CONDITIONS)
@given(data=st.data())
def test_a_fact_is_written_as_the_command_line_reads_it(kind: str, data: st.DataObject):
    condition = CONDITIONS[kind]
    fact = data.draw(FACTS[kind])
    text = fact_text(json.loads(dumped({"fact": sent_fact(fact, condition)}))["fact"])
    assert same(None if text is None else read_fact_text(text, condition), read_fact(fact, condition))


def test_facts_that_no_condition_is_about_are_sent_where_json_has_a_word_for_them():
    facts = {"hp": 3, "name": "x", "far": math.inf, "target": object(), "pair": (1, 2), 7: "no name"}
    assert sent_facts(facts, {}) == {"hp": 3, "name": "x"}  # type: ignore[arg-type]


@pytest.mark.parametrize("sent", [{"cell": 3}, {"number": "1"}, {"number": "inf", "cell": "x"}, [1], {"x": "y"}, {}])
def test_what_is_no_fact_is_refused(sent: object):
    with pytest.raises(ValueError, match="not a fact"):
        given_fact(sent)


ASK = {"line": "ask", "t": 1, "who": None, "table": "x", "facts": {}, "rows": "0", "valid": 0}


@for_each(
    [
        (b"", "not JSON"),
        (b"{", "not JSON"),
        (b"[" * 100_000, "not JSON"),
        (b"\xff", "not JSON"),
        (b"[]", "not a JSON object"),
        (b"{}", '"line" is missing'),
        (b'{"line":3}', '"line" is missing'),
        (json.dumps(ASK | {"rows": "xyz"}).encode(), "hexadecimal"),
        (json.dumps(ASK | {"facts": []}).encode(), '"facts" is of another type'),
        (json.dumps(ASK | {"who": 3}).encode(), '"who" is of another type'),
        (json.dumps(ASK | {"valid": True}).encode(), '"valid" is of another type'),
        (json.dumps(ASK | {"pick": {"asset": 3}}).encode(), "asset"),
        (b'{"line":"tables","tables":{"a":3}}', "no object"),
        (b'{"line":"tables","tables":{"a":{"conditions":5}}}', '"conditions" of a table is no object'),
        (json.dumps(ASK | {"t": 10**400}).encode(), '"t" is too large'),
        (json.dumps(ASK | {"actors": 3}).encode(), '"actors" is no object of lists of objects'),
        (json.dumps(ASK | {"actors": {"A": 3}}).encode(), '"actors" is no object of lists of objects'),
        (json.dumps(ASK | {"actors": {"A": [3]}}).encode(), '"actors" is no object of lists of objects'),
    ]
)
def test_what_is_no_line_is_refused_with_why(raw: bytes, why: str):
    with pytest.raises(ValueError, match=why):
        read_line(raw)


def test_a_question_with_actors_or_null_for_them_is_read():
    for actors in ({"A": [{"hp": 3}, {}], "B": []}, {}, None):
        assert read_line(json.dumps(ASK | {"actors": actors}).encode())["actors"] == actors


def test_a_fault_of_our_own_in_a_fact_is_not_taken_for_a_fact_that_cannot_be_sent(monkeypatch: pytest.MonkeyPatch):
    def broken(value: object, condition: Condition) -> object:
        raise TypeError("a fault of our own")

    monkeypatch.setattr(lines, "read_fact", broken)
    with pytest.raises(TypeError, match="of our own"):
        sent_fact(frozenset(("A",)), CONDITIONS["tags"])


def test_a_line_of_a_kind_that_is_not_known_is_read():
    assert read_line(b'{"line":"weather","rain":true}')["rain"] is True
