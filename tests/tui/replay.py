"""Replay files: what a person presses, and what stands on the screen and in the files then.

A `.keys` file is one session with the editor beside a fresh copy of tables/, one command a line; `#` begins a remark. Lines that
begin with `|` are what a command shows, and a test compares them:

    table NAME [COLUMNS ROWS]   open a table, in a terminal of 80 x 24 or that size
    given FILE                  before `table`: write a file; its lines follow
    press KEY ...               press keys, by their names in Textual
    type TEXT                   press the characters of a text
    paste TEXT                  what a terminal sends when one pastes; \\t, \\r and \\n are written so
    click X Y [shift|twice]     click at column X and line Y of the screen, from 0
    drag X Y to X Y             press there, move, let go here
    elsewhere FILE: OLD => NEW  another program replaces a text in a file, and the editor looks at the disk
    await coverage              until the coverage is worked out
    screen [FIRST LAST]         the screen, or those of its lines, from 0
    said                        the line over the footer
    place                       the line over the grid: where the cursor is and what stands there
    column NAME                 the texts of a column, as the file has them in the end
    file [FILE]                 what differs in the file from what it was at first: `-` gone, `+` new
    ended                       the editor's exit code, once it has been left

`python tests/tui/update_replays.py` writes what is shown now into the files.
"""

import difflib
import re
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(ROOT)]

from terminal import alone, drive, screen_text, settled  # noqa: E402
from textual.events import Paste  # noqa: E402
from textual.pilot import Pilot  # noqa: E402

from tui.app import EditorApp  # noqa: E402
from tui.model.workspace import Workspace  # noqa: E402
from tui.screens.main import MainScreen  # noqa: E402
from tui.widgets.bar import CellLine  # noqa: E402

FILES = sorted((HERE / "replays").glob("*.keys"))
SHOWS = ("screen", "said", "place", "column", "file", "ended")
SCROLL_BAR = re.compile(r" +([▁▂▃▄▅▆▇])\1?$")
"""The end of a scroll bar's slider, which comes a moment after the text that it belongs to."""
WAIT_S = 60.0
KEYS_OF = {" ": "space"}


class ReplayError(ValueError):
    """A line of a replay file that says nothing one can do."""


@dataclass(frozen=True)
class Step:
    """A command of a replay file, and the lines under it, without their `|`."""

    line: int
    """From 1."""
    words: str
    lines: tuple[str, ...] = ()
    leading: tuple[str, ...] = ()
    """The remarks and blank lines before it."""

    @property
    def command(self) -> str:
        """Its first word."""
        return self.words.split(" ", 1)[0]

    @property
    def rest(self) -> str:
        """What follows the first word, as it is."""
        return self.words.partition(" ")[2]


def read_steps(text: str) -> tuple[list[Step], tuple[str, ...]]:
    """The steps of a replay file, and the remarks at its end."""
    steps: list[Step] = []
    leading: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("|"):
            if not steps or leading:
                raise ReplayError(f"line {number}: what is shown stands under a command")
            steps[-1] = replace(steps[-1], lines=(*steps[-1].lines, line[2:]))
        elif not line.strip() or line.startswith("#"):
            leading.append(line)
        else:
            steps.append(Step(number, line, leading=tuple(leading)))
            leading = []
    return steps, tuple(leading)


def written(steps: list[Step], ending: tuple[str, ...]) -> str:
    """The text of a replay file."""
    lines: list[str] = []
    for step in steps:
        lines += [*step.leading, step.words, *(f"| {line}".rstrip() for line in step.lines)]
    return "\n".join([*lines, *ending]) + "\n"


@dataclass
class Replay:
    """A session with the editor, driven by the steps of a file."""

    folder: Path
    """Holds tables/, and is the folder for the settings and journals of the system too."""
    app: EditorApp | None = None
    at_first: dict[str, str] = field(default_factory=dict)
    last_file: str = ""

    def shown(self, steps: list[Step]) -> list[Step]:
        """The steps with what is shown now."""
        shutil.copytree(ROOT / "tables", self.folder / "tables", ignore=shutil.ignore_patterns("clips", ".*"))
        givens = [step for step in steps if step.command == "given"]
        for step in givens:
            self._path(step.rest).write_bytes("\n".join([*step.lines, ""]).encode())
        self.at_first = {p.name: _text(p) for p in (self.folder / "tables").iterdir() if p.is_file()}
        opening = next((step for step in steps if step.command == "table"), None)
        if opening is None:
            raise ReplayError("there is no line `table NAME`")
        name, *size = opening.rest.split()
        self.last_file = f"{name}.csv"
        self.app = EditorApp(Workspace(self._path(self.last_file)))
        columns, rows = map(int, size or (80, 24))
        try:
            return drive(self.app, lambda pilot: self._all(pilot, steps), (columns, rows), paints=True)
        finally:
            self.app.workspace.close()

    async def _all(self, pilot: Pilot[Any], steps: list[Step]) -> list[Step]:
        done = []
        for step in steps:
            if step.command in SHOWS:
                step = replace(step, lines=tuple(self._show(step)))
            elif step.command not in ("table", "given"):
                await self._do(pilot, step)
                await settled(pilot)
            done.append(step)
        return done

    # ---- what is done

    async def _do(self, pilot: Pilot[Any], step: Step) -> None:
        assert self.app is not None
        words = step.rest.split()
        if step.command == "press":
            for key in words:
                await pilot.press(key)
                await settled(pilot)
        elif step.command == "type":
            await pilot.press(*(KEYS_OF.get(c, c) for c in step.rest))
        elif step.command == "paste":
            self.app.post_message(Paste(_unescaped(step.rest)))
        elif step.command == "click":
            x, y, *how = words
            await pilot.click(offset=(int(x), int(y)), shift="shift" in how, times=2 if "twice" in how else 1)
        elif step.command == "drag":
            await self._drag(pilot, [int(word) for word in words if word != "to"])
        elif step.command == "elsewhere":
            await self._elsewhere(pilot, step)
        elif step.words == "await coverage":
            await pilot.pause()
            self.app.main.coverage.join(WAIT_S)
        else:
            raise ReplayError(f"line {step.line}: there is no command {step.command}")

    async def _drag(self, pilot: Pilot[Any], places: list[int]) -> None:
        x, y, to_x, to_y = places
        await pilot.mouse_down(offset=(x, y))
        await pilot.hover(offset=((x + to_x) // 2, (y + to_y) // 2))
        await pilot.hover(offset=(to_x, to_y))
        await pilot.mouse_up(offset=(to_x, to_y))

    async def _elsewhere(self, pilot: Pilot[Any], step: Step) -> None:
        assert self.app is not None
        file, _, change = step.rest.partition(": ")
        old, _, new = change.partition(" => ")
        path = self._path(file)
        raw = path.read_bytes()
        if _unescaped(old).encode() not in raw:
            raise ReplayError(f"line {step.line}: {file} does not hold {old!r}")
        path.write_bytes(raw.replace(_unescaped(old).encode(), _unescaped(new).encode(), 1))
        for _ in range(3):  # a file that is being written counts once it rests
            self.app.main.care.look()
            await pilot.pause()

    # ---- what is shown

    def _show(self, step: Step) -> Iterator[str]:
        assert self.app is not None
        if step.command == "ended":
            return iter([str(self.app.return_code)])
        if step.command == "file":
            return _difference(self.at_first.get(step.rest or self._file, ""), _text(self._path(step.rest or self._file)))
        if step.command == "column":
            return iter(next(c for c in self.app.main.session.sheet.table.columns if c.name == step.rest).to_list())
        if step.command == "said":
            text, level = self.app.main._notice
            return iter([text if level == "information" else f"! {text}"])
        lines = [SCROLL_BAR.sub("", line) for line in screen_text(self.app).splitlines()]
        if step.command == "place":
            return iter([lines[self.app.main.query_one(CellLine).region.y].strip()])
        first, last = map(int, step.rest.split() or (0, len(lines) - 1))
        return iter(lines[first : last + 1])

    @property
    def _file(self) -> str:
        """The file of the table that is seen, or was last."""
        assert self.app is not None
        screens = [screen for screen in self.app.screen_stack if isinstance(screen, MainScreen)]
        self.last_file = screens[-1].session.path.name if screens else self.last_file
        return self.last_file

    def _path(self, name: str) -> Path:
        return self.folder / "tables" / name


def _unescaped(text: str) -> str:
    return text.replace("\\t", "\t").replace("\\r", "\r").replace("\\n", "\n")


def _text(path: Path) -> str:
    return path.read_bytes().decode() if path.exists() else ""


def _difference(before: str, after: str) -> Iterator[str]:
    for line in difflib.ndiff(before.splitlines(), after.splitlines()):
        if line[0] in "+-":
            yield line[0] + line[2:]


def replayed(path: Path, kind: type[Replay] = Replay) -> tuple[str, str]:
    """The text of a replay file, and what it would be if all that it shows is as it is now."""
    text = path.read_text("utf-8")
    steps, ending = read_steps(text)
    with TemporaryDirectory() as folder, alone(Path(folder)):
        return text, written(kind(Path(folder)).shown(steps), ending)
