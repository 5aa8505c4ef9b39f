"""Recordings of a link are files of contexts: read like any others, while they grow too, and told of where they are damaged."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from links import CELLS, FACTS, SCHEMA, meeting, table
from running import run

import contextdb as cdb
from contextdb.telemetry import observe
from contextdb.telemetry.contexts import read_contexts
from contextdb.telemetry.link import recorded
from contextdb.telemetry.recordings import open_recording
from tui.model.context_list import ContextList

__all__ = ["meeting"]
HEADER: dict[str, Any] = {"line": "header", "format": 1, "game": "game", "pid": 1, "contextdb": "x", "began": 0}
TABLES = {"jog": {"version": "v", "rows": 3, "conditions": {"speed": "number", "gait": "enum"}}}


def ask(facts: dict[str, object], name: str = "jog") -> dict[str, object]:
    return {"line": "ask", "t": 1.0, "who": "a", "table": name, "facts": facts, "rows": "0", "valid": 0}


def written(path: Path, *lines: object, end: str = "\n") -> Path:
    texts = [line if isinstance(line, str) else json.dumps(line) for line in lines]
    path.write_text("\n".join(texts) + end, encoding="utf-8")
    return path


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A recording of four questions of two tables."""
    header = HEADER | {"tables": TABLES | {"other": {"conditions": {"x": "bool"}}}}
    lines = [
        header,
        ask(FACTS),
        ask({"x": True}, "other"),
        {"line": "pick", "t": 1, "who": "a", "table": "jog", "pick": {"asset": "walk"}},
    ]
    lines += [ask({"speed": 0.2, "gait": "Half Way"}), {"line": "lost", "count": 3}, ask({"gait": "Idle", "speed": None, "hp": 3})]
    return written(tmp_path / "moments.jsonl", *lines)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the table."""
    rows = [",".join(CELLS), *(",".join(cells) for cells in zip(*CELLS.values(), strict=True))]
    written(tmp_path / "jog.csv", *rows)
    gait = '[conditions.gait]\ntype = "enum"\nvalues = ["Idle", "Walk", "Half Way"]'
    written(tmp_path / "contextdb.toml", '[conditions.speed]\ntype = "number"', gait)
    return tmp_path


def test_a_recording_from_python_is_what_was_asked(meeting: Path, tmp_path: Path):
    jog, asked = table(), [{"speed": i / 7, "gait": gait} for i in range(30) for gait in ("Idle", "Half Way")]
    with cdb.link("game", record=tmp_path / "m.jsonl") as link:
        link.watch(jog)
        answers = [jog.query(facts) for facts in asked]
    contexts = read_contexts(tmp_path / "m.jsonl", jog)
    assert contexts.facts.rows(named=True) == asked
    assert [rows.tolist() for rows in contexts.ask(jog, "error").lists()] == [answer.indices.tolist() for answer in answers]


def test_the_questions_of_a_table_are_its_contexts(file: Path):
    contexts = read_contexts(file, table())
    assert contexts.facts.select("speed", "gait").rows() == [(2.5, "Walk"), (0.2, "Half Way"), (None, "Idle")]
    assert contexts.ask(table(), "any").counts.tolist() == [2, 0, 3]


@pytest.mark.parametrize("n_bytes", [1, 100, 1 << 20])
def test_a_recording_is_read_in_pieces(file: Path, monkeypatch: pytest.MonkeyPatch, n_bytes: int):
    monkeypatch.setattr(recorded, "BYTES", n_bytes)
    contexts = read_contexts(file, table())
    assert contexts.facts.select("speed", "gait").rows() == [(2.5, "Walk"), (0.2, "Half Way"), (None, "Idle")]
    with pytest.raises(cdb.ContextError, match=r"moments\.jsonl, line 7, "):
        contexts.ask(table(), "error")


def test_telemetry_reads_recordings(file: Path):
    seen = observe(table(), file)
    assert (seen.rows, seen.moments, seen.uncovered) == (3, 3, 2)
    assert seen.unknown_columns == ("hp",)
    assert [note.condition for note in seen.missing] == ["speed"]


def test_evaluate_and_coverage_read_recordings(file: Path, folder: Path):
    done = run("evaluate", folder / "jog.csv", file, "--unknown", "any", "--json")
    assert (done.code, done.json["contexts"], done.json["without_asset"]) == (0, 3, 1)
    done = run("coverage", folder / "jog.csv", "--telemetry", folder / "*.jsonl", "--format", "json")
    assert done.json["tables"][0]["telemetry"]["rows"] == 3


def test_the_editor_opens_recordings(file: Path, folder: Path):
    opened = ContextList.open(file, cdb.load(folder / "jog.csv"))
    assert len(opened.rows) == 3
    assert [opened.rows.facts(i, opened.conditions) for i in range(3)] == [
        {"speed": "2.5", "gait": "Walk"}, {"speed": "0.2", "gait": "Half Way"}, {"gait": "Idle"}
    ]  # fmt: skip
    assert np.concatenate(list(open_recording(file, {"gait"}, "jog").search("idle"))).tolist() == [2]


@pytest.mark.parametrize("half", ['{"line":"ask","t":1', "{", '{"line":"ask","t":1,"who":"\\ud8'])
def test_a_last_line_that_is_half_written_is_left_out(file: Path, half: str):
    whole = file.read_text()
    file.write_text(whole + half)
    assert len(read_contexts(file, table()).facts) == 3
    assert open_recording(file, {"speed"}, "jog").n_rows == 3
    file.write_text(whole + json.dumps(ask(FACTS)))
    assert len(read_contexts(file, table()).facts) == 4


def test_a_recording_that_grows_is_read_as_far_as_it_is_written(file: Path):
    raw = file.read_bytes()
    counts = set()
    for stop in range(raw.index(b"\n") + 1, len(raw) + 1):
        file.write_bytes(raw[:stop])
        counts.add(len(read_contexts(file, table()).facts))
    assert counts == {0, 1, 2, 3}


def test_damaged_lines_are_told_with_their_numbers(file: Path):
    lines = file.read_text().splitlines()
    lines[1:1] = ["{broken", '{"line":"ask"}', ""]
    lines.insert(6, json.dumps(ask({"speed": [3]})))
    lines.insert(8, json.dumps(ask({"gait": "\ud800"})))
    written(file, *lines)
    with pytest.raises(cdb.TableError) as refused:
        read_contexts(file, table())
    assert [fault.place.line for fault in refused.value.faults] == [2, 3, 7, 9]
    assert "is not JSON" in str(refused.value)
    with pytest.raises(cdb.TableError):
        open_recording(file, {"speed"}, "jog")
    with pytest.raises(cdb.FileError, match="line 2"):
        observe(table(), file)
    done = run("evaluate", "jog", file)
    assert done.code == 2


def test_of_many_damaged_lines_some_are_told_and_how_many_more(file: Path):
    written(file, HEADER | {"tables": TABLES}, *(["x"] * 50))
    with pytest.raises(cdb.TableError, match="30 more lines cannot be read"):
        read_contexts(file, table())


@pytest.mark.parametrize("first", ["", '{"a":1}', '{"line":"end"}', "speed,gait\n1,Walk", "PK\x03\x04"])
def test_what_is_no_recording_is_refused(tmp_path: Path, first: str):
    with pytest.raises(cdb.TableError, match=r"m\.jsonl, line 1: this is not a recording of a link"):
        read_contexts(written(tmp_path / "m.jsonl", first), table())


def test_a_newer_format_is_refused_with_its_number(tmp_path: Path):
    with pytest.raises(cdb.TableError, match="format 2, and this contextdb reads format 1"):
        read_contexts(written(tmp_path / "m.jsonl", HEADER | {"format": 2, "tables": TABLES}), table())


def test_a_recording_of_other_tables_is_refused_and_those_are_named(file: Path):
    other = cdb.Table.from_columns({"Asset": ["a"]}, SCHEMA, name="tackle").compile()
    for read in (lambda: read_contexts(file, other), lambda: open_recording(file, {"speed"}, "tackle")):
        with pytest.raises(cdb.TableError, match=r'no line is about the table "tackle".*"jog", "other"'):
            read()


def test_a_table_that_was_watched_and_not_asked_has_no_contexts(tmp_path: Path):
    empty = written(tmp_path / "m.jsonl", HEADER | {"tables": TABLES})
    assert len(read_contexts(empty, table()).facts) == 0
    assert run("evaluate", "locomotion", tmp_path / "none.jsonl").code == 2


def test_several_recordings_in_one_file_are_read(file: Path):
    file.write_text(file.read_text() * 2)
    assert len(read_contexts(file, table()).facts) == 6


def test_a_fact_that_a_table_cannot_use_is_told_with_its_line(file: Path):
    written(file, HEADER | {"tables": TABLES}, ask({"speed": 1, "gait": "Wolk"}), ask({"speed": {"cell": "0..5"}, "gait": "Walk"}))
    with pytest.raises(cdb.ContextError) as refused:
        read_contexts(file, table())
    assert [(fault.place.line, fault.place.column) for fault in refused.value.faults] == [(2, "gait"), (3, "speed")]


def test_a_recording_that_was_cut_after_it_was_opened_is_told(file: Path):
    opened = open_recording(file, {"speed"}, "jog")
    file.write_bytes(b"x" * file.stat().st_size)
    with pytest.raises(cdb.TableError, match="has been changed"):
        opened.read(0, 3)
    file.unlink()
    with pytest.raises(cdb.FileError):
        opened.read(0, 3)
    with pytest.raises(cdb.FileError):
        open_recording(file, {"speed"}, "jog")
