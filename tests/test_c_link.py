"""The live link in C: the same lines, by a program that never waits for who reads them."""

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from c_compilers import CXX, PROGRAMS, C, built, compiler_for, sanitizers
from running import run
from telemetry.links import LIMIT_S, meeting, until

import contextdb as cdb
from contextdb.cells.facts import read_fact
from contextdb.compiled.c_header import c_header_of, c_link_of
from contextdb.telemetry.link.doors import connected
from contextdb.telemetry.link.hearing import Wanted, games, hear
from contextdb.telemetry.link.lines import given_fact

__all__ = ["meeting"]
pytestmark = pytest.mark.skipif(os.name == "nt", reason="there is no link in C on Windows")

SCHEMA: dict[str, dict[str, object]] = {
    "ok": {"type": "bool"},
    "n": {"type": "int"},
    "speed": {"type": "number"},
    "heading": {"type": "angle"},
    "day": {"type": "date"},
    "state": {"type": "enum", "values": ["A", "B"]},
    "word": {"type": "text"},
    "moves": {"type": "tags", "values": ["Move.Run", "InAir"]},
}
CELLS = {name: ["Any"] * 70 for name in SCHEMA} | {"speed": ["<3"] * 69 + ["Any"], "ok": ["True"] + ["Any"] * 69}


@pytest.fixture(scope="session")
def game_table() -> cdb.CompiledTable:
    return cdb.Table.from_columns({"Asset": [f"a{r}" for r in range(70)]} | CELLS, SCHEMA, name="game").compile()


@pytest.fixture(scope="session")
def game(tmp_path_factory: pytest.TempPathFactory, game_table: cdb.CompiledTable) -> Path:
    """The program, with its artefact beside it."""
    folder = tmp_path_factory.mktemp("linked")
    game_table.save(folder / "game.safetensors")
    (folder / "tables.h").write_text(c_header_of({"game": game_table}), encoding="ascii")
    (folder / "cdb_link.h").write_text(c_link_of({"game": game_table}, "tables.h"), encoding="ascii")
    return built(PROGRAMS / "linked.c", folder / "linked.exe", C, *sanitizers(compiler_for(C)))


@contextmanager
def running(program: Path, frames: int, name: str = "game") -> Iterator[subprocess.Popen[str]]:
    command = [str(program), str(program.parent / "game.safetensors"), name, str(frames)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def named(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def test_what_a_game_in_c_tells_is_what_python_would(game: Path, game_table: cdb.CompiledTable, meeting: Path, tmp_path: Path):
    with running(game, 20) as process:
        assert named(process) == "game"
        done = run("live", "game", "--record", tmp_path / "m.jsonl")
        assert process.wait(LIMIT_S) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert done.code == 0
    assert len(done.lines) in (18, 19, 20)  # a look at who is there has taken the others
    assert done.err == 'contextdb: the game "game" has ended.\n'
    header, *asks, end = [json.loads(text) for text in (tmp_path / "m.jsonl").read_text().splitlines()]
    conditions = {name: settings["type"] for name, settings in SCHEMA.items()}
    assert header["tables"] == {"game": {"version": None, "rows": 70, "conditions": conditions}}
    assert end == {"line": "end"}
    numbers = [line["facts"]["n"] for line in asks]
    assert numbers == list(range(20 - len(asks), 20))
    for i, line in zip(numbers, asks, strict=True):
        facts = {name: read_fact(given_fact(value), game_table.asked[name]) for name, value in line["facts"].items()}
        assert facts == {
            "ok": i % 2 == 1,
            "n": i,
            "speed": i / 2,
            "heading": -90.0,
            "day": read_fact("2024-02-29", game_table.asked["day"]),
            "state": "B",
            "word": 'say "no"\né?',
            "moves": frozenset(["Move.Run"]),
        }
        answer = game_table.query(facts)
        assert (int(line["rows"], 16), line["valid"]) == (answer.bits, len(answer))
        assert line["pick"] == {"row": answer.indices[0], "asset": answer.assets[0]}
    assert run("evaluate", game.parent / "game.safetensors", tmp_path / "m.jsonl", "--json").json["contexts"] == len(asks)


def test_games_in_c_and_python_share_the_folder_and_its_names(game: Path, meeting: Path):
    with cdb.link("game"), running(game, 100_000) as two:
        assert named(two) == "game-2"
        with running(game, 100_000) as three:
            assert named(three) == "game-3"
            assert [each.name for each in games()] == ["game", "game-2", "game-3"]
            assert os.stat(meeting / "game-2.sock").st_mode & 0o777 == 0o600
            two.kill()
            two.wait()
            assert [each.name for each in games()] == ["game", "game-3"]
            with running(game, 1) as again:
                assert named(again) == "game-2"


@pytest.mark.parametrize("name", ["../game", "", "a/b", "x" * 41, ".x"])
def test_what_could_be_a_path_is_no_name_in_c(game: Path, meeting: Path, name: str):
    with running(game, 1, name) as process:
        assert process.wait(LIMIT_S) == 4


def test_a_folder_that_others_may_open_is_refused_in_c(game: Path, meeting: Path):
    meeting.mkdir()
    meeting.chmod(0o755)
    with running(game, 1) as process:
        assert process.wait(LIMIT_S) == 4


def test_a_file_in_place_of_a_socket_is_not_deleted_in_c(game: Path, meeting: Path):
    meeting.mkdir(mode=0o700)
    (meeting / "game.sock").write_text("mine")
    with running(game, 1) as process:
        assert named(process) == "game-2"
    assert (meeting / "game.sock").read_text() == "mine"


def test_a_listener_that_stalls_stops_no_game_in_c(game: Path, meeting: Path):
    with running(game, 1500) as process:
        name = named(process)
        path = meeting / f"{name}.sock"
        stalled = [connected(path) for _ in range(2)]
        until(lambda: process.poll() is not None)
        for one in stalled:
            one.close()
        assert process.returncode == 0


def test_lines_are_filtered_where_they_are_heard(game: Path, meeting: Path):
    with running(game, 5) as process:
        named(process)
        with hear(meeting / "game.sock", Wanted(who=["nobody"])) as hearing:
            assert [line["line"] for batch in hearing.batches() for _, line in batch] == ["end"]


def test_the_file_compiles_as_cpp_and_tells_the_facts_of_rules_and_not_derived_ones(tmp_path: Path):
    schema = {"class": {"type": "number"}, "gap": {"type": "number", "expr": "class * 2"}, "a.b": {"type": "tags"}}
    cells = {"Asset": ["a"], "gap": ["1.."], "a.b": ["+x"], "When": ["class > 1"]}
    plain = cdb.Table.from_columns(cells, schema, {"when": "When"}, name="open").compile()
    empty = cdb.Table.from_columns({"Asset": ["a"]}, {}, name='say "link"').compile()
    tables = {"open": plain, 'say "link"': empty}
    (tmp_path / "tables.h").write_text(c_header_of(tables), encoding="ascii")
    text = c_link_of(tables, "tables.h")
    (tmp_path / "cdb_link.h").write_text(text, encoding="ascii")
    assert text == c_link_of(tables, "tables.h")
    assert '"class"' in text.replace("\\042", '"')
    assert "gap" not in text
    source = tmp_path / "main.c"
    source.write_text(
        '#include "cdb_link.h"\nint main(void) { static cdbl_link link; return cdbl_open(&link, "/") + cdbl_listeners(&link); }\n'
    )
    for language in (C, CXX):
        program = built(source, tmp_path / "main.exe", language)
        assert subprocess.run([str(program)]).returncode == 0


def test_a_header_on_another_drive_is_included_by_its_whole_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def no_way(path: object, start: object) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr("contextdb.commands.compile_command.os.path.relpath", no_way)
    tables = Path(__file__).parent.parent / "tables"
    done = run("compile", tables, "-o", tmp_path, "--c-header", tmp_path / "tables.h", "--c-link", tmp_path / "cdb_link.h")
    assert done.code == 0, done.err
    assert f'#include "{(tmp_path / "tables.h").as_posix()}"' in (tmp_path / "cdb_link.h").read_text()


def test_compile_writes_it_beside_the_header(tmp_path: Path):
    tables = Path(__file__).parent.parent / "tables"
    done = run(
        "compile", tables, "-o", tmp_path, "--c-header", tmp_path / "a" / "tables.h", "--c-link", tmp_path / "b" / "cdb_link.h"
    )
    assert (done.code, done.lines[-2:]) == (0, [str(tmp_path / "a" / "tables.h"), str(tmp_path / "b" / "cdb_link.h")])
    assert '#include "../a/tables.h"' in (tmp_path / "b" / "cdb_link.h").read_text()
    alone = run("compile", tables, "-o", tmp_path, "--c-link", tmp_path / "x.h")
    assert (alone.code, alone.err) == (2, "contextdb: --c-link goes with the header. Accepted: --c-header FILE with it.\n")
    wrong = run("compile", tables, "-o", tmp_path, "--c-header", tmp_path / "t.h", "--c-link", tmp_path / "x.txt")
    assert wrong.code == 2


def test_a_game_in_c_publishes_poses_and_bones_to_each_who_comes(game: Path, meeting: Path, tmp_path: Path):
    for name in ("tables.h", "cdb_link.h"):
        (tmp_path / name).write_text((game.parent / name).read_text(encoding="ascii"), encoding="ascii")
    program = built(PROGRAMS / "posing.c", tmp_path / "posing.exe", C, *sanitizers(compiler_for(C)))
    with subprocess.Popen([str(program), "game", "100000"], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert named(process) == "game"
            path = meeting / "game.sock"
            for _ in range(2):
                with hear(path, Wanted(poses=True)) as hearing:
                    lines = [line for batch, _ in zip(hearing.batches(), range(8), strict=False) for _, line in batch]
                bones, pose = lines[:2]
                assert {"t": 0} | bones == {
                    "line": "bones", "t": bones["t"], "who": "player", "names": ["Hips", "Head"], "parents": [-1, 0],
                    "moving": [0, 1], "offsets": [[0.0] * 3] * 2,
                }  # fmt: skip
                assert pose["root"][1:] == [1.5, -0.25]
                assert pose["translations"] == [[0.0, 0.9, 0.0], [0.0, 0.7, 0.33333]]
                assert {line["line"] for line in lines[1:]} == {"pose"}
                assert all(line["asset"] in (None, "walk") for line in lines[1:])
                assert {line["rotations"][1][0] for line in lines[1:]} <= {0.0, 0.5}
            with hear(path, Wanted()) as silent, hear(path, Wanted(poses=True)) as hearing:
                next(hearing.batches())
                process.kill()
                assert [line for batch in silent.batches() for _, line in batch] == []
        finally:
            process.kill()
