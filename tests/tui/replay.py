"""Replays and pages of keys: what a person presses, and what stands on the screen and in the files then.

A `.keys` file is one session with the editor beside a fresh copy of tables/, one command a line; `#` begins a remark. In a page of
`pages/`, written in Markdown, each block of keys is such a session; what the first block says, above all headings, stands before
each of them, but for its `table` where a block opens one itself; a table that is given there stands alone, without the copy of
tables/. Lines that begin with `|` are what a command shows, and a test compares them:

    table NAME [COLUMNS ROWS]   open a table, in a terminal of 80 x 24 or that size; once more: leave, and start again
    given FILE                  before `table`: write a file; its lines follow, one with {0..99} for each number
    settings                    before `table`: the settings of the editor; their lines follow
    press KEY ...               press keys, by their names in Textual; =TEXT presses the characters of a text
    type TEXT                   press the characters of a text with blanks
    field ID [TEXT]             go to a part of a form by its name in the code, and write a text over what stands there
    facts NAME=VALUE, ...       make these the facts of the test row
    command NAME                run a command by its name in docs/keys.md, as the list of commands does
    copied TEXT                 what another program put on the clipboard, written as for `paste`
    paste TEXT                  what a terminal sends when one pastes; \\t, \\r and \\n are written so
    click X Y [shift|twice|right]   click at column X and line Y of the screen, from 0; right: with the right button
    drag X Y to X Y [to X Y]    press there, move, let go here
    resize COLUMNS ROWS         the terminal gets another size
    elsewhere FILE: OLD => NEW  another program replaces a text in a file, and the editor looks at the disk
    await coverage              until the coverage is worked out
    screen [FIRST LAST]         the screen, or those of its lines, from 0
    changed                     the lines of the screen that are not as they were when they were last seen; of blank ones one
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
from collections import Counter
from collections.abc import Iterator
from contextlib import chdir
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(ROOT)]

from quick_apps import painted  # noqa: E402
from strategies import IS_FULL  # noqa: E402
from terminal import alone, drive, screen_text, settled  # noqa: E402
from textual.events import Paste  # noqa: E402
from textual.pilot import Pilot  # noqa: E402

from tui.app import EditorApp  # noqa: E402
from tui.editor_settings import EditorSettings, read_settings  # noqa: E402
from tui.model.workspace import Workspace  # noqa: E402
from tui.screens.main import MainScreen  # noqa: E402
from tui.widgets.bar import CellLine  # noqa: E402

FILES = sorted((HERE / "replays").glob("*.keys"))
PAGES = sorted((HERE / "pages").glob("*.md"))
SHOWS = ("screen", "changed", "said", "place", "column", "file", "ended")
SCROLL_BAR = re.compile(r" +([▁▂▃▄▅▆▇])\1?$")
"""The end of a scroll bar's slider, which comes a moment after the text that it belongs to."""
NUMBERS = re.compile(r"\{(\d+)\.\.(\d+)\}")
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


def read_steps(text: str, n_before: int = 0) -> tuple[list[Step], tuple[str, ...]]:
    """The steps of a replay file, and the remarks at its end."""
    steps: list[Step] = []
    leading: list[str] = []
    for number, line in enumerate(text.splitlines(), 1 + n_before):
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


@dataclass(frozen=True)
class Block:
    """A session in a page."""

    name: str
    """The heading over it, and a number from the second block under a heading on."""
    number: int
    """Which block under its heading it is, from 1."""
    start: int
    """Where its lines begin in the page, from 0."""
    stop: int
    common: tuple[Step, ...]
    """What the first block of the page says."""
    steps: tuple[Step, ...]
    ending: tuple[str, ...]


def read_page(text: str) -> list[Block]:
    """The sessions of a page."""
    heading, names, blocks, common = "", Counter[str](), list[Block](), tuple[Step, ...]()
    lines = text.splitlines()
    start = None
    for at, line in enumerate(lines):
        if start is None and line.startswith("## "):
            heading = line[3:]
        elif line == "```keys":
            start = at + 1
        elif start is not None and line == "```":
            steps, ending = read_steps("\n".join(lines[start:at]), start)
            if heading:
                names[heading] += 1
                name = heading if names[heading] == 1 else f"{heading} {names[heading]}"
                opens = any(step.command == "table" for step in steps)
                before = tuple(step for step in common if not (opens and step.command == "table"))
                blocks.append(Block(name, names[heading], start, at, before, tuple(steps), ending))
            else:
                common = tuple(steps)
            start = None
    return blocks


@dataclass
class Replay:
    """A session with the editor, driven by the steps of a file."""

    folder: Path
    """Holds tables/, and is the folder for the settings and journals of the system too."""
    app: EditorApp | None = None
    at_first: dict[str, str] = field(default_factory=dict)
    last_file: str = ""
    settings: EditorSettings | None = None
    seen: list[str] = field(default_factory=list)
    """The lines of the screen when they were last shown."""
    is_page: bool = False
    """A table that is given stands alone; and every day the screen is painted only when it is looked at."""

    def shown(self, steps: list[Step]) -> list[Step]:
        """The steps with what is shown now."""
        givens = [step for step in steps if step.command == "given"]
        starts = [at for at, step in enumerate(steps) if step.command == "table"]
        if not starts:
            raise ReplayError("there is no line `table NAME`")
        if self.is_page and f"{steps[starts[0]].rest.split()[0]}.csv" in [step.rest for step in givens]:
            (self.folder / "tables").mkdir()
        else:
            shutil.copytree(ROOT / "tables", self.folder / "tables", ignore=shutil.ignore_patterns("clips", ".*"))
        for step in steps:
            if step.command == "settings":
                self._path("editor.toml").write_text("\n".join(step.lines), "utf-8")
                self.settings = read_settings(self._path("editor.toml"), EditorApp.theme_names())
        for step in givens:
            self._path(step.rest).parent.mkdir(parents=True, exist_ok=True)
            self._path(step.rest).write_bytes("\n".join([*_each(step.lines), ""]).encode())
        self.at_first = {p.name: _text(p) for p in (self.folder / "tables").iterdir() if p.is_file()}
        done = steps[: starts[0]]
        for start, stop in zip(starts, [*starts[1:], len(steps)], strict=True):
            done += self._session(steps[start:stop])
        return done

    def _session(self, steps: list[Step]) -> list[Step]:
        name, *size = steps[0].rest.split()
        self.last_file = f"{name}.csv"
        columns, rows = map(int, size or (80, 24))
        with chdir(self.folder):
            self.app = EditorApp(Workspace(Path("tables", self.last_file)), self.settings)
            try:
                return drive(self.app, lambda pilot: self._all(pilot, steps), (columns, rows), IS_FULL or not self.is_page)
            finally:
                self.app.workspace.close()

    async def _all(self, pilot: Pilot[Any], steps: list[Step]) -> list[Step]:
        done = []
        await painted(pilot.app)
        self.seen = self._lines()
        for step in steps:
            if step.command in SHOWS:
                await settled(pilot)  # a list that opens under a field is laid out once more
                await painted(pilot.app)
                step = replace(step, lines=tuple(self._show(step)))
            elif step.command not in ("table", "given", "settings"):
                await self._do(pilot, step)
                await settled(pilot)
            done.append(step)
        return done

    # ---- what is done

    async def _do(self, pilot: Pilot[Any], step: Step) -> None:
        assert self.app is not None
        words = step.rest.split()
        if step.command == "press":
            for word in words:
                await pilot.press(*(_keys(word[1:]) if word[0] == "=" else [word]))
                await settled(pilot)
        elif step.command == "type":
            await pilot.press(*_keys(step.rest))
        elif step.command == "field":
            self.app.screen.query_one(f"#{words[0]}").focus()
            if text := step.rest.partition(" ")[2]:
                await pilot.press("home", "shift+end", "backspace", *_keys(text))
        elif step.command == "command":
            await self.app.main.run_command(step.rest)
        elif step.command == "facts":
            facts = dict(fact.split("=", 1) for fact in step.rest.split(", "))
            self.app.main.assets.set_context(facts, "")
        elif step.command == "resize":
            await pilot.resize_terminal(int(words[0]), int(words[1]))
        elif step.command == "paste":
            self.app.post_message(Paste(_unescaped(step.rest)))
        elif step.command == "copied":
            self.app.main.assets.clipboard.copy(_unescaped(step.rest))
        elif step.command == "click":
            x, y, *how = words
            button, times = 3 if "right" in how else 1, 2 if "twice" in how else 1
            await pilot.click(offset=(int(x), int(y)), shift="shift" in how, times=times, button=button)
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
        x, y = places[:2]
        await pilot.mouse_down(offset=(x, y))
        for to in zip(places[2::2], places[3::2], strict=True):
            await pilot.hover(offset=((x + to[0]) // 2, (y + to[1]) // 2))
            await pilot.hover(offset=to)
            x, y = to
        await pilot.mouse_up(offset=(x, y))

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
            self.app.main._look()
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
        lines, before = self._lines(), self.seen
        if step.command == "place":
            return iter([lines[self.app.main.query_one(CellLine).region.y].strip()])
        self.seen = lines
        if step.command == "changed":
            different = [line for line, old in zip_longest(lines, before, fillvalue="") if line != old]
            return (line for line, after in zip_longest(different, different[1:]) if line or after)
        first, last = map(int, step.rest.split() or (0, len(lines) - 1))
        return iter(lines[first : last + 1])

    def _lines(self) -> list[str]:
        assert self.app is not None
        return [SCROLL_BAR.sub("", line) for line in screen_text(self.app).splitlines()]

    @property
    def _file(self) -> str:
        """The file of the table that is seen, or was last."""
        assert self.app is not None
        screens = [screen for screen in self.app.screen_stack if isinstance(screen, MainScreen)]
        self.last_file = screens[-1].session.path.name if screens else self.last_file
        return self.last_file

    def _path(self, name: str) -> Path:
        return self.folder / "tables" / name


def _each(lines: tuple[str, ...]) -> Iterator[str]:
    """The lines of a file, each that names the numbers from one to another once for each of them."""
    for line in lines:
        if numbers := NUMBERS.search(line):
            first, last = numbers.groups()
            yield from (line.replace(numbers[0], f"{n:0{len(first)}}") for n in range(int(first), int(last) + 1))
        else:
            yield line


def _keys(text: str) -> list[str]:
    return [KEYS_OF.get(c, c) for c in text]


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


def played(block: Block) -> list[str]:
    """The lines of a block of a page, if all that it shows is as it is now."""
    with TemporaryDirectory() as folder, alone(Path(folder)):
        steps = Replay(Path(folder), is_page=True).shown([*block.common, *block.steps])
    return written(steps[len(block.common) :], block.ending).splitlines()


def updated_page(text: str) -> str:
    """The text of a page, if all that it shows is as it is now."""
    lines = text.splitlines()
    for block in reversed(read_page(text)):
        lines[block.start : block.stop] = played(block)
    return "\n".join(lines) + "\n"
