"""Markdown, read back by a CommonMark parser with GitHub's tables."""

import re
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token
from report_strategies import EXAMPLE, TEXTS, many, reports

from contextdb.console import printable
from contextdb.report import render_markdown
from contextdb.report.results import CheckReport


def parsed(text: str) -> list[Token]:
    """The blocks of a document; HTML counts as such, so that none goes unseen."""
    return MarkdownIt("commonmark").enable(["table", "strikethrough"]).parse(text)


def plain(token: Token) -> str:
    """The text of a block that holds nothing but text, and empty comments that no reader sees."""
    children = [child for child in token.children or () if child.content != render_markdown.DEAD]
    assert {child.type for child in children} <= {"text"}
    return "".join(child.content for child in children)


def texts_seen(text: str) -> list[str]:
    """The pieces of text in which a forge looks for mentions and addresses."""
    (_, inline, _) = parsed(render_markdown.escaped(text))
    return [child.content for child in inline.children or () if child.type == "text"]


LIVE = re.compile(
    r"[@#!%~&$][\w\"]|https?://|ftp://|www\.\w|mailto:\w|\bGH-\d|\b(?=[0-9]*[a-f])[0-9a-f]{7,40}\b|[\w.+-]+@[\w-]+\.\w",
    re.IGNORECASE,
)
"""What GitHub and GitLab make a link or a mention of."""


WORDS = (
    "@user @org/team #12 org/repo#12 GH-7 !3 %4 ~bug &2 $1 a@b.de 1a2b3c4d5e https://evil.example/x HTTP://x "
    "www.evil.example mailto:a@b.de ftp://x _ walk *"
)


@given(st.lists(st.sampled_from([*WORDS.split(), " ", '~"a b"']), min_size=1))
def test_names_mention_and_link_nobody(parts: list[str]):
    text = "".join(parts)
    assert not [piece for piece in texts_seen(f"x {text} x") if LIVE.search(piece)]


def tables_of(tokens: list[Token]) -> list[list[list[str]]]:
    """The cells of every table, row by row."""
    tables: list[list[list[str]]] = []
    for token, inner in pairwise(tokens):
        if token.type == "table_open":
            tables.append([])
        elif token.type == "tr_open":
            tables[-1].append([])
        elif token.type in ("td_open", "th_open"):
            tables[-1][-1].append(plain(inner))
    return tables


@given(reports())
def test_every_finding_is_a_row_of_six_cells_that_say_what_was_found(report: CheckReport):
    faulty = [g for g in report.groups() if g.findings]
    tables = tables_of(parsed(render_markdown.render(report, shows_all=True)))
    assert len(tables) == len(faulty)
    for rows, group in zip(tables, faulty, strict=True):
        found = [f for _, _, findings in group.blocks() for f in findings]
        place = [f"line {f.line}" if f.line else f"row {f.row + 1}" if f.row is not None else "" for f in found]
        said = [(f.level, f.rule, p, f.asset or "", f.column or "", f.message) for f, p in zip(found, place, strict=True)]
        assert rows == [
            ["level", "rule", "place", "asset", "column", "finding"],
            *([printable(t).strip() for t in row] for row in said),
        ]


@given(reports())
def test_only_the_headings_paragraphs_and_tables_of_the_report_are_there(report: CheckReport):
    tokens = parsed(render_markdown.render(report))
    blocks = {t.type for t in tokens if t.level == 0}
    assert blocks <= {f"{kind}_{end}" for kind in ("heading", "paragraph", "table") for end in ("open", "close")} | {"inline"}
    headings = [plain(b) for a, b in pairwise(tokens) if a.type == "heading_open" and a.tag == "h3"]
    assert headings == [g.label.strip() for g in report.groups() if g.findings]


@given(TEXTS)
def test_escaped_text_shows_as_it_is(text: str):
    (_, inline, _) = parsed(f"x{render_markdown.escaped(text)}x")
    assert plain(inline) == f"x{printable(text)}x"


def test_names_with_underscores_stay_readable_in_the_source():
    assert render_markdown.escaped("hit_mid_air a|b `c` _d_ 1*2") == r"hit_mid_air a\|b \`c\` \_d\_ 1\*2"


def test_a_report_reads_as_written():
    assert render_markdown.render(EXAMPLE) == (
        "## contextdb check\n\n"
        "3 tables checked: 3 errors, 1 warning, 1 info.\n\n"
        "### jog\n\n"
        "17 rows, 8 conditions, in tables/jog.csv\n\n"
        "| level | rule | place | asset | column | finding |\n"
        "| --- | --- | --- | --- | --- | --- |\n"
        '| error | empty-cell | line 5 | Jog_Fast | speed | "5..3" accepts no value. |\n'
        '| error | empty-cell | line 10 | Jog_Slow | speed | "9..1" accepts no value. |\n'
        "| info | undeclared-condition |  |  | IsLeft | its cells read as bool. |\n\n"
        "### jump\n\n"
        "not read, in tables/jump.csv\n\n"
        "| level | rule | place | asset | column | finding |\n"
        "| --- | --- | --- | --- | --- | --- |\n"
        "| error | unreadable |  |  |  | the file is empty. |\n\n"
        "### run\n\n"
        "3 rows, 1 condition, in tables/run.parquet\n\n"
        "| level | rule | place | asset | column | finding |\n"
        "| --- | --- | --- | --- | --- | --- |\n"
        "| warning | identical-rows | row 3 | Run_2 |  | the same as row 0: 50%, a\\|b. |\n\n"
        "Nothing found in walk (1 row, 2 conditions).\n"
    )


def test_a_long_report_fits_a_comment_and_says_what_it_leaves_out():
    text = render_markdown.render(many(50, n_tables=400))
    assert len(text.encode()) < 65_536
    shown = text.count("| line ")
    assert f"{400 * 50 - shown:,} findings not shown; `contextdb check --all` shows every one." in text
    assert "| error | empty-cell | | | | … and 49 more |" in text
