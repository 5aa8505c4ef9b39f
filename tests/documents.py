"""Documents that show what commands print: pages of docs/, and transcripts of the tests.

Each document is one session, run from top to bottom: a page beside fresh copies of tables/ and examples/, a transcript in an empty
folder.

- In a ```console block, lines that begin with `$ ` are commands (a `\\` at the end continues them) and the lines under each are its
  output, standard error included. Commands are `contextdb …`, `python …`, and `echo $?`, the last exit code.
- A ```python block runs; what it prints stands in a ```text block right under it. In a ```pycon block it stands under the lines of
  each statement, which begin with `>>> ` and `... `.
- A block whose fence names a file, such as ```csv tackles/dives.csv, is that file from there on.
- `| grep TEXT`, `| head -3` and `| tail -3` behind a command show a part of what it prints.
- What cannot be run (installing, make) stands in a ```sh block, or ```py for Python.

A transcript has more: the programs of `PROGRAMS`, such as `cat FILE`, and `sed -i s/OLD/NEW/ FILE` for plain text; settings before
a command, such as `COLUMNS=60`. An exit code that is not 0 stands in
brackets under the output, with an `o` where 2 comes with standard output, and an `e` where another code comes with standard error.
"""

import contextlib
import io
import itertools
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

from warm_start import python

from contextdb.cli import main

ROOT = Path(__file__).parent.parent
TRANSCRIPTS = ROOT / "tests" / "transcripts"
UTF8 = {**os.environ, "PYTHONUTF8": "1"}
TERMINAL = {"NO_COLOR": "1", "COLUMNS": "100", "PYTHONUTF8": "1", "PYTHONUNBUFFERED": "1"}
GIT = {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull, "GIT_CEILING_DIRECTORIES": tempfile.gettempdir()}
GIT |= {
    f"GIT_{who}_{what}": text
    for who in ("AUTHOR", "COMMITTER")
    for what, text in {"NAME": "a", "EMAIL": "a@example.com", "DATE": "2026-01-01T00:00:00Z"}.items()
}


def replace(option: str, words: str, *files: str) -> str:
    """`sed -i s/OLD/NEW/`, for plain text; a text that is not there is a mistake of the document."""
    _, old, new, _ = words.replace("\\n", "\n").split(words[1])
    for file in files:
        text = Path(file).read_text("utf-8")
        if option != "-i" or old not in text:
            raise ValueError(f"{file} does not have {old!r}")
        Path(file).write_text(text.replace(old, new), "utf-8")
    return ""


def copy(option: str, *paths: str) -> None:
    shutil.copytree(*paths) if option == "-r" else shutil.copy(option, *paths)


def remove(*paths: str) -> None:
    for path in paths:
        shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)


def git(*words: str) -> str:
    return subprocess.run(["git", *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8").stdout.rstrip()


PROGRAMS: dict[str, Callable[..., str | None]] = {
    "cat": lambda file: Path(file).read_text("utf-8").rstrip(),
    "cp": copy,
    "git": git,
    "ls": lambda folder=".": "\n".join(sorted(os.listdir(folder))),
    "mkdir": os.makedirs,
    "mv": lambda old, new: shutil.move(old, new) and "",
    "rm": remove,
    "sed": replace,
}
"""What a transcript can run beside contextdb and python."""
FILTERS: dict[str, Callable[[str, str], str]] = {
    "grep": lambda text, part: "\n".join(line for line in text.splitlines() if part in line),
    "head": lambda text, count: "\n".join(text.splitlines()[: -int(count)]),
    "tail": lambda text, count: "\n".join(text.splitlines()[int(count) :]),
}
"""What can stand behind a pipe: `grep TEXT`, `head -3`, `tail -3`."""


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
    is_transcript: bool = False
    terminal: dict[str, str] = field(default_factory=lambda: TERMINAL)
    names: dict[str, Any] = field(default_factory=lambda: {"__name__": "__main__"})
    exit_code: int = 0
    stray: str = ""
    """`o` where the last command could not be done and yet wrote on standard output, `e` where it was and wrote an error."""

    def run(self, step: Step) -> str:
        """What the step prints."""
        if step.file:
            return self._write(step.file, step.source)
        if step.is_python:
            return self._python(step.source)
        words, *filters = [list(part) for is_pipe, part in itertools.groupby(shlex.split(step.source), "|".__eq__) if not is_pipe]
        text = self._transcribed(words) if self.is_transcript else self._command(words)
        for name, word in filters:
            text = FILTERS[name](text, word)
        status = f"{self.exit_code or ''}{self.stray}" if self.is_transcript else ""
        return f"{text.rstrip()}\n[{status}]".lstrip() if status else text.rstrip()

    def _write(self, file: str, text: str) -> str:
        path = self.folder / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n", encoding="utf-8")
        return ""

    def _python(self, source: str) -> str:
        printed = io.StringIO()
        with contextlib.chdir(self.folder), contextlib.redirect_stdout(printed):
            exec(compile(source, "<document>", "exec"), self.names)
        return printed.getvalue().rstrip()

    def _transcribed(self, words: list[str]) -> str:
        """What a command of a transcript prints."""
        n_set = sum(1 for _ in itertools.takewhile(re.compile(r"[A-Z_]+=").match, words))
        self.terminal = TERMINAL | GIT | dict(word.split("=", 1) for word in words[:n_set])
        return self._command(words[n_set:]).replace("\r\n", "\n").replace(str(self.folder), "/here")

    def _command(self, words: list[str]) -> str:
        if words == ["echo", "$?"]:
            return str(self.exit_code)
        if self.is_transcript and words[0] in PROGRAMS:
            self.exit_code, self.stray = 0, ""
            with contextlib.chdir(self.folder), mock.patch.dict(os.environ, self.terminal):
                return str(PROGRAMS[words[0]](*words[1:]) or "")
        start = {"contextdb": python("-m", "contextdb"), "python": python()}
        if words[0] not in start:
            raise ValueError(f"a console block runs contextdb, python and echo $?, not {words[0]}: use a ```sh block")
        if words[0] == "contextdb" and not self.in_processes:
            return self._here(words[1:])
        done = subprocess.run(
            [*start[words[0]], *words[1:]],
            cwd=self.folder,
            env={**os.environ, **self.terminal},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
        )
        self.exit_code = done.returncode
        return done.stdout

    def _here(self, words: list[str]) -> str:
        """What a command prints in this process, which starts no other."""
        out, err = streams = [io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2)]
        with contextlib.ExitStack() as stack:
            stack.enter_context(contextlib.chdir(self.folder))
            stack.enter_context(mock.patch.dict(os.environ, self.terminal))
            stack.enter_context(mock.patch("sys.stdin", stack.enter_context(open(os.devnull, encoding="utf-8"))))
            stack.enter_context(contextlib.redirect_stdout(out))
            stack.enter_context(contextlib.redirect_stderr(err if self.is_transcript else out))
            self.exit_code = int(main(words))
        printed, errors = (stream.buffer.getvalue().decode() for stream in streams)
        self.stray = ("o" if printed else "") if self.exit_code == 2 else ("e" if errors else "")
        return printed + errors


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
        elif block.language == "pycon":
            yield from statements(lines, block)
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


def statements(lines: list[str], block: Block) -> Iterator[Step]:
    """The statements of a pycon block."""
    starts = [i for i in range(block.first, block.stop) if lines[i].startswith(">>> ")]
    for start, stop in zip(starts, [*starts[1:], block.stop], strict=False):
        first = next((i for i in range(start + 1, stop) if not lines[i].startswith("... ")), stop)
        yield Step("\n".join(line[4:] for line in lines[start:first]), True, first, stop)


@contextlib.contextmanager
def session(in_processes: bool = True, is_transcript: bool = False) -> Iterator[Session]:
    """A session beside a fresh copy of tables/ and examples/; that of a transcript is in an empty folder, in this process."""
    with tempfile.TemporaryDirectory() as folder:
        for name in () if is_transcript else ("tables", "examples"):
            shutil.copytree(ROOT / name, Path(folder) / name, ignore=shutil.ignore_patterns("__pycache__"))
        yield Session(Path(folder), in_processes and not is_transcript, is_transcript)


def shown(lines: list[str], step: Step) -> str:
    """The output that a document shows for a step."""
    return "\n".join(lines[step.first : step.stop]).rstrip()


def updated(lines: list[str], is_transcript: bool = False) -> list[str]:
    """A document with every output as it is now."""
    with session(is_transcript=is_transcript) as now:
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
