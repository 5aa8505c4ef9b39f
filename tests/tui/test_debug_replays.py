"""Replay files of the debugger show what its screen shows now."""

from pathlib import Path

import debug_replay
import pytest
from replay import replayed


@pytest.mark.parametrize("path", debug_replay.FILES, ids=lambda path: path.stem)
def test_the_debugger_shows_what_a_replay_file_shows(path: Path):
    before, now = replayed(path, debug_replay.DebugReplay)
    assert now.splitlines() == before.splitlines()
