"""`contextdb live`: what a game in another process asks and picks."""

import json
import os
import re
import shlex
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from running import ROOT, run, run_process
from telemetry.links import meeting
from warm_start import python

import contextdb as cdb
from contextdb.commands.live_command import Changes
from contextdb.telemetry.link.lines import Line

__all__ = ["meeting"]
pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="sockets in folders of a user are of Unix")

GAME = """
import sys, threading, contextdb as cdb
compiled = cdb.load(sys.argv[2]).compile()
with cdb.link(sys.argv[1], per_second=60) as link:
    link.watch(compiled, "player")
    live = compiled.live({"gait": "Walk", "speed": 1.3, "direction": 0.0, "style": "normal"})
    link.watch(live, "npc")
    print(link.name, flush=True)
    stop = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), stop.set()), daemon=True).start()
    frame = 0
    while not stop.wait(0.004):
        compiled.pick({"gait": "Idle" if frame % 4 < 2 else "Walk", "speed": 0.0, "direction": 0.0, "style": "normal"}, rng=frame)
        live["speed"] = 1.0 + frame % 50 / 100
        compiled.pick(live.matches(), rng=frame)
        frame += 1
"""
LOCOMOTION = ROOT / "tables" / "locomotion.csv"


@contextmanager
def game(name: str = "game", table: Path = LOCOMOTION) -> Iterator[subprocess.Popen[str]]:
    """A game in another process, which runs until its standard input is closed."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = python("-c", GAME, name, table)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield process
        finally:
            process.kill()


def end(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.close()
    process.wait()


LINE = re.compile(r" *\d+\.\d{3}  (player|npc)  locomotion  (\w+ \(row \d+\)|-)  (\d+) of 28 valid(?:  (.*))?")


def test_a_line_says_who_asked_what_was_picked_and_which_facts_changed(meeting: Path):
    with game():
        done = run("live", "game", "--most", "12")
    assert done.code == 0
    lines = [match for text in done.lines if (match := LINE.fullmatch(text))]
    assert len(lines) == len(done.lines) == 12
    assert {line[1] for line in lines} == {"player", "npc"}
    first = next(line for line in lines if line[1] == "npc")
    assert [word.partition("=")[0] for word in shlex.split(first[4])] == ["gait", "speed", "direction", "style"]
    later = [line for line in lines if line[1] == "npc" and line is not first]
    assert all(line[4] is None or line[4].startswith("speed=") for line in later)
    asked = run("query", LOCOMOTION, *shlex.split(first[4]), "--json")
    assert asked.json["count"] == int(first[3])


def test_the_page_shows_lines_as_they_are_printed_with_what_the_sample_table_answers():
    page = (ROOT / "docs" / "live.md").read_text(encoding="utf-8").replace("npc 7", "npc")
    lines = [match for text in page.splitlines() if (match := LINE.fullmatch(text))]
    assert len(lines) == 4
    for line in lines:
        if "gait=" in line[4]:
            asked = run("query", LOCOMOTION, *shlex.split(line[4]), "--json").json
            assert asked["count"] == int(line[3])
            assert line[2] in [f"{row['asset']} (row {row['row'] + 1})" for row in asked["matches"]]


def test_filters_by_character_and_table(meeting: Path):
    with game():
        done = run("live", "--who", "npc", "--table", "locomotion", "--most", "4")
    assert {match[1] for text in done.lines if (match := LINE.fullmatch(text))} == {"npc"}


def test_nobody_there_is_an_error_that_names_the_games_that_are(meeting: Path):
    done = run("live")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("contextdb: no game is running.")
    done = run("live", "game")
    assert (done.code, done.err) == (2, 'contextdb: no game "game" is running, nor any other.\n')
    with cdb.link("gamma"):
        done = run("live", "gama")
    assert (done.code, done.err) == (2, 'contextdb: no game "gama" is running. Accepted: "gamma". Did you mean "gamma"?\n')


def test_several_games_are_listed(meeting: Path):
    with cdb.link("one") as link, cdb.link("two"):
        link.watch(cdb.load(LOCOMOTION).compile())
        done = run("live")
    assert (done.code, done.err) == (0, "")
    assert [line.split() for line in done.lines] == [
        ["game", "process", "tables"], ["one", str(os.getpid()), "locomotion"], ["two", str(os.getpid())]
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["--explain"], "--tables FOLDER with it"),
        (["--most", "0"], "not a number of lines"),
        (["--tables", "nowhere"], "nowhere"),
        (["../x"], 'no game "../x"'),
    ],
)
def test_bad_use_is_refused(meeting: Path, arguments: list[str], why: str):
    done = run("live", *arguments)
    assert done.code == 2
    assert why in done.err


def test_a_recording_has_every_question_and_evaluate_reads_it(meeting: Path, tmp_path: Path):
    file = tmp_path / "session.jsonl"
    with game():
        done = run("live", "game", "--record", file, "--most", "30")
    assert done.code == 0
    lines = [json.loads(text) for text in file.read_text().splitlines()]
    assert lines[0]["line"] == "header"
    n_asked = sum(line["line"] == "ask" for line in lines)
    assert n_asked >= 30
    evaluated = run("evaluate", LOCOMOTION, file, "--json")
    assert (evaluated.code, evaluated.json["contexts"]) == (0, n_asked)
    with game():
        again = run("live", "game", "--record", file, "--most", "1")
    assert again.code == 2
    assert "there already" in again.err


def test_its_own_tables_say_why_and_whether_the_game_has_others(meeting: Path, tmp_path: Path):
    written = (ROOT / "tables" / "contextdb.toml").read_text().partition("[tables.")[0]
    (tmp_path / "contextdb.toml").write_text(written)
    (tmp_path / "locomotion.csv").write_bytes(LOCOMOTION.read_bytes())
    with game(table=tmp_path / "locomotion.csv"):
        same = run("live", "game", "--tables", tmp_path, "--explain", "--who", "npc", "--most", "2")
        assert (same.code, same.err) == (0, "")
        assert any(re.fullmatch(r" {11}\w+: .* the cell says .*", line) for line in same.lines)
        text = (tmp_path / "locomotion.csv").read_text()
        (tmp_path / "locomotion.csv").write_text(text + text.splitlines()[2] + "\n")
        other = run("live", "game", "--tables", tmp_path, "--who", "npc", "--most", "3")
    assert other.err.count("\n") <= 2
    assert 'the game has another version of "locomotion"' in other.err


def test_a_game_that_ends_and_one_that_is_killed_are_told(meeting: Path):
    for stop, said in ((end, 'the game "game" has ended.'), (subprocess.Popen.kill, 'the game "game" is gone.')):
        with game() as running:
            live = subprocess.Popen(
                python("-m", "contextdb", "live", "game"),
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                env={**os.environ, "PYTHONPATH": str(ROOT)},
            )
            assert live.stdout is not None
            live.stdout.readline()
            stop(running)
            _, told = live.communicate()
        assert (live.returncode, told) == (0, f"contextdb: {said}\n")


def test_ctrl_c_and_a_reader_that_has_read_enough_end_it_quietly(meeting: Path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = python("-m", "contextdb", "live", "game")
    for is_interrupted in (True, False):
        with (
            game(),
            subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment) as live,
        ):
            assert live.stdout is not None
            assert live.stderr is not None
            assert live.stdout.readline()
            if is_interrupted:
                live.send_signal(signal.SIGINT)
            else:
                live.stdout.close()
            assert live.stderr.read() == ""
            assert live.wait() == 0


def test_the_command_runs_in_a_process_of_its_own(meeting: Path):
    with game():
        done = run_process("live", "--most", "1")
    assert (done.code, done.err, len(done.lines)) == (0, "", 1)


# ---- what is printed of lines


def ask(**more: object) -> Line:
    facts = {"a": True, "b": 1.5}
    return {"line": "ask", "t": 1.0, "who": "p", "table": "x", "facts": facts, "rows": "3", "valid": 2} | more


def said(*lines: Line) -> list[str]:
    changes = Changes({}, False)
    return [text.strip() for line in lines for text in changes.of(line).lines]


def test_what_stays_as_it_was_is_not_printed_again():
    pick = {"row": 0, "asset": "walk"}
    assert said(ask(pick=pick), ask(pick=pick, t=2.0), ask(), ask(pick={"row": None, "asset": "none"})) == [
        "1.000  p  x  walk (row 1)  2 valid  a=True b=1.5",
        "1.000  p  x  none (fallback)  2 valid",
    ]


def test_facts_that_go_and_those_with_spaces_are_printed():
    assert said(ask(), ask(facts={"a": None, "c": "Half Way"}, rows="0", valid=0)) == [
        "1.000  p  x  -  2 valid  a=True b=1.5",
        """1.000  p  x  -  0 valid  a=? 'c="Half Way"' b=?""",
    ]


def test_a_pick_alone_is_printed_with_what_is_known():
    pick: Line = {"line": "pick", "t": 2.0, "who": "p", "table": "x", "pick": {"row": 1, "asset": "run"}}
    assert said(ask(), pick, pick)[1:] == ["2.000  p  x  run (row 2)  2 valid"]


def test_decisions_are_printed_where_they_change_what_plays():
    def decision(action: str, asset: str | None) -> Line:
        playing = None if asset is None else {"asset": asset, "database": "jog"}
        return {"line": "decision", "t": 1.0, "who": "p", "decision": {"action": action, "why": "So.", "playing": playing}}

    lines = [decision("starts", "a"), decision("plays on", "a"), decision("jumps", "b"), decision("loops", "b")]
    choice: Line = {
        "line": "decision",
        "t": 2.0,
        "who": "q",
        "decision": {"choice": {"hit": {"asset": "c"}, "reason": "lowest cost"}},
    }
    assert said(*lines, decision("plays nothing", None), choice, {"line": "decision", "t": 3.0, "who": "r", "decision": {}}) == [
        "1.000  p  starts a of jog: So.",
        "1.000  p  jumps b of jog: So.",
        "1.000  p  plays nothing nothing: So.",
        "2.000  q  lowest cost c",
        "3.000  r  None nothing",
    ]


def test_a_table_that_is_not_here_is_noted_once_and_lost_lines_are_counted():
    own = cdb.Table.from_columns({"Asset": ["a"]}, name="x").compile()
    changes = Changes({"x": own}, False)
    header = {"line": "tables", "tables": {"y": {"rows": 1}, "x": {"rows": 1, "version": "0" * 64}}}
    unknown, version = changes.of(header).notes
    assert unknown == '"y" is not one of your tables, so its answer is not compared.'
    assert version.startswith('the game has another version of "x": 00000000, yours is ')
    assert changes.of(header).notes == []
    assert changes.of({"line": "lost", "count": 2}).notes == ["2 lines lost: the game produced more than could be sent."]


def test_nothing_that_a_game_sends_moves_the_cursor_or_stops_the_listener():
    hostile = ask(who="\x1b[2J", table="x\n", facts={"\x07": "\x1b]0;x\x07", "z": {"odd": 1}})
    lines = said(hostile, {"line": "weather"})
    assert len(lines) == 1
    assert all(character.isprintable() for character in lines[0])
    own = cdb.Table.from_columns({"Asset": ["a"]}, name="x").compile()
    assert Changes({"x": own}, True).of(ask(facts={"z": {"odd": 1}})).notes == ['your "x" cannot answer that: this is not a fact.']
    assert "cannot answer" in Changes({"x": own}, True).of(ask(actors={"A": [{"hp": 3}]})).notes[0]
    assert Changes({"x": own}, True).of(ask(rows="0")).notes == ['your "x" answers differently from the game\'s.']


@pytest.mark.parametrize("fault", [TypeError, ValueError, AttributeError])
def test_a_fault_of_our_own_is_not_taken_for_a_line_that_cannot_be_asked(monkeypatch: pytest.MonkeyPatch, fault: type[Exception]):
    own = cdb.Table.from_columns({"Asset": ["a"]}, name="x").compile()

    def broken(*arguments: object, **named: object) -> object:
        raise fault("of our own")

    monkeypatch.setattr(cdb.CompiledTable, "explain", broken)
    with pytest.raises(fault, match="of our own"):
        Changes({"x": own}, True).of(ask())
