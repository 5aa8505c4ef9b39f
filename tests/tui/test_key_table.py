"""The page of keys: it has every key of the program, and what it says of terminals is what they send and what the editor reads."""

import shutil
from pathlib import Path

import pytest
from test_tmux import TMUX_NAMES, Terminal

from docs import keys, terminals
from tui.commands import COMMANDS
from tui.debug.keys import KEYS

ROWS = keys.all_keys()
SCROLLING = {"select-up-end", "select-down-end", "select-first", "select-last"}
"""Windows Terminal scrolls with their keys."""
IN_TABS = [row for names in keys.SECTIONS.values() for name in names for row, _ in keys.rows_of(name)]


def is_read_everywhere(key: str) -> bool:
    """Taken keys have another one that is not, or paste and scroll, as wanted."""
    return key in terminals.TAKEN or terminals.is_read_everywhere(key)


def test_every_widget_with_keys_has_its_place_on_the_page():
    placed = {name for names in keys.SECTIONS.values() for name in names}
    assert keys.widgets().keys() - set(keys.LISTED) == placed


def test_every_key_that_help_names_has_a_row():
    named = [*(command.keys for command in COMMANDS), *(key.keys for key in KEYS), *IN_TABS]
    rows = {terminals.name(key) for key in ROWS}
    assert {terminals.name(key) for some in named for key in some.split(",") if key} <= rows
    table = keys.page().split("## What terminals send")[1]
    assert [key for key in ROWS if not terminals.is_read_everywhere(key) and f"\n| {terminals.name(key)} |" not in table] == []


def test_the_first_key_of_each_command_is_read_from_every_kind_of_terminal():
    firsts = {command.id: command.keys.split(",")[0] for command in COMMANDS if command.keys}
    assert [name for name, key in firsts.items() if not is_read_everywhere(key)] == []
    assert {name for name, key in firsts.items() if terminals.TAKEN.get(key) == terminals.SCROLLS} == SCROLLING


def test_each_thing_in_a_tab_or_a_dialog_has_a_key_that_every_terminal_sends():
    assert {row for row in IN_TABS if not any(is_read_everywhere(key) for key in row.split(","))} == {"shift+enter"}


@pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")
def test_the_table_says_what_tmux_sends(tmp_path: Path):
    held = {"ctrl": "C-", "alt": "M-", "shift": "S-"}
    asked = [
        key for key in ROWS if key != "ctrl+space" and terminals.name(terminals.read(terminals.xterm(key))) == terminals.name(key)
    ]
    words = []
    for key in asked:
        *before, last = key.split("+")
        name = terminals._sign(last) if terminals.is_sign(last) else TMUX_NAMES.get(last, last.capitalize())
        words += [{"ctrl+@": "C-Space", "shift+tab": "BTab"}.get(key, "".join(held[one] for one in before) + name), "|"]
    made = Terminal(str(tmp_path / "socket"), tmp_path)
    made.start("screen-256color", program=f"{Path(__file__).with_name('raw_reader.py')} sent")
    try:
        made.wait("ready")
        made.keys(*words, "!")
        made.wait("exit code 0")
    finally:
        made.tmux("kill-server")
    sent = dict(zip(asked, (tmp_path / "sent").read_bytes().decode().split("|"), strict=False))
    assert (sent.pop("home"), sent.pop("end")) == ("\x1b[1~", "\x1b[4~")
    assert (terminals.read("\x1b[1~"), terminals.read("\x1b[4~")) == ("home", "end")
    assert sent == {key: terminals.xterm(key) for key in asked if key in sent}
