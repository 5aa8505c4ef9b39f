"""Each block of keys in pages/ is a session with the editor: what it shows is what the editor shows; every day the first two blocks
under a heading."""

import pytest
import replay
from strategies import IS_FULL

BLOCKS = {
    f"{path.stem}: {block.name}": (path, block)
    for path in replay.PAGES
    for block in replay.read_page(path.read_text("utf-8"))
    if IS_FULL or block.number <= 2
}


@pytest.mark.parametrize("name", BLOCKS)
def test_the_editor_shows_what_a_page_shows(name):
    path, block = BLOCKS[name]
    assert replay.played(block) == path.read_text("utf-8").splitlines()[block.start : block.stop]


PAGE = """# Two

```keys
given t.csv
| A
table t
```

## One claim

```keys
press down
```

```keys
table u
```
"""


def test_blocks_of_a_page_are_named_by_their_heading_and_begin_as_the_page_says():
    blocks = replay.read_page(PAGE)
    assert [block.name for block in blocks] == ["One claim", "One claim 2"]
    assert [[step.words for step in block.common] for block in blocks] == [["given t.csv", "table t"], ["given t.csv"]]
    assert [PAGE.splitlines()[block.start : block.stop] for block in blocks] == [["press down"], ["table u"]]


def test_a_line_that_names_numbers_stands_for_one_of_each():
    assert list(replay._each(("A", "a_{08..10},x"))) == ["A", "a_08,x", "a_09,x", "a_10,x"]
