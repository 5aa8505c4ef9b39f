"""Killed with SIGKILL at any moment while editing and saving: the file is the old or the new one, and all edits but the one in
progress come back."""

import os
import random
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from saved_bytes import bytes_for
from strategies import IS_FULL
from warm_start import python

from tui.model.session import Session
from tui.model.watched import digest_of

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="SIGKILL and fork are of POSIX systems")

N_KILLS = 100 if IS_FULL else 8
HERE = Path(__file__).parent


@dataclass
class Told:
    """What an editor said before it died."""

    file: str
    """The digest of the file's bytes that it was sure of."""
    table: str
    """The digest of the bytes that the table would have."""
    saving: str = ""
    about: str = ""
    n_edits: int = 0
    n_saves: int = 0

    def hear(self, word: str, digest: str) -> None:
        if word == "saved":
            self.file, self.saving, self.n_saves = digest, "", self.n_saves + 1
        elif word == "done":
            self.table, self.about, self.n_edits = digest, "", self.n_edits + 1
        else:
            setattr(self, word, digest)


@contextmanager
def editors(path: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that forks editors of one table; see killed_editor.py."""
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[1]), "POLARS_MAX_THREADS": "1"}
    command = python(HERE / "killed_editor.py", path)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as process:
        yield process
        process.stdin.close()


def kill_one(process: subprocess.Popen[str], told: Told, seed: int, step: int | None, n_words: int) -> None:
    """Let an editor run until it kills itself at a step, or is killed after so many words."""
    print(seed, *([] if step is None else [step]), file=process.stdin, flush=True)
    pid, n_left = 0, n_words
    for line in iter(process.stdout.readline, ""):
        word, _, digest = line.strip().partition(" ")
        if word == "end":
            return
        if word == "started":
            pid = int(digest)
        else:
            told.hear(word, digest)
            n_left -= 1
        if step is None and pid and n_left <= 0:
            n_left = sys.maxsize
            os.kill(pid, signal.SIGKILL)
    raise AssertionError("the process that forks editors has ended")


def verify(path: Path, told: Told) -> None:
    """The file is old or new, and the next editor has every edit that was told of."""
    file = digest_of(path.read_bytes())
    assert file in (told.file, told.saving)
    session = Session(path)
    assert session.problem is None
    shown = digest_of(bytes_for(session.sheet.table, path))
    assert shown in (told.table, told.about)
    session.close(keep_journal=True)
    told.file, told.table, told.saving, told.about = file, shown, "", ""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    rows = "".join(f"anim_{i},{i}..{i + 5},True,+A -B,\n" for i in range(60))
    file = tmp_path / "t.csv"
    file.write_text("Asset,speed,hit,tags,note\n" + rows, encoding="utf-8")
    return file


@pytest.mark.parametrize("at_steps", [False, True], ids=["at random moments", "inside saves and the journal"])
def test_an_editor_killed_while_it_edits_and_saves_leaves_the_old_or_the_new_file_and_all_edits(path, at_steps):
    start = digest_of(path.read_bytes())
    told, chance = Told(start, start), random.Random(20)
    with editors(path) as process:
        for seed in range(N_KILLS):
            step = chance.randrange(4, 80) if at_steps else None
            kill_one(process, told, seed, step, chance.randrange(0, 40))
            verify(path, told)
    assert told.n_edits > N_KILLS // 2
    assert told.n_saves > N_KILLS // 4


def test_what_kills_left_behind_is_gone_after_the_next_opening(path):
    start = digest_of(path.read_bytes())
    told = Told(start, start)
    with editors(path) as process:
        for seed in range(60):  # a save sweeps what kills before it left
            kill_one(process, told, seed, 12 + seed % 12, 0)
            left = [*path.parent.glob(".contextdb-*.tmp"), *path.parent.glob(".contextdb-journal/.contextdb-*.tmp")]
            if left:
                break
    assert left
    Session(path).close()
    assert not [file for file in left if file.exists()]
