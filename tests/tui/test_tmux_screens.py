"""The keys of each tab and dialog in a real terminal, in the encoding of old: each does there what the page of keys says."""

import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import pytest
from test_motion_measure_command import made
from test_tmux import DEADLINE_S, ROOT, Terminal
from textual.binding import Binding

import contextdb as cdb
from docs import keys, terminals
from docs.terminals import ESC, xterm
from tui.model.session import Session

__all__ = ["made"]
"""A fixture of another file."""

pytestmark = pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")

TABLE = "Asset,speed,Defender.near,hit\nwalk,0..2,Any,True\nrun,2..6,0..3,Any\nrun,2..6,Any,False\n"
MARKED = "Asset,speed\n<<<<<<< ours\nwalk,0..2\n=======\nwalk,0..3\n>>>>>>> theirs\n"
REMARKED = "Asset;speed\nr\xe9;1\n"
CASES = "Case,Expected,speed,Defender.near,hit\nslow,walk,1,2,True\n"
CONDITIONS = '[conditions.hit]\ntype = "bool"\n[conditions."Defender.near"]\ntype = "number"\n'


def alt(sign: str) -> str:
    """What Alt and a sign send."""
    return f"{ESC}{sign}"


def named(command: str) -> str:
    """What finds a command in the palette and runs it."""
    return f"{xterm('ctrl+p')}{command}\r"


def table(name: str) -> str:
    """What goes to another table."""
    return f"{xterm('ctrl+o')}{name}\r"


MOTION = ((named("motion"), "1.20"),)
BARS = ("\r", "─Bars · ")
JUMPED = "walk has ended"
"""What the next jump shows: by then the keys before it have done what they do."""
TYPED = (("enter", "submit"),)


@dataclass
class Screen:
    """What opens a screen, what it shows then, whose keys work in it, which of them do not there, and what leaves it."""

    opens: str
    shows: str
    widgets: str
    without: str = ""
    leaves: str = "\x1b"
    is_typed_in: bool = False
    """Signs are typed into it."""
    before: tuple[tuple[str, str], ...] = ()
    """What is opened before, and what that shows."""
    also: tuple[tuple[str, str], ...] = ()
    """Keys of a part of Textual's, and what they do."""
    of_game: bool = False
    """A game runs meanwhile."""
    is_marked: bool = False
    """A table with marks of git lies there meanwhile, with which no project can be read."""


@dataclass
class Editor:
    """An editor whose keys can be held: they tell what they would do."""

    terminal: Terminal
    folder: Path
    meeting: Path
    """Where running games are met."""

    @property
    def told(self) -> list[str]:
        file = self.folder / "told.txt"
        return file.read_text("utf-8").splitlines() if file.exists() else []

    def hold(self, *sent: str) -> list[str]:
        """What keys would do that are sent in one packet."""
        n = len(self.told)
        (self.folder / "hold").touch()
        self.terminal.raw("".join(sent))
        end = time.monotonic() + DEADLINE_S / 3
        while len(self.told) < n + len(sent) and time.monotonic() < end:
            time.sleep(0.01)
        (self.folder / "hold").unlink()
        return self.told[n:]


SCREENS = (
    Screen(xterm("f1"), "How a cell is written", "HelpPage"),
    Screen(alt("j"), "E edit all", "ColumnsDialog LineList"),
    Screen(alt("j") + "e", "Tab right", "ColumnSheetDialog", leaves=alt("x")),
    Screen(alt("d"), "N not", "ValuesDialog LineList"),
    Screen(alt("c"), "Add a column", "AddColumn", is_typed_in=True),
    Screen(alt("z"), "as it was opened", "ChooseDialog"),
    Screen(xterm("shift+f5"), "Find in all tables", "FindEverywhere", is_typed_in=True),
    Screen(xterm("f8") + xterm("shift+f12"), "Tab turns the page", "NearestDialog"),
    Screen(alt("p"), "Defender 0", "ActorsDialog"),
    Screen(xterm("f9"), "type to filter", "ContextsDialog LineList"),
    Screen(xterm("f9") + xterm("f6"), "Save the test row", "KeepDialog", is_typed_in=True, leaves=ESC + ESC),
    Screen(alt("u"), "Enter follow", "LiveDialog LineList"),
    Screen(xterm("ctrl+f"), "Replace", "SheetBar FindBar", is_typed_in=True),
    Screen(xterm("f2"), "Enter OK", "CellEditor", "space", is_typed_in=True),
    Screen(xterm("f9") + xterm("f4"), "Open a file of", "OpenDialog", is_typed_in=True, leaves=ESC + ESC),
    Screen(named("import"), "Enter read", "ImportDialog", is_typed_in=True),
    Screen(named("export"), "Enter export", "ExportDialog", is_typed_in=True),
    Screen(named("blueprints") + "\t", "Del remove", "Blueprints", is_typed_in=True),
    Screen(alt("2"), "Policy", "OptionsPane", "up down", leaves=alt("1")),
    Screen(alt("3"), "Selector moves", "PrioritiesPane", leaves=alt("1")),
    Screen(alt("4"), "Crowded", "CoveragePane GapList", leaves=alt("1")),
    Screen(alt("4") + "2", "Enter Open the pair", "PairMap HeatMap", leaves=alt("1")),
    Screen(alt("5"), "Warnings", "ProblemsPane ProblemList", leaves=alt("1")),
    Screen(named("motion"), "1 session", "MotionPane SessionList", leaves=alt("1")),
    Screen("\r", "─Bars · ", "DebugScreen Bars", leaves="q", before=MOTION),
    Screen("\t\t]", JUMPED, "Stage", leaves="q", before=(*MOTION, BARS)),
    Screen("\t\t\t]", JUMPED, "CursorLines", leaves="q", before=(*MOTION, BARS)),
    Screen("?", "Esc close", "DebugHelp HelpPage Dialog", leaves="qq", before=(*MOTION, BARS)),
    Screen(xterm("ctrl+g"), "Go to", "AskDialog Dialog", is_typed_in=True, also=TYPED),
    Screen(xterm("f9") + xterm("f2"), "Rename the context", "AskDialog Dialog", is_typed_in=True, leaves=ESC + ESC, also=TYPED),
    Screen(xterm("f9") + xterm("delete"), "It cannot be undone", "SureDialog Dialog", leaves=ESC + ESC),
    Screen(
        "\r",
        "type to filter",
        "ChooseDialog",
        leaves=ESC + ESC,
        before=((named("import"), "Enter read"), ("../cells.csv\r", "Becomes")),
    ),
    Screen(xterm("shift+f4"), "A also cells that differ", "AutofillDialog LineList Dialog"),
    Screen(
        xterm("home") + "\r",
        "it has decided nothing yet",
        "WaitingScreen",
        leaves="q",
        before=((named("motion"), "1 game running"),),
        of_game=True,
    ),
    Screen(table("marks"), "Enter merge", "ConflictsDialog Dialog", is_marked=True),
    Screen(table("held"), "open elsewhere", "HeldDialog Dialog"),
    Screen(xterm("ctrl+q"), "not saved", "LeavingDialog Dialog", before=((named("duplicate rows"), "Duplicate"),)),
    Screen(
        xterm("f6"),
        "PgDn read on",
        "RemarksDialog Dialog",
        before=((named("import"), "Enter read"), ("../remarks.csv\r", "F6 import")),
    ),
)


@pytest.fixture(scope="module")
def editor(made: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Editor]:
    folder = tmp_path_factory.mktemp("screens")
    shutil.copytree(made, folder, dirs_exist_ok=True)
    (folder / ".git").mkdir()  # one work tree: sessions beside a project are those of its repository
    (folder / "game" / "acts.csv").write_text(TABLE, encoding="utf-8")
    (folder / "game" / "acts.cases.csv").write_text(CASES, encoding="utf-8")
    (folder / "game" / "held.csv").write_text(TABLE, encoding="utf-8")
    (folder / "cells.csv").write_text(TABLE, encoding="utf-8")
    with (folder / "game" / "contextdb.toml").open("a", encoding="utf-8") as file:
        file.write(CONDITIONS)
    (folder / "remarks.csv").write_text(REMARKED, encoding="cp1252")
    meeting = Path(tempfile.mkdtemp(prefix="cdb"))  # sockets need a short path
    terminal = Terminal(str(folder / "socket"), folder)
    program = ROOT / "tests" / "tui" / "recording_editor.py"
    terminal.start("screen-256color", program=f"{program} game/acts.csv told.txt hold", COLORTERM="", XDG_RUNTIME_DIR=str(meeting))
    terminal.wait("walk", "F2 Edit")
    elsewhere = Session(folder / "game" / "held.csv")
    yield Editor(terminal, folder, meeting)
    elsewhere.close()
    shutil.rmtree(meeting, ignore_errors=True)
    subprocess.run(["tmux", "-S", terminal.socket, "kill-server"], capture_output=True, check=False)


@pytest.mark.parametrize("screen", SCREENS, ids=[screen.widgets for screen in SCREENS])
def test_each_key_of_a_screen_does_in_a_terminal_what_the_page_says(
    editor: Editor, screen: Screen, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(editor.meeting))
    marks = editor.folder / "game" / "marks.csv"
    if screen.is_marked:
        marks.write_text(MARKED, encoding="utf-8")
    with cdb.link("game") if screen.of_game else nullcontext():
        _press_all(editor, screen)
    marks.unlink(missing_ok=True)


def _press_all(editor: Editor, screen: Screen) -> None:
    for opens, shows in screen.before:
        editor.terminal.raw(opens)
        editor.terminal.wait(shows)
    editor.terminal.raw(screen.opens)
    editor.terminal.wait(screen.shows)
    actions = actions_of(screen)
    told = editor.hold(*(xterm(key) for key in actions))
    editor.terminal.raw(screen.leaves)
    editor.terminal.wait_without(screen.shows)
    editor.terminal.wait_without("╰")  # the dialog under it
    assert len(told) == len(actions), dict(zip(actions, told, strict=False))
    wrong = {key: one for (key, those), one in zip(actions.items(), told, strict=True) if one not in those}
    assert not wrong, wrong


def actions_of(screen: Screen) -> dict[str, set[str]]:
    """The keys of a screen that every terminal sends, and what each may do."""
    actions: dict[str, set[str]] = {}
    for name in screen.widgets.split():
        for binding in Binding.make_bindings(vars(keys.widgets()[name]).get("BINDINGS", ())):
            actions.setdefault(binding.key, set()).add(binding.action)
    for key, action in screen.also:
        actions.setdefault(key, set()).add(action)
    pressed = [key for key in actions if is_pressed(key, screen)]
    return {key: actions[key] for key in sorted(pressed, key="escape".__eq__)}  # Esc before a sign would be Alt


def is_pressed(key: str, screen: Screen) -> bool:
    is_own = terminals.read(xterm(key)) == key and key not in screen.without.split()
    return is_own and not (screen.is_typed_in and terminals.is_sign(key))
