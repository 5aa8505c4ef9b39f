"""The work on gaps: what is written is read, versions merge gap by gap, gaps that shrink stay who has them, reports say so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from terminal import alone, drive, press, said, screen_text, settled, with_editor

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.edits.renaming import renaming
from contextdb.edits.renaming_values import value_renaming
from contextdb.errors import FileError
from contextdb.tables.gap_work import STATES, GapWork, Work, gaps_path, key_of, merge_gap_work, write_work
from contextdb.tables.project import load_table
from tui.app import EditorApp
from tui.model.sheet import READS_ONLY
from tui.model.workspace import Workspace

CELLS = st.dictionaries(
    st.sampled_from(["gait", "speed", "State", 'a "b"', "é,"]), st.sampled_from(["Walk", "2..7", '"x, y"', "(1..3]"])
)
WORKS = st.builds(Work, st.sampled_from(STATES), st.sampled_from(["", "Ana", "Søren, B"]))
FILES = st.dictionaries(CELLS.map(key_of), WORKS, max_size=6)
TOML = """[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
[conditions.speed]
type = "number"
min = 0
max = 10
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "contextdb.toml").write_text(TOML)
    (tmp_path / "t.csv").write_text("Asset,gait,speed\nwalk,Walk,0..4\nrun,Run,2..10\n")
    return tmp_path / "t.csv"


@given(FILES, FILES, FILES)
def test_what_is_written_is_read_and_three_versions_merge_gap_by_gap(base: dict, ours: dict, theirs: dict):
    raws = [GapWork(lines).to_bytes() for lines in (base, ours, theirs)]
    assert [dict(GapWork.of(raw, "f").lines) for raw in raws] == [base, ours, theirs]
    keys = {*base, *ours, *theirs}
    both = {key for key in keys if ours.get(key) != theirs.get(key) and base.get(key) not in (ours.get(key), theirs.get(key))}
    for takes in (None, "ours", "theirs"):
        if both and takes is None:
            with pytest.raises(FileError, match="changed on both sides"):
                merge_gap_work(raws, ["b", "o", "t"])
            continue
        expected = {}
        for key in keys:
            is_ours = takes == "ours" if key in both else ours.get(key) != base.get(key)
            work = (ours if is_ours else theirs).get(key)
            expected |= {} if work is None else {key: work}
        assert dict(GapWork.of(merge_gap_work(raws, ["b", "o", "t"], takes), "f").lines) == expected


def test_a_gap_that_rows_made_smaller_stays_with_its_owner_and_one_that_is_closed_is_named(path: Path):
    whole, other = {"gait": "Walk", "speed": "(4..10]"}, {"speed": "9..10"}
    work = write_work(path, whole, Work("animating", "Ana"))
    work = write_work(path, other, Work("open"))
    conditions = [column.condition for column in load_table(path).conditions]
    assert work.of_gaps([{"gait": "Walk", "speed": "(6..10]"}, {"gait": "Run"}], conditions) == (
        [Work("animating", "Ana"), None],
        [key_of(other)],
    )
    assert write_work(path, other, None).lines == {key_of(whole): Work("animating", "Ana")}


BAD = (
    (b"State,Owner,gait\nworking,Ana,Walk\n", '"working" is no state of a gap. Accepted: open, animating, done.'),
    (b"State,Owner,gait\nopen,Ana,Walk\nopen,,Walk\n", "the gap is there twice"),
    (b"State,Owner,gait\nopen,A\x1bna,Walk\n", "the owner is no name"),
    (b"State,Owner,gait\nopen\n", "the line has 1 cells"),
    (b"State,Owner,gait,gait\nopen,,,\n", "not a file of gaps"),
    (b"<<<<<<< ours\n", "not a file of gaps"),
    (b"\xff\xfe", "not a file of gaps"),
    (b'State,Owner\n"', "not a file of gaps"),
    (b"State,Owner\n" + b"open,\n" * 10_001, "not a file of gaps"),
)


def test_a_bad_file_is_a_message_in_check_and_in_coverage(path: Path):
    for raw, message in BAD:
        gaps_path(path).write_bytes(raw)
        with pytest.raises(FileError, match=re.escape(message)):
            GapWork.beside(path)
    measured, checked = run("coverage", str(path)), run("check", str(path))
    assert measured.code == 2
    assert BAD[-1][1] in measured.err
    assert BAD[-1][1] in " ".join(checked.out.split())


def test_the_report_names_state_and_owner_and_a_rename_goes_into_the_file(path: Path):
    write_work(path, {"gait": "Walk", "speed": "(4..10]"}, Work("animating", "Ana"))
    write_work(path, {"gait": "Swim"}, Work("done"))
    text = run("coverage", str(path)).out
    assert "[animating Ana]" in " ".join(text.split())
    assert "no gap any more: gait: Swim [done]" in " ".join(text.split())
    table = run("coverage", str(path), "--json").json["tables"][0]
    ids = [gap["id"] for gap in table["gaps"]["items"] if gap["cells"] == {"gait": "Walk", "speed": "(4..10]"}]
    assert table["work"] == [{"gap": ids[0], "state": "animating", "owner": "Ana"}]
    assert "Work on it: animating Ana" in run("coverage", str(path), "--gap", ids[0]).out
    renaming(load_table(path), "gait", "pace").write()
    value_renaming(load_table(path), "pace", "Walk", "Stroll").write()
    lines = [dict(key) for key in GapWork.beside(path).lines]
    assert {"pace": "Stroll", "speed": "(4..10]"} in lines


def test_the_editor_gives_states_and_owners_in_the_tab_and_writes_what_others_wrote_too(path: Path):
    async def script(app, pilot):
        await press(pilot, "alt+4")
        app.main.coverage.join(20)
        await settled(pilot)
        await press(pilot, "s", "s", "w", *"Ana", "enter")
        write_work(path, {"gait": "Run"}, Work("open", "Bo"))
        await press(pilot, "down", "s")
        await settled(pilot)
        screen = screen_text(app)
        await press(pilot, "s", "s")
        return screen

    screen = with_editor(path, script, (120, 30))
    assert "animating Ana" in screen
    works = sorted(work.text for work in GapWork.beside(path).lines.values())
    assert works == ["animating Ana"]  # the second gap was part of Bo's, was taken on as animating, and then off the list


def test_opening_the_tab_writes_nothing_and_the_next_change_takes_what_a_saved_change_has_closed_off_the_list(path: Path):
    for cells, owner in (({"gait": "Walk", "speed": "(4..10]"}, "Ana"), ({"gait": "Run", "speed": "[0..2)"}, "Bo")):
        write_work(path, cells, Work("animating", owner))
    raw = gaps_path(path).read_bytes()

    async def script(app, pilot):
        async def measured() -> str:
            await press(pilot, "alt+4")
            app.main.coverage.join(20)
            await settled(pilot)
            await settled(pilot)
            return screen_text(app)

        await press(pilot, "right", "right", *"Any", "enter", "alt+1", *"1..10", "enter")  # walk at any speed, run from 1 on
        await measured()
        await press(pilot, "s")
        unsaved = said(app), sorted(work.text for work in GapWork.beside(path).lines.values())
        gaps_path(path).write_bytes(raw)
        await press(pilot, "ctrl+s")
        opened, is_as_it_was = await measured(), gaps_path(path).read_bytes() == raw
        await press(pilot, "s")
        return unsaved, opened, is_as_it_was, said(app)

    unsaved, opened, is_as_it_was, message = with_editor(path, script, (120, 30))
    assert unsaved == ("The gap is done Bo.", ["animating Ana", "done Bo"])
    assert "animating Bo" in opened
    assert "Ana" not in opened
    assert is_as_it_was
    assert message == "The gap is done Bo. Closed, and off the list, too: gait: Walk, speed: (4..10]."
    assert [work.text for work in GapWork.beside(path).lines.values()] == ["done Bo"]


def test_who_only_reads_changes_no_work(path: Path):
    async def script(app, pilot):
        await press(pilot, "alt+4")
        app.main.coverage.join(20)
        await settled(pilot)
        await press(pilot, "s")
        by_state = said(app)
        await press(pilot, "w")
        return by_state, said(app)

    app = EditorApp(Workspace(path, reads_only=True))
    with alone(path.parent):
        try:
            messages = drive(app, lambda pilot: script(app, pilot), (120, 30))
        finally:
            app.workspace.close()
    assert messages == (READS_ONLY, READS_ONLY)
    assert not gaps_path(path).exists()


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), max_size=3), st.tuples(st.integers(0, 5), st.integers(0, 5)))
def test_a_line_is_closed_where_no_context_of_it_is_in_a_gap(gaps: list[tuple[int, int]], line: tuple[int, int]):
    def cells(span: tuple[int, int]) -> dict[str, str]:
        return {"speed": f"{min(span)}..{max(span)}"}

    conditions = [Condition("speed", Domain("number", 0, 10))]
    work = GapWork({key_of(cells(line)): Work("open")})
    is_met = any(min(gap) <= max(line) and min(line) <= max(gap) for gap in gaps)
    assert bool(work.closed(map(cells, gaps), conditions)) == (not is_met)
