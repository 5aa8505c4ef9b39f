"""The editor in a real terminal: what no simulated one shows, such as how keys, pastes and the mouse arrive.

Nothing sleeps to be safe: each step waits until the screen shows what it is to show.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from motion_project import session_folder
from strategies import in_full_runs
from textual.binding import Binding

from tui.commands import COMMANDS
from tui.widgets.editing.keys import KEYS as CELL_KEYS

ROOT = Path(__file__).parent.parent.parent
RAW = b"Asset,speed,hit\r\n" + b"".join(b"clip_%02d,%d,True\r\n" % (i, i) for i in range(40))
WIDE = b"Asset" + b"".join(b",condition_%02d" % i for i in range(30)) + b"\r\n" + (b"clip_00" + b",Any" * 30 + b"\r\n") * 40
"""A table wider and higher than the screen."""
DEADLINE_S = 30.0

pytestmark = pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")


@dataclass
class Terminal:
    """A tmux of its own, with the editor in it."""

    socket: str
    folder: Path

    def tmux(self, *words: str) -> str:
        done = subprocess.run(
            ["tmux", "-S", self.socket, "-f", os.devnull, *words], capture_output=True, check=True, encoding="utf-8"
        )
        return done.stdout

    def start(self, term: str, *, program: str = "-m contextdb edit t.csv", **more: str) -> None:
        environment = {
            "TERM": term,
            "PYTHONPATH": str(ROOT),
            "XDG_STATE_HOME": str(self.folder),
            "XDG_CONFIG_HOME": str(self.folder),
        }
        said = [f"{name}={value}" for name, value in (environment | more).items()]
        command = f"env -u COLORTERM {' '.join(said)} {sys.executable} {program}; echo exit code $?; cat"
        self.tmux("new-session", "-d", "-x", "80", "-y", "24", "-c", str(self.folder), command)

    def end(self) -> None:
        """Close the terminal; one that is started then has another socket, since the server that ends still holds this one."""
        self.tmux("kill-server")
        self.socket += "-next"

    def resize(self, columns: int, rows: int) -> None:
        self.tmux("resize-window", "-x", str(columns), "-y", str(rows))

    def wait_for_foot(self, rows: int, *texts: str) -> list[str]:
        """The lines of the screen, once it shows all of these and the keys stand in its last line."""
        end = time.monotonic() + DEADLINE_S
        while (
            len(lines := (shown := self.screen).splitlines()) != rows
            or "F2 Edit" not in lines[-1]
            or any(t not in shown for t in texts)
        ):
            assert time.monotonic() < end, f"{texts} not on a screen of {rows} lines:\n{shown}"
            time.sleep(0.02)
        return lines

    def keys(self, *keys: str) -> None:
        self.tmux("send-keys", *keys)

    def raw(self, text: str) -> None:
        self.tmux("send-keys", "-l", text)

    def mouse(self, button: int, x: int, y: int) -> None:
        """A press and a release, as a terminal sends them; x and y from 0."""
        self.raw(f"\x1b[<{button};{x + 1};{y + 1}M\x1b[<{button};{x + 1};{y + 1}m")

    @property
    def screen(self) -> str:
        return self.tmux("capture-pane", "-p")

    def wait_without(self, text: str) -> None:
        """Go on once the screen does not show this any more."""
        end = time.monotonic() + DEADLINE_S
        while text in (shown := self.screen):
            assert time.monotonic() < end, f"{text} still on the screen:\n{shown}"
            time.sleep(0.02)

    def wait(self, *texts: str) -> str:
        """The screen, once it shows all of these."""
        end = time.monotonic() + DEADLINE_S
        while not all(text in (shown := self.screen) for text in texts):
            assert time.monotonic() < end, f"{texts} not on the screen:\n{shown}"
            time.sleep(0.02)
        return shown


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    (tmp_path / "t.csv").write_bytes(RAW)
    made = Terminal(str(tmp_path / "socket"), tmp_path)
    yield made
    subprocess.run(["tmux", "-S", made.socket, "kill-server"], capture_output=True, check=False)


@pytest.fixture
def other_terminal(terminal: Terminal) -> Iterator[Terminal]:
    made = Terminal(f"{terminal.socket}-other", terminal.folder)
    yield made
    subprocess.run(["tmux", "-S", made.socket, "kill-server"], capture_output=True, check=False)


@pytest.mark.parametrize(
    ("term", "more"), [("screen-256color", {}), ("xterm", {}), ("xterm-256color", {"NO_COLOR": "1"})], ids=["256", "16", "none"]
)
def test_the_editor_works_in_a_real_terminal(terminal, term, more):
    terminal.start(term, **more)
    terminal.wait("clip_00", "row 1 · Asset", "Save")

    terminal.keys("Down", "Right")
    terminal.raw("2..25")  # all at once, as over a slow line
    terminal.keys("Enter")
    terminal.wait("row 3 · speed", "2..25", "t *")

    terminal.tmux("set-buffer", "7\tFalse\n8..9\tFalse\n")
    terminal.tmux("paste-buffer", "-p")  # bracketed; tmux makes its line ends \r
    terminal.wait("Paste 2 × 2.", "8..9")

    lines = terminal.screen.splitlines()
    y = next(at for at, line in enumerate(lines) if "clip_05" in line)
    terminal.mouse(0, lines[y].index("clip_05"), y)
    terminal.wait("row 6 · Asset")
    for _ in range(3):
        terminal.mouse(65, 20, 10)
    shown = terminal.wait("clip_20")
    assert "row 6 · Asset" in shown

    terminal.keys("C-s")
    terminal.wait("Saved t.csv.")
    expected = RAW.replace(b"clip_01,1,", b"clip_01,2..25,").replace(b"clip_02,2,True", b"clip_02,7,False")
    assert (terminal.folder / "t.csv").read_bytes() == expected.replace(b"clip_03,3,True", b"clip_03,8..9,False")

    terminal.keys("C-q")
    terminal.wait("exit code 0")


def test_quitting_with_unsaved_edits_asks_and_saves(terminal):
    terminal.start("screen-256color")
    terminal.wait("row 1 · Asset", "Save")
    terminal.raw("first")
    terminal.keys("Enter", "C-q")
    terminal.wait("edits that are not saved")
    terminal.keys("s")
    terminal.wait("exit code 0")
    assert (terminal.folder / "t.csv").read_bytes() == RAW.replace(b"clip_00", b"first")


@in_full_runs  # tests/tui/test_conflicts.py every day
def test_two_editors_of_one_table_lose_nothing_of_what_was_saved_and_each_is_told(terminal, other_terminal):
    terminal.start("screen-256color")
    terminal.wait("clip_00", "F2 Edit")
    other_terminal.start("screen-256color")
    other_terminal.wait("open elsewhere", "is lost if this editor is killed")
    other_terminal.keys("Enter", "Right")
    for one, typed in ((terminal, "2..25"), (other_terminal, "7")):
        one.keys("C-Home", "Right")
        one.raw(typed)
        one.keys("Enter")
        one.wait("t *", "row 2 · speed")
    other_terminal.keys("C-s")
    other_terminal.wait("another editor", "has this table open")
    terminal.keys("C-s")
    terminal.wait("Saved t.csv.")
    other_terminal.wait("The file was changed on disk", "7", "2..25")
    other_terminal.keys("Right", "Enter")
    other_terminal.wait("Merged from disk: 1 cell changed.")
    other_terminal.keys("C-z")
    other_terminal.wait("Undo: Merge changes on disk.")

    terminal.raw("9")
    terminal.keys("Enter", "C-z")
    terminal.wait("Undo: Type speed of clip_01.")
    terminal.keys("C-y")
    terminal.wait("Redo: Type speed of clip_01.")
    os.kill(json.loads((terminal.folder / ".contextdb-journal" / "t.csv.lock").read_text())["pid"], signal.SIGKILL)
    terminal.wait("exit code 137")
    other_terminal.wait("left edits that are not saved")

    terminal.end()
    terminal.start("screen-256color")
    terminal.wait("1 unsaved edit restored", "F2 Edit")
    other_terminal.wait("has opened this table")
    terminal.keys("C-s")
    terminal.wait("Saved t.csv.")
    expected = RAW.replace(b"clip_00,0,", b"clip_00,2..25,").replace(b"clip_01,1,", b"clip_01,9,")
    assert (terminal.folder / "t.csv").read_bytes() == expected
    other_terminal.wait("Merged from disk: 1 cell changed.", "clip_01 │  9")


def test_a_terminal_that_changes_its_size_while_the_editor_starts_and_later_is_filled_at_once(terminal):
    terminal.start("screen-256color", COLUMNS="80", LINES="24")  # as a shell may export them
    terminal.resize(200, 60)
    terminal.wait_for_foot(60, "40 rows")
    for columns, rows in ((20, 8), (200, 60), (20, 8), (90, 30)):
        terminal.resize(columns, rows)
        lines = terminal.wait_for_foot(rows, "cli", *(["40 rows"] if columns > 40 else []))
        assert len(lines) == rows
    terminal.keys("Down")
    terminal.wait("row 2 · Asset")


def test_keys_that_come_in_one_packet_type_nothing_and_the_same_signs_typed_come_through(terminal):
    terminal.start("xterm-256color")
    terminal.wait("clip_00", "F2 Edit")
    terminal.raw("\x1bg\x1b[B\x1br\x1b\x1b[B\x1bw\x1bw\x1b[B\x1b\x1bz")
    assert "Enter Take" not in terminal.wait("the table as it was opened")
    terminal.keys("Escape", "M-5")
    terminal.wait("What is wrong")
    terminal.keys("M-1")
    terminal.wait("row 4 · Asset")
    terminal.raw("^¡™£∞")
    terminal.keys("Enter", "C-s")
    terminal.wait("Saved t.csv.")
    assert (terminal.folder / "t.csv").read_bytes() == RAW.replace(b"clip_03", "^¡™£∞".encode())


# ---- every key of the help


TMUX_NAMES = {"pageup": "PageUp", "pagedown": "PageDown", "insert": "IC", "delete": "DC", "backspace": "BSpace"}
TMUX_NAMES |= {"comma": ",", "full_stop": "."}
PLAIN_ONLY = ("enter", "escape", "backspace", "space", "tab")
"""Keys that send the same with Ctrl, Shift or Alt held, or nothing."""


def tmux_name(key: str) -> str | None:
    """What tmux calls a key of which a terminal without extended keys sends something of its own; None for other keys."""
    *held, last = key.split("+")
    if key == "ctrl+@":
        return "C-Space"
    if len(last) == 1:
        taken = {("ctrl",): "him", ("alt",): "fb"}.get(tuple(held), last)  # Backspace, Tab and Enter; Ctrl+Right and Ctrl+Left
        name = None if last in taken else last
    else:
        name = None if last in PLAIN_ONLY and held else TMUX_NAMES.get(last, last.capitalize())
    return name and "".join({"ctrl": "C-", "alt": "M-", "shift": "S-"}[one] for one in held) + name


KEYS = [(command, key) for command in COMMANDS for key in command.keys.split(",") if key and tmux_name(key)]


def test_the_first_key_of_each_command_is_one_that_every_terminal_sends():
    assert [command.id for command in COMMANDS if command.keys and tmux_name(command.keys.split(",")[0]) is None] == []


def test_the_keys_on_the_key_line_are_ones_that_every_terminal_sends():
    for binding in (one for one in CELL_KEYS if isinstance(one, Binding) and one.show):
        assert tmux_name(binding.key.split(",")[0]) is not None


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Terminal, Path]]:
    """An editor in which keys only tell what they would do, for all of the keys."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "t.csv").write_bytes(WIDE)
    made = Terminal(str(folder / "socket"), folder)
    made.start("screen-256color", program=f"{ROOT / 'tests' / 'tui' / 'recording_editor.py'} t.csv told.txt")
    made.wait("clip_00", "F2 Edit")
    yield made, folder / "told.txt"
    subprocess.run(["tmux", "-S", made.socket, "kill-server"], capture_output=True, check=False)


@pytest.mark.parametrize(("command", "key"), KEYS, ids=[key for _, key in KEYS])
def test_each_key_that_the_help_names_does_in_a_terminal_what_it_says(recorded, command, key):
    terminal, told = recorded
    before = told.read_text("utf-8").splitlines() if told.exists() else []
    binding = command.binding()
    terminal.keys(tmux_name(key))
    end = time.monotonic() + DEADLINE_S
    while len(lines := told.read_text("utf-8").splitlines() if told.exists() else []) == len(before):
        assert time.monotonic() < end, f"{key} does nothing"
        time.sleep(0.01)
    assert lines[len(before) :] == [binding.action]


def test_the_debugger_works_in_a_real_terminal(terminal):
    shutil.copytree(session_folder(), terminal.folder, dirs_exist_ok=True)
    terminal.start("screen-256color", program="-m contextdb motion debug session.parquet")
    terminal.wait("session.parquet  1.00 s of 5.00", "▶ walk", "1 of 5 may play", "F1 Help")
    terminal.keys("]")
    terminal.wait("tick 61", "walk has ended: walk at 1.03 s")
    terminal.keys("Home", "Right")
    terminal.wait("tick 1 ", "Nothing was searched.")
    lines = terminal.screen.splitlines()
    terminal.mouse(0, 78, next(at for at, line in enumerate(lines) if line.split()[:1] == ["plays"]))
    terminal.wait("tick 14", "walk_tired")
    terminal.raw("/jog\r")
    terminal.wait("name holds jog")
    terminal.keys("Tab")
    terminal.wait("─Why─", "why not jog")
    terminal.keys("Tab")
    terminal.wait("━ plays")
    terminal.keys("Tab", "+")
    terminal.wait("◀ 1.25 ▶", "With these weights")
    terminal.resize(160, 48)
    terminal.wait("─Bars · ", "─Why─", "─Poses · as shown, blended─", "─Weights─")
    terminal.keys("q")
    terminal.wait("exit code 0")


# ---- a cell that is edited


@in_full_runs  # tests/tui/test_stray_keys.py every day
@pytest.mark.parametrize("size", [(80, 24), (120, 36), (160, 48)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_what_is_typed_goes_to_the_tab_or_the_bar_that_was_opened_over_a_cell(terminal, size):
    terminal.start("screen-256color")
    terminal.resize(*size)
    terminal.wait_for_foot(size[1], "row 1 · Asset")
    for at, opened in enumerate(("M-4", "M-3", "M-5", "M-Right", "C-NPage", "C-f", "C-l")):
        terminal.keys("C-Home", *["Down"] * (at + 1))
        terminal.wait(f"row {at + 2} · Asset")
        terminal.raw(f"Q{at}")
        terminal.wait(f"Q{at}", "Enter OK")
        terminal.keys(opened)
        terminal.wait_without("Enter OK")
        terminal.raw("7w")
        terminal.keys("Escape", "M-1", "M-g")
        terminal.wait("· Asset", "F2 Edit", f"Q{at}", "clip_20" if size[1] > 30 else "clip_08")
    lines = terminal.screen.splitlines()
    terminal.keys("C-Home", *["Down"] * 8)
    terminal.wait("row 9 · Asset")
    terminal.raw("Q7")
    terminal.wait("Q7", "Enter OK")
    terminal.mouse(0, lines[0].index("Coverage"), 0)
    terminal.wait_without("Enter OK")
    terminal.raw("7w")
    terminal.keys("M-1")
    terminal.wait("row 9 · Asset", "F2 Edit")
    terminal.keys("C-s")
    terminal.wait("Saved t.csv.")
    expected = RAW
    for at in range(8):
        expected = expected.replace(b"clip_%02d," % (at + 1), b"Q%d," % at)
    assert (terminal.folder / "t.csv").read_bytes() == expected


def test_a_save_takes_the_cell_that_is_edited_and_home_stays_in_the_empty_row(terminal):
    terminal.start("screen-256color")
    terminal.wait("row 1 · Asset", "F2 Edit")
    terminal.keys("C-End", "Down")
    terminal.wait("new row · hit")
    terminal.keys("Home")
    terminal.wait("new row · Asset")
    terminal.raw("Perch_01")
    terminal.keys("C-s")
    terminal.wait("Saved t.csv.")
    assert (terminal.folder / "t.csv").read_bytes() == RAW + b"Perch_01,,\r\n"
    terminal.keys("C-Home", "Right")
    terminal.raw("x7")
    terminal.keys("C-s")
    terminal.wait("Correct the cell first")
    terminal.keys("Escape")
    terminal.tmux("set-buffer", "0,5\n1,5\n")
    terminal.tmux("paste-buffer", "-p")
    terminal.wait("What 0,5 means", "0.5: the comma is a decimal sign")
    terminal.keys("Enter")
    terminal.wait("Paste 2 × 1.", "1.5")
    terminal.keys("C-s")
    terminal.wait("Saved t.csv.")
    assert (terminal.folder / "t.csv").read_bytes().startswith(b"Asset,speed,hit\r\nclip_00,0.5,True\r\nclip_01,1.5,True\r\n")


def test_a_day_with_contracts_written_proved_mended_and_saved(terminal: Terminal):
    """A sentence is typed and seen, broken, its counterexample opened, the row widened, and the contract holds and is saved."""
    (terminal.folder / "t.csv").write_text("Asset,speed\nwalk,0..3\nrun,4..8\n", encoding="utf-8")
    (terminal.folder / "contextdb.toml").write_text("[conditions.speed]\ntype = 'number'\nmin = 0\nmax = 8\n", encoding="utf-8")
    terminal.start("screen")
    terminal.wait("F2 Edit", "walk")
    terminal.keys("M-5", "M-Right")
    terminal.wait("No contract. N writes one.")
    terminal.keys("n")
    terminal.wait("A sentence, such as")
    terminal.raw("speed > 2, some rows can play")
    terminal.wait("Whenever speed > 2, some rows can play", "does not hold at speed: (3..4)")
    terminal.keys("Enter")
    terminal.wait("0 of 1 contract proved.", "broken", "Whenever speed > 2, some row can play")
    terminal.keys("Enter")
    terminal.wait("nothing plays")
    terminal.keys("M-1", "C-Home", "Right", "Down", "F2")
    terminal.wait("Enter OK")
    terminal.keys("C-a")
    terminal.raw("3..8")
    terminal.keys("Enter")
    terminal.wait("plays run")
    terminal.keys("M-5", "M-Right")
    terminal.wait("1 of 1 contract proved.", "holds")
    terminal.keys("C-s")
    terminal.wait("Saved")
    assert "run,3..8" in (terminal.folder / "t.csv").read_text(encoding="utf-8")
    assert "[contracts." in (terminal.folder / "contextdb.toml").read_text(encoding="utf-8")
