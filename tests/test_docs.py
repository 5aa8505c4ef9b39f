"""README.md and docs/ show what the commands really print.

Each document is one session, run from top to bottom beside fresh copies of tables/ and examples/:

- In a ```console block, lines that begin with `$ ` are commands (a `\\` at the end continues them) and the lines under each are its
  output, standard error included. Commands are `contextdb …`, `python …`, and `echo $?`, the last exit code.
- A ```python block runs; what it prints stands in a ```text block right under it.
- A block whose fence names a file, such as ```csv tackles/dives.csv, is that file from there on.

What cannot be run (installing, make) stands in a ```sh block, or ```py for Python.

`python tests/test_docs.py --update` writes into the documents what the commands print now.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
from strategies import IS_FULL, some
from warm_start import python

from contextdb.cli import main
from tui.app import EditorApp
from tui.editor_settings import read_settings
from tui.themes import LIGHT

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
UTF8 = {**os.environ, "PYTHONUTF8": "1"}
TERMINAL = {"NO_COLOR": "1", "COLUMNS": "100", "PYTHONUTF8": "1", "PYTHONUNBUFFERED": "1"}


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, and its lines first…stop of the document, without the fences."""

    language: str
    first: int
    stop: int
    file: str = ""
    """The file that it is."""


@dataclass(frozen=True)
class Step:
    """A command, a piece of Python or the text of a file, and the lines first…stop of the document that show its output."""

    source: str
    is_python: bool
    first: int
    stop: int
    fenced: bool = True
    """False where the document has no block yet that could show an output."""
    file: str = ""
    """The file that is written; nothing is shown for it."""


@dataclass
class Session:
    """What runs the steps of one document, in one folder."""

    folder: Path
    in_processes: bool = True
    """Whether each command is started as a shell would."""
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})
    exit_code: int = 0

    def run(self, step: Step) -> str:
        """What the step prints."""
        if step.file:
            return self._write(step.file, step.source)
        return self._python(step.source) if step.is_python else self._command(shlex.split(step.source))

    def _write(self, file: str, text: str) -> str:
        path = self.folder / file
        path.parent.mkdir(exist_ok=True)
        path.write_text(text + "\n", encoding="utf-8")
        return ""

    def _python(self, source: str) -> str:
        printed = io.StringIO()
        with contextlib.chdir(self.folder), contextlib.redirect_stdout(printed):
            exec(compile(source, "<document>", "exec"), self.names)
        return printed.getvalue().rstrip()

    def _command(self, words: list[str]) -> str:
        if words == ["echo", "$?"]:
            return str(self.exit_code)
        start = {"contextdb": python("-m", "contextdb"), "python": python()}
        if words[0] not in start:
            raise ValueError(f"a console block runs contextdb, python and echo $?, not {words[0]}: use a ```sh block")
        if words[0] == "contextdb" and not self.in_processes:
            return self._here(words[1:])
        done = subprocess.run(
            [*start[words[0]], *words[1:]],
            cwd=self.folder,
            env={**os.environ, **TERMINAL},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
        )
        self.exit_code = done.returncode
        return done.stdout.rstrip()

    def _here(self, words: list[str]) -> str:
        """What a command prints in this process, which starts no other."""
        printed = io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True)
        with contextlib.ExitStack() as stack:
            stack.enter_context(contextlib.chdir(self.folder))
            stack.enter_context(mock.patch.dict(os.environ, TERMINAL))
            stack.enter_context(mock.patch("sys.stdin", stack.enter_context(open(os.devnull, encoding="utf-8"))))
            stack.enter_context(contextlib.redirect_stdout(printed))
            stack.enter_context(contextlib.redirect_stderr(printed))
            self.exit_code = int(main(words))
        return printed.buffer.getvalue().decode().rstrip()


def blocks(lines: list[str]) -> Iterator[Block]:
    """The fenced blocks of a document."""
    fences = [i for i, line in enumerate(lines) if line.startswith("```")]
    for opening, closing in zip(fences[::2], fences[1::2], strict=True):
        language, _, file = lines[opening][3:].partition(" ")
        yield Block(language.strip(), opening + 1, closing, file.strip())


def steps(lines: list[str]) -> Iterator[Step]:
    """What a document runs, in order."""
    found = list(blocks(lines))
    for block, after in zip(found, [*found[1:], None], strict=False):
        if block.file:
            yield Step("\n".join(lines[block.first : block.stop]), False, block.stop, block.stop, file=block.file)
        elif block.language == "console":
            yield from commands(lines, block)
        elif block.language == "python":
            source = "\n".join(lines[block.first : block.stop])
            if after and after.language == "text" and not "".join(lines[block.stop + 1 : after.first - 1]).strip():
                yield Step(source, True, after.first, after.stop)
            else:
                yield Step(source, True, block.stop + 1, block.stop + 1, fenced=False)


def commands(lines: list[str], block: Block) -> Iterator[Step]:
    """The commands of a console block."""
    starts = [i for i in range(block.first, block.stop) if lines[i].startswith("$ ")]
    for start, stop in zip(starts, [*starts[1:], block.stop], strict=False):
        first = start + 1
        while lines[first - 1].endswith("\\"):
            first += 1
        text = " ".join(line.removesuffix("\\") for line in lines[start:first])
        yield Step(text.removeprefix("$ "), False, first, stop)


@contextlib.contextmanager
def session(in_processes: bool = True) -> Iterator[Session]:
    """A session beside a fresh copy of tables/."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("tables", "examples"):
            shutil.copytree(ROOT / name, Path(folder) / name, ignore=shutil.ignore_patterns("__pycache__"))
        yield Session(Path(folder), in_processes)


def shown(lines: list[str], step: Step) -> str:
    """The output that a document shows for a step."""
    return "\n".join(lines[step.first : step.stop]).rstrip()


def updated(lines: list[str]) -> list[str]:
    """A document with every output as it is now."""
    with session() as now:
        outputs = [(step, now.run(step)) for step in steps(lines)]
    result = list(lines)
    for step, output in reversed(outputs):
        if step.file:
            continue
        new = output.splitlines()
        if not step.fenced and new:
            new = ["", "```text", *new, "```"]
        result[step.first : step.stop] = new
    return result


@pytest.mark.parametrize("document", some(DOCUMENTS), ids=lambda p: p.relative_to(ROOT).as_posix())
def test_a_document_shows_what_its_commands_print(document: Path):
    lines = document.read_text(encoding="utf-8").splitlines()
    with session(in_processes=IS_FULL) as now:
        for step in steps(lines):
            assert now.run(step) == shown(lines, step), f"{document.name}, line {step.first}: {step.source}"


def test_an_update_writes_the_real_output_under_each_command():
    console = ["```console", "$ python -c \\", "  'print(1); print(2)'", "old", "", "$ echo $?", "9", "```"]
    lines = [*console, "", "```python", "print(3)", "```"]
    assert updated(lines)[3:6] == ["1", "2", "$ echo $?"]
    assert updated(lines)[6:] == ["0", "```", "", "```python", "print(3)", "```", "", "```text", "3", "```"]
    assert updated(updated(lines)) == updated(lines)
    assert updated(["A page without commands."]) == ["A page without commands."]


def test_a_block_that_names_a_file_is_that_file_from_there_on():
    file = ["```csv game/moves.csv", "Asset,speed", "Jog,2..", "```"]
    lines = [*file, "```console", "$ contextdb query game/moves.csv speed=3", "```"]
    assert updated(lines)[:6] == [*file, *lines[4:6]]
    assert updated(lines)[6] == "1 of 1 row valid in moves"


def test_a_console_block_refuses_a_command_that_it_does_not_know():
    with pytest.raises(ValueError, match=re.escape("not rm: use a ```sh block")):
        updated(["```console", "$ rm -r tables", "```"])


@pytest.mark.parametrize("page", ["keys", "commands"])
def test_a_page_made_of_the_code_is_as_the_code_is_now(page: str):
    wanted = subprocess.run(
        python("-c", f"import {page}; print({page}.page(), end='')"),
        cwd=ROOT / "docs",
        env=UTF8,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )
    assert (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8") == wanted.stdout, "run: make docs"


def test_the_settings_that_the_editors_page_shows_are_taken(tmp_path: Path):
    lines = (ROOT / "docs" / "editor.md").read_text(encoding="utf-8").splitlines()
    (block,) = (block for block in blocks(lines) if block.language == "toml")
    path = tmp_path / "editor.toml"
    path.write_text("\n".join(lines[block.first : block.stop]), encoding="utf-8")
    settings = read_settings(path, EditorApp.theme_names())
    assert settings.theme == LIGHT
    assert settings.keys == {"duplicate": "ctrl+w", "sort": "shift+f6,f10"}


if __name__ == "__main__" and sys.argv[1:] == ["--update"]:
    for path in DOCUMENTS:
        text = path.read_text(encoding="utf-8")
        new = "\n".join(updated(text.splitlines())) + "\n"
        if new != text:
            path.write_text(new, encoding="utf-8")
            print(f"updated {path.relative_to(ROOT).as_posix()}")
