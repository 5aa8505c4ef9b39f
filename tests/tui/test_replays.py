"""Each file of replays/ is a session with the editor: what it shows is what the editor shows."""

import pytest
import replay
from strategies import some


@pytest.mark.parametrize("path", some(replay.FILES), ids=lambda path: path.stem)
def test_the_editor_shows_what_a_replay_file_shows(path):
    before, now = replay.replayed(path)
    assert now.splitlines() == before.splitlines()


def test_a_replay_file_is_written_as_it_is_read():
    text = "# Say it.\n\ntable t 40 12\npress down\nscreen 0 1\n| a  b\n|\n# the end\n"
    assert replay.written(*replay.read_steps(text)) == text


@pytest.mark.parametrize("text", ["| shown\n", "table t\n# between\n| shown\n"])
def test_what_is_shown_must_stand_under_a_command(text):
    with pytest.raises(replay.ReplayError, match="stands under a command"):
        replay.read_steps(text)


def test_there_are_replays_of_every_part_of_the_editor():
    assert len(replay.FILES) >= 15
