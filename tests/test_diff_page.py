"""The page of `contextdb diff`: cells, meaning, contracts and recorded moments, with nothing that a table could make markup of."""

import re

import pytest

from tests.running import run

TOML = """\
[conditions.speed]
type = "number"
min = 0
max = 10
owner = "animation"

[tables.moves]
owner = "combat"

[contracts.fast]
table = "moves"
when = "speed > 8"
some = "asset like 'run*'"
why = "Nobody who is fast stands."
"""


@pytest.fixture
def versions(tmp_path):
    for name, cells in (("a", ("0..5", "5..10")), ("b", ("0..4", "5..7"))):
        (tmp_path / name).mkdir()
        (tmp_path / name / "contextdb.toml").write_text(TOML)
        (tmp_path / name / "moves.csv").write_text(f"Asset,speed\n<b>walk</b>,{cells[0]}\nrun,{cells[1]}\n")
    (tmp_path / "seen.csv").write_text("speed\n4.5\n9\n1\n1\n")
    return tmp_path / "a" / "moves.csv", tmp_path / "b" / "moves.csv", tmp_path / "seen.csv"


def test_a_review_opens_cells_meaning_contracts_and_moments(versions):
    before, after, seen = versions
    page = before.parent / "review.html"
    done = run("diff", before, after, "--telemetry", seen, "--max-emptied", "10", "--format", "html", "-o", page)
    assert (done.code, done.out) == (1, "")
    text = page.read_text(encoding="utf-8")
    for words in (
        "<h1>Diff of moves</h1>",
        "<td>0..5</td><td>0..4</td>",
        "Owned: the table by combat, speed by animation.",
        "<h3>What it does</h3>",
        "gaps opened",
        '<td class="k">fast</td><td class="k">holds</td><td class="k">broken</td>',
        "Nobody who is fast stands.",
        "Of 4 recorded moments: 50.00 % change, 50.00 % are left without a row.",
        '<span class="failed">Failed</span> max-emptied',
        "&lt;b&gt;walk&lt;/b&gt;",
    ):
        assert words in text, words
    assert "<b>" not in text
    assert not re.search(r"(?:src|href)=.?https?:", text)


def test_the_page_of_no_change_says_so(versions):
    before, *_ = versions
    done = run("diff", before, before, "--format", "html")
    assert done.code == 0
    assert "<td>" not in done.out.partition("<h3>Contracts</h3>")[0]


def test_text_and_markdown_say_who_answers(versions):
    before, after, _ = versions
    for name in ("text", "markdown"):
        assert "Owned: the table by combat, speed by animation." in run("diff", before, after, "--format", name).out
