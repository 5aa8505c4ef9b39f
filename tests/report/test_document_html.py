"""Documents as pages: figures sort by their size, and what a text holds is no markup."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_strategies import MARKUP

from contextdb.report.document import Document, Folded, Listing, Numbered, Row, Rows, Section, Table
from contextdb.report.document_html import as_html, figure

SIZES = ["point", "<0.01 %", "0.01 %", "≈ 2 %", "12 or more", "99.9 %", ">99.99 %", "100 %", "1,200"]


def test_figures_are_sorted_by_their_size():
    values = [figure(text) or 0.0 for text in SIZES]
    assert values == sorted(values)
    assert len(set(values)) == len(values)


@pytest.mark.parametrize("text", ["run_01", "line 3", "2 legs", "1..3", "%"])
def test_other_texts_are_no_figures(text: str):
    assert figure(text) is None


@given(st.sampled_from(MARKUP))
def test_no_text_of_a_document_is_markup(text: str):
    def document(name: str) -> Document:
        rows = Rows(name, [Row((name,), (name,))], (name, name))
        folded = Folded(name, [("1", name, [name])], name)
        blocks = [name, Listing(name, [name], name), Numbered(name, [name]), Table((name,), [(name,)], name), rows, folded]
        return Document("coverage", "table", [Section(name, name, [name], blocks)] * 2, Section("", name, (), blocks))

    assert as_html(document(text)).count("<") == as_html(document("plain")).count("<")


def test_boxes_that_scroll_have_names_of_their_own_and_heads_are_never_empty():
    table = Table(("", "share"), [("1", "2 %"), ("2", "1 %")], "To do")
    page = as_html(Document("coverage", "table", [Section("moves", blocks=[table]), Section("dives", blocks=[table])]))
    assert re.findall(r'role="region" aria-label="([^"]*)"', page) == ["moves: To do", "dives: To do"]
    assert re.findall(r"<th[^>]*>([^<]*)</th>", page) == ["#", "share"] * 2
    alone = as_html(Document("coverage", "table", [Section("moves", blocks=[table])]))
    assert 'aria-label="To do"' in alone
