"""A screen that takes in what others write: merged, asked about, told once."""

import os
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from terminal import drive, screen_text
from textual.app import App
from textual.pilot import Pilot

from contextdb.errors import FileError
from tui.model.session import Session
from tui.screens.conflicts import ConflictsDialog
from tui.screens.disk_care import DiskCare

RAW = b"Asset,speed,hit\nwalk,0..5,True\nrun,5..9,Any\njump,Any,False\n"


class Host(App[None]):
    """An app that shows a session, and what it was told."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.session = Session(path)
        self.said: list[str] = []
        self.n_shown = 0

    def on_mount(self) -> None:
        self.care = DiskCare(self.screen, self.session, self.say, self.shown)

    def say(self, text: str, level: str = "information") -> None:
        self.said.append(text)

    def shown(self) -> None:
        self.n_shown += 1

    def looks(self, n: int = 2) -> None:
        """Look as often as a file needs to settle."""
        for _ in range(n):
            self.care.look()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_bytes(RAW)
    return file


def replace_file(file: Path, raw: bytes) -> None:
    other = file.with_name("other.tmp")
    other.write_bytes(raw)
    os.replace(other, file)


def run(path: Path, script: Callable[[Host, Pilot[None]], Awaitable[None]]) -> Host:
    app = Host(path)
    drive(app, lambda pilot: script(app, pilot))
    app.session.close()
    return app


def edit(app: Host, row: int, column: int, text: str) -> None:
    app.session.sheet.go(row, column)
    assert app.session.sheet.type_text(text) is None


def test_what_others_wrote_is_merged_and_told(path):
    async def script(app: Host, pilot: Pilot[None]) -> None:
        replace_file(path, RAW.replace(b"5..9", b"5..8"))
        app.looks(5)

    app = run(path, script)
    assert app.said == ["Merged from disk: 1 cell changed. Ctrl+Z undoes it."]
    assert app.n_shown == 1
    assert app.session.sheet.table.text(1, "speed") == "5..8"


def test_conflicts_are_asked_about_and_merged_as_decided(path):
    async def script(app: Host, pilot: Pilot[None]) -> None:
        edit(app, 1, 1, "1..2")
        replace_file(path, RAW.replace(b"5..9", b"5..8"))
        app.looks()
        await pilot.pause()
        assert isinstance(app.screen, ConflictsDialog)
        assert "5..8" in screen_text(app)
        app.looks()  # nothing happens under the dialog
        await pilot.press("right", "enter")
        await pilot.pause()
        assert app.session.sheet.table.text(1, "speed") == "5..8"

    app = run(path, script)
    assert not app.session.sheet.is_modified
    assert app.n_shown == 1


def test_what_a_merge_says_counts_only_what_changed_here(path):
    async def script(app: Host, pilot: Pilot[None]) -> None:
        edit(app, 1, 1, "1..2")
        replace_file(path, RAW.replace(b"5..9", b"5..8"))
        app.looks()
        await pilot.press("left", "enter")
        await pilot.pause()
        assert app.said == ["Merged from disk: nothing changes here."]
        edit(app, 1, 1, "1..3")
        replace_file(path, RAW.replace(b"5..9", b"5..7").replace(b"walk", b"amble"))
        app.looks()
        await pilot.press("left", "enter")
        await pilot.pause()

    assert run(path, script).said[1:] == ["Merged from disk: 1 row renamed. Ctrl+Z undoes it."]


def test_conflicts_left_alone_are_asked_about_again_only_by_a_save_or_another_change(path):
    async def script(app: Host, pilot: Pilot[None]) -> None:
        edit(app, 1, 1, "1..2")
        replace_file(path, RAW.replace(b"5..9", b"5..8"))
        app.looks()
        await pilot.press("escape")
        await pilot.pause()
        app.looks(5)
        assert not isinstance(app.screen, ConflictsDialog)
        app.care.save(then=lambda: app.said.append("saved"))
        await pilot.pause()
        await pilot.press("left", "enter")
        await pilot.pause()
        assert app.said[-1] == "saved"

    app = run(path, script)
    assert app.said[0] == "Nothing is merged. The next save asks again."
    assert path.read_bytes() == RAW.replace(b"5..9", b"1..2")


def test_a_save_goes_through_when_nothing_is_in_question(path):
    async def script(app: Host, pilot: Pilot[None]) -> None:
        edit(app, 1, 1, "1..2")
        app.care.save(then=lambda: app.said.append("saved"))

    assert run(path, script).said == ["saved"]
    assert path.read_bytes() == RAW.replace(b"5..9", b"1..2")


def test_a_save_that_the_disk_refuses_says_why(path):
    path.chmod(0o444)

    async def script(app: Host, pilot: Pilot[None]) -> None:
        edit(app, 1, 1, "1..2")
        with pytest.raises(FileError, match="read-only"):
            app.care.save()

    run(path, script)
    assert path.read_bytes() == RAW


def test_a_file_that_is_gone_or_no_table_is_told_once(path):
    async def script(app: Host, pilot: Pilot[None]) -> None:
        path.unlink()
        app.looks(5)
        path.write_bytes(b"A,B\nx\n")
        app.looks(5)

    said = run(path, script).said
    assert said[0] == "t.csv is no longer on disk. Saving creates it again."
    assert "found 1 field, the header has 2" in said[1]
    assert len(said) == 2


def test_a_save_over_what_is_no_table_says_so_each_time_and_can_be_forced(path):
    async def script(app: Host, pilot: Pilot[None]) -> None:
        edit(app, 1, 1, "1..2")
        path.write_bytes(b"A,B\nx\n")
        app.looks()
        for _ in range(2):
            with pytest.raises(FileError, match="cannot be read any more"):
                app.care.save()
        app.care.save(overwrite=True)

    run(path, script)
    assert path.read_bytes() == RAW.replace(b"5..9", b"1..2")


def test_a_changed_schema_is_read_anew_and_a_bad_one_told_once(path):
    toml = path.with_name("contextdb.toml")

    async def script(app: Host, pilot: Pilot[None]) -> None:
        toml.write_text('[conditions.speed]\ntype = "number"\n')
        app.looks(4)
        replace_file(toml, b"[conditions.speed]\ntype = 'nunber'\n")
        app.looks(4)

    app = run(path, script)
    assert app.said[0] == "contextdb.toml changed on disk and was read again."
    assert "nunber" in app.said[1]
    assert len(app.said) == 2
    assert app.session.sheet.table.condition("speed").condition.is_declared


def test_a_table_that_comes_free_is_told_once(path):
    first = Session(path)

    async def script(app: Host, pilot: Pilot[None]) -> None:
        app.looks(3)
        assert app.said == []
        first.close()
        app.looks(3)

    assert run(path, script).said == ["The other editor has closed this table: it can be saved here again."]


def test_who_has_the_table_and_what_was_left_of_it_is_told_as_it_changes(path):
    first = Session(path)
    others: list[Session] = []

    async def script(app: Host, pilot: Pilot[None]) -> None:
        first.close()
        others.append(Session(path))
        app.looks(3)
        others[0].sheet.go(0, 0)
        others[0].sheet.type_text("dash")
        others[0].lock.release()  # as when it is killed
        app.looks(3)

    assert run(path, script).said == [
        f"another editor (process {os.getpid()}) has opened this table: it can be read here, and saved under another name.",
        "The other editor has ended and left edits that are not saved. Save yours under another name; then open this table again.",
    ]
