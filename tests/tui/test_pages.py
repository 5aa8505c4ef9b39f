"""Each block of keys in pages/ is a session with the editor: what it shows is what the editor shows."""

import pytest
import replay

BLOCKS = {
    f"{path.stem}: {block.name}": (path, block) for path in replay.PAGES for block in replay.read_page(path.read_text("utf-8"))
}


@pytest.mark.parametrize("name", BLOCKS)
def test_the_editor_shows_what_a_page_shows(name):
    path, block = BLOCKS[name]
    assert replay.played(block) == path.read_text("utf-8").splitlines()[block.start : block.stop]
