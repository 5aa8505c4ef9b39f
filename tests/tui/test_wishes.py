"""What a user of Excel wants, looked for without the documents: the everyday word in the palette, or the key that everybody knows.

A wish is found in under 20 seconds: a key takes a quarter of a second, and a screen that is read three.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from pathlib import Path

import pytest
from strategies import in_full_runs
from test_tmux import DEADLINE_S, Terminal, terminal

__all__ = ["terminal"]
"""A fixture of another file."""

pytestmark = pytest.mark.skipif(shutil.which("tmux") is None or shutil.which("git") is None, reason="tmux or git is not installed")

TABLE = "Asset,speed,gait,hit\nwalk,0..2,Walk,True\nrun,2..6,Run,x\njog,1..3,Run,True\njog,1..3,Run,True\nidle,0,Walk,False\n"
TOML = """[conditions.speed]
type = "number"
min = 0
max = 10
[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
[conditions.hit]
type = "bool"
"""
A_KEY_S, A_SCREEN_S, MOST_S = 0.25, 3.0, 20.0
SIZES = (80, 24), (160, 48)

WISHES = {
    "keep the first column in sight": ("?freeze > Freeze columns", "The columns up to Asset do not scroll."),
    "show only some rows": ("?filter > Filter", "=idle", "Enter", "1 of 5 rows shown"),
    "sort by a column": ("Right", "?sort > Sort", "sorted by speed ▲"),
    "replace a text": ("?replace > Find", "=jog", "Tab", "=trot", "M-a", "4   ?trot"),
    "find a text": ("C-f", "=idle", "Enter", "row 5 · Asset"),
    "hide a column": ("Right", "?hide column > Hide columns", "1 column hidden"),
    "show hidden columns": ("Right", "M-0", "?unhide > Show all columns", "Every column is shown."),
    "a wider column": ("Right", "?wider > Wider", "speed    ↕"),
    "columns as wide as their texts": ("Right", "M-,", "spe… ↕", "?fit columns > Autofit", "speed  ↕"),
    "copy a row": ("?copy row > Duplicate", "Duplicate walk."),
    "a new row": ("Down", "?add row > Insert row", "Insert 1 row."),
    "remove a row": ("?remove row > Delete rows", "Delete walk."),
    "a drop-down of values": ("Right", "Right", "?drop-down > Choose", "1 of 2 declared values"),
    "allowed values of a column": ("?allowed values > Sheet of columns", "Walk Run"),
    "type of a column": ("?data type > Sheet of columns", "condition │ number"),
    "unit of a column": (
        *("?unit > Sheet of columns", "Down", "Right", "Right", "Right", "=km", "Enter", "C-s"),
        *("Change the column speed.", "│ km "),
    ),
    "a comment": ("?comment > Note", "=as in the film", "Enter", "note: as in the film"),
    "mark a row with a colour": ("?highlight > Colour rows", "=green", "Enter", "green"),
    "fill down": ("Right", "S-Down", "C-d", "Fill down 2 × 1."),
    "copy a block": ("Right", "S-Right", "C-c", "Down", "C-v", "Paste 1 × 2."),
    "paste CSV text": ("C-End", "Down", "Home", '%hop,1..2,Walk,True\nhip,2,Run,False\n', "Enter", "7    hip "),
    "take a step back, and again": ("=stroll", "Enter", "C-z", "C-y", "Redo: Type Asset of walk."),
    "go to a row": ("C-g", "=idle", "Enter", "row 5 · Asset"),
    "another name of the table": ("?rename sheet > Rename table", "=moves", "Enter", "moves  Assets"),
    "remove duplicates": ("?remove duplicates > Drop duplicates", "Delete jog."),
    "compare with yesterday": ("Right", "?compare > Git history", "walk: faster"),
    "who changed this": ("Right", "?who changed > Git history", "Ana"),
    "the version before": ("Right", "?previous version > Git history", "first"),
    "an Excel file of the table": ("?save as excel > Export", "Enter", "Wrote t.xlsx."),
    "rows of another sheet": ("?import > Import", "=week.csv", "Enter", "1 added", "F6", "hop"),
    "how often each value is there": ("?count > Values", "4 texts in 5 rows"),
    "what is wrong": ("?errors > Problems", "1 error"),
    "the next error": ("?next error > Next failing", "row 2 · hit"),
    "what is missing": ("?gaps > Coverage", "Contexts without a valid row"),
}  # fmt: skip
"""What is wanted, and what a newcomer does: a word and the first command found by it (?), a key, a text (=), a paste (%), or what
the screen shows then."""


def commit(folder: Path, message: str) -> None:
    for words in (["init", "-q"], ["add", "-A"], ["-c", "user.name=Ana", "-c", "user.email=a@b", "commit", "-qm", message]):
        subprocess.run(["git", *words], cwd=folder, check=True)


def listed(screen: str) -> list[str]:
    """What stands in the palette, line by line: what is typed, then the commands, each with its sentence."""
    lines = screen.splitlines()
    top = next((at for at, line in enumerate(lines) if "╭─ Commands ─" in line), len(lines) - 1)
    left, right = lines[top].find("╭"), lines[top].rfind("╮")
    return [text for line in lines[top + 1 :] if (text := line[left + 1 : right].strip())]


def first_found(terminal: Terminal, word: str, label: str) -> None:
    """Type a word into the palette, and take the first command that it lists once that is this one."""
    terminal.keys("C-p")
    terminal.wait("╭─ Commands ─")
    terminal.raw(word)
    end = time.monotonic() + DEADLINE_S
    while listed(shown := terminal.screen)[:2] != [word, label]:
        assert time.monotonic() < end, f"{label} is not the first that {word} finds:\n{shown}"
        time.sleep(0.02)
    terminal.keys("Enter")
    terminal.wait_without("╭─ Commands ─")


@in_full_runs  # tests/tui/test_palette.py every day
@pytest.mark.parametrize(("wish", "size"), [(wish, SIZES[at % 2]) for at, wish in enumerate(WISHES)], ids=WISHES)
def test_a_wish_of_an_excel_user_is_found_in_twenty_seconds_without_the_documents(terminal, wish, size):
    folder = terminal.folder
    (folder / "contextdb.toml").write_text(TOML)
    (folder / "week.csv").write_text("Asset,speed,gait,hit\nhop,1..2,Walk,True\n")
    for speed, message in (("0..1", "first"), ("0..2", "walk: faster")):
        (folder / "t.csv").write_text(TABLE.replace("0..2", speed))
        commit(folder, message)
    terminal.start("screen-256color")
    terminal.resize(*size)
    terminal.wait_for_foot(size[1], "row 1 · Asset")
    took_s = 0.0
    for step in WISHES[wish]:
        if step[0] == "?":
            word, _, label = step[1:].partition(" > ")
            first_found(terminal, word, label)
            took_s += A_SCREEN_S + A_KEY_S * (len(word) + 2)
        elif step[0] == "=":
            terminal.raw(step[1:])
            took_s += A_KEY_S * len(step[1:])
        elif step[0] == "%":
            terminal.tmux("set-buffer", step[1:])
            terminal.tmux("paste-buffer", "-p")
            terminal.wait("Split at the commas")
            took_s += A_SCREEN_S
        elif re.fullmatch(r"(?:[CMS]-)?(?:[A-Z][a-z]+|F\d|[\w,])", step):
            terminal.keys(step)
            took_s += A_KEY_S
        else:
            terminal.wait(step)
            took_s += A_SCREEN_S
    assert took_s < MOST_S
