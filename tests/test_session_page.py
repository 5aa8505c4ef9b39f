"""`contextdb motion replay --html` and `--markdown`: what is in the page, and, in a headless Chromium, that it plays and scrubs."""

import base64
import html
import json
import re
import shutil
import subprocess
import zlib
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from running import Result, run
from test_motion_measure_command import here, made

from contextdb.motion import Trace
from contextdb.report import session_html
from contextdb.report.session_data import ChangeLine, Detail, Moment, SessionView, document_of

__all__ = ["here", "made"]
"""Fixtures of another file."""

BROWSER = next((found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), None)


def replayed(*arguments: str, code: int = 0) -> Result:
    result = run("motion", "replay", *arguments)
    assert result.code == code, result.err
    return result


def document_in(page: str) -> dict[str, Any]:
    """What the script of a page reads."""
    found = re.search(r'<script type="application/json" id="session">(.*?)</script>', page, re.DOTALL)
    assert found
    document: dict[str, Any] = json.loads(found[1])
    return document


def values_of(column: dict[str, Any]) -> np.ndarray:
    """A column as the script unpacks it."""
    values = np.frombuffer(zlib.decompress(base64.b64decode(column["data"])), "<" + column["type"])
    if not column["delta"]:
        return values
    rows = values.reshape(-1, column["delta"])
    return np.cumsum(rows, axis=0, dtype=rows.dtype)


@pytest.fixture
def page(here: Path) -> str:
    replayed("session.parquet", "--html", "session.html")
    return (here / "session.html").read_text(encoding="utf-8")


def test_a_page_is_written_by_its_format_as_by_its_option(page: str, here: Path):
    assert replayed("session.parquet", "--format", "html", "-o", "same.html").out
    assert (here / "same.html").read_text(encoding="utf-8") == page
    assert "-o FILE with --format html" in replayed("session.parquet", "--format", "html", code=2).err
    assert "--format html with -o FILE" in replayed("session.parquet", "-o", "same.html", code=2).err
    assert replayed("session.parquet", "--format", "markdown").out == replayed("session.parquet", "--markdown").out


def test_the_page_opens_with_where_to_look_first_and_begins_there(page: str):
    found = re.search(r'<p>Look first at <a href="#t=([\d.]+)">[\d.]+ s</a>: ([^<]+)\.</p>', page)
    assert found
    assert document_in(page)["first_s"] == float(found[1])
    assert found[2].startswith(("what plays ends there", "a planted foot slides", "a joint accelerates"))


def test_the_page_holds_the_poses_that_motion_run_wrote(page: str, here: Path):
    poses = np.load(here / "poses.npz")
    session = document_in(page)["sessions"][0]
    assert (session["n"], session["rate"]) == (len(poses["positions"]), pytest.approx(30.0))
    root = values_of(session["columns"]["root"]) / [1000.0, 1000.0, 10_000.0]
    np.testing.assert_allclose(root[:, :2], poses["root"][:, :2], atol=6e-4)
    local = values_of(session["columns"]["positions"]).reshape(len(root), -1, 3) / 1000.0
    placed = local + np.stack((root[:, 0], np.zeros(len(root)), root[:, 1]), axis=1)[:, None]
    np.testing.assert_allclose(placed, poses["positions"], atol=2e-3)


def test_the_page_tells_what_the_command_line_tells(page: str):
    told = json.loads(replayed("session.parquet", "--json").out)["decisions"]
    session = document_in(page)["sessions"][0]
    names = [None if i < 0 else session["assets"][i] for i in values_of(session["columns"]["asset"])]
    assert names == [None if d["playing"] is None else d["playing"]["asset"] for d in told]
    changes = [d for d in told if d["action"] in ("starts", "jumps")]
    assert changes
    for decision in changes:
        assert f'href="#t={decision["time_s"]:.2f}"' in page
        assert html.escape(decision["why"]) in page


def test_the_measures_of_the_page_are_those_of_motion_measure(page: str):
    lines = run("motion", "measure", "session.parquet").lines
    jumps = next(line for line in lines if line.startswith("jumps a second")).split()[-1]
    assert f'<td>jumps a second</td><td class="n">{jumps}</td>' in page


def test_a_moment_holds_the_costs_that_the_session_recorded(page: str):
    session = document_in(page)["sessions"][0]
    trace = Trace.load("session.parquet")
    full = [moment for moment in session["moments"] if moment["candidates"]]
    assert full
    for moment in full:
        decision = trace[moment["i"]]
        (chosen,) = [each for each in moment["candidates"] if each["chosen"]]
        assert decision.cost == pytest.approx(chosen["cost"], rel=1e-5, abs=1e-6)
        assert sum(chosen["parts"]) == pytest.approx(chosen["cost"], rel=1e-4, abs=1e-5)


def test_two_sessions_stand_side_by_side(here: Path):
    replayed("session.parquet", "--diff", "session.parquet", "--html", "both.html")
    page = (here / "both.html").read_text(encoding="utf-8")
    assert len(document_in(page)["sessions"]) == 2
    assert "Both play the same." in page


def test_the_comment_has_the_measures_and_what_changed():
    out = replayed("session.parquet", "--html", "session.html", "--markdown").out
    assert out.startswith("## Session session.parquet\n")
    assert "| measure | session | raw clips |" in out
    assert "session.html, among the artefacts" in out
    assert "<details><summary>What changed in session.parquet" in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--html", "page.txt"], "a name that ends in .html"),
        (["--html", "nowhere/page.html"], 'there is no folder "nowhere"'),
        (["--markdown", "--at", "3"], "--markdown is of a whole session."),
        (["--html", "page.html", "--project", "nowhere"], "nowhere"),
    ],
)
def test_what_cannot_be_written_is_refused_in_a_sentence(arguments: list[str], said: str):
    result = replayed("session.parquet", *arguments, code=2)
    assert said in result.err
    assert not Path("page.html").exists()


def test_a_session_whose_project_is_gone_has_no_page(here: Path):
    shutil.move(here / "game", here / "moved")
    result = replayed("session.parquet", "--html", "page.html", code=2)
    assert "its poses cannot be made: its project is no longer at" in result.err


# ---- hostile names and sizes


HOSTILE = "</script><img src=x onerror=alert(1)>&amp;\u2028"


def view(n: int = 60, joints: int = 22, rate: float = 30.0, n_moments: int = 3) -> SessionView:
    rng = np.random.default_rng(5)
    return SessionView(
        name=HOSTILE,
        rate=rate,
        bones=[HOSTILE] * joints,
        parents=np.arange(joints) - 1,
        feet=[joints - 1],
        sides=[""] * joints,
        positions=np.cumsum(rng.normal(0.0, 0.004, (n, joints, 3)), axis=0),
        roots=np.cumsum(rng.normal(0.0, 0.02, (n, 3)), axis=0),
        bodies=None,
        contacts=rng.random((n, 1)) < 0.5,
        playing=[(HOSTILE, i / rate) for i in range(n)],
        flags=np.zeros(n, np.uint8),
        strips={"cost": rng.random(n)},
        moments=[Moment(i, HOSTILE, True, False, ((HOSTILE, HOSTILE),), ((HOSTILE, HOSTILE),), (), ()) for i in range(n_moments)],
        changes=[ChangeLine(i / rate, (HOSTILE, HOSTILE, "1", HOSTILE)) for i in range(n_moments)],
        measures={HOSTILE: (HOSTILE, "")},
    )


def test_names_are_text_wherever_they_stand():
    page = session_html.render([view()])
    assert "<img" not in page
    assert page.count("</script>") == 2
    assert document_in(page)["sessions"][0]["name"] == HOSTILE


def test_nothing_in_the_page_leads_out_of_it():
    page = session_html.render([view()])
    assert not re.search(r"https?:|@import|url\(|<(?:script|link|img|iframe|form|video)[^>]*(?:src|href|action)=", page)
    assert set(re.findall(r'href="(.)', page)) == {"#"}
    assert "default-src 'none'" in page


def test_a_minute_of_a_session_is_at_most_a_megabyte():
    page = session_html.render([view(n=1800, joints=65, n_moments=0)])
    assert len(page.encode()) <= session_html.BYTES_A_MINUTE


def test_a_rate_above_30_is_shown_thinned_and_no_jump_is_lost():
    shown = view(n=121, rate=60.0)
    flags = np.zeros(121, np.uint8)
    flags[[0, 33, 34, 120]] = 2
    document: Any = document_of([replace(shown, flags=flags)], next(Detail.most_first()))
    session = document["sessions"][0]
    assert (session["n"], session["rate"]) == (61, 30.0)
    assert np.flatnonzero(values_of(session["columns"]["flags"]) & 2).tolist() == [0, 17, 60]


# ---- in a browser


def dumped(address: str, milliseconds: int = 2000) -> str:
    """The page as a browser has it after some time."""
    assert BROWSER
    command = [
        BROWSER,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        f"--virtual-time-budget={milliseconds}",
        "--dump-dom",
        address,
    ]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", timeout=120, check=True).stdout


@pytest.mark.skipif(BROWSER is None, reason="there is no Chromium here")
def test_a_link_to_a_moment_shows_that_moment(page: str, here: Path):
    told = json.loads(replayed("session.parquet", "--json").out)["decisions"]
    jump = [d for d in told if d["action"] == "jumps"][-1]
    seen = dumped(f"{(here / 'session.html').as_uri()}#t={jump['time_s']:.2f}")
    assert f'<span id="clock">{jump["time_s"]:.2f} s of' in seen
    assert html.escape(jump["why"], quote=False) in seen
    assert f"{jump['playing']['asset']} at" in seen
    assert "data-ready" in seen


@pytest.mark.skipif(BROWSER is None, reason="there is no Chromium here")
def test_the_page_plays_by_itself_to_its_end(page: str, here: Path):
    told = json.loads(replayed("session.parquet", "--json").out)["decisions"]
    clock = "let now = 0; performance.now = () => now; requestAnimationFrame = (does) => setTimeout(() => does((now += 250)), 0);"
    played = here / "played.html"
    played.write_text(page.replace("<script>\n", f"<script>\n{clock}\n", 1), encoding="utf-8")
    last = told[-1]
    seen = dumped(played.as_uri(), 20_000)
    assert f'<span id="clock">{last["time_s"]:.2f} s of {last["time_s"]:.2f} s' in seen
    assert f"{last['playing']['asset']} at {last['playing']['time_s']:.2f} s" in seen


@pytest.mark.skipif(BROWSER is None, reason="there is no Chromium here")
def test_the_timeline_writes_names_whole_and_over_no_other(page: str, here: Path):
    noted = """const drawn = []; const pens = CanvasRenderingContext2D.prototype; const fill = pens.fillText;
    pens.fillText = function (text, x, y) { drawn.push([text, x, y, this.measureText(text).width]); fill.call(this, text, x, y); };
    pens.clip = () => drawn.push(["cut"]);
    setTimeout(() => (document.title = JSON.stringify(drawn)), 500);"""
    (here / "noted.html").write_text(page.replace("<script>\n", f"<script>\n{noted}\n", 1), encoding="utf-8")
    title = re.search(r"<title>(.*?)</title>", dumped(f"{(here / 'noted.html').as_uri()}#t=0"), re.DOTALL)
    assert title
    drawn = json.loads(html.unescape(title[1]))
    assert ["cut"] not in drawn
    session = document_in(page)["sessions"][0]
    names = [each for each in drawn if each[0] in session["assets"]]
    assert {session["assets"][i] for i in values_of(session["columns"]["asset"]) if i >= 0} <= {name for name, *_ in names}
    for y in {y for _, _, y, _ in names}:
        ends = [(at, at + width) for _, at, at_y, width in names if at_y == y]
        lines = sorted(set(ends))
        assert all(end <= start for (_, end), (start, _) in pairwise(lines))
