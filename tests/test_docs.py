"""README.md, docs/ and tests/transcripts/ show what the commands really print; `documents.py` says what can stand in them.

`python tests/test_docs.py --update [FILES]` writes into them what the commands print now.
"""

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from documents import ROOT, TRANSCRIPTS, UTF8, blocks, session, shown, steps, updated
from strategies import IS_FULL, some
from warm_start import python

from tui.app import EditorApp
from tui.editor_settings import read_settings
from tui.themes import LIGHT

UNRUN = {
    "programmers.md": "a program in C, which tests/test_c_header.py compiles and runs",
    "engines.md": "a program in C, which tests/test_engines.py compiles and runs",
    "live.md": "seconds of a running game; tests/test_live_command.py asks the sample table for what they say",
}
"""Pages with output under a block of the shell or of C, which no session of a page can run, and what holds it instead."""
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize(
    "document", [*sorted(TRANSCRIPTS.glob("*.md")), *some(DOCUMENTS, 4)], ids=lambda p: p.relative_to(ROOT).as_posix()
)
def test_a_document_shows_what_its_commands_print(document: Path):
    lines = document.read_text(encoding="utf-8").splitlines()
    with session(IS_FULL, document.parent == TRANSCRIPTS) as now:
        for step in steps(lines):
            assert now.run(step) == shown(lines, step), f"{document.name}, line {step.first}: {step.source}"


def test_output_stands_under_what_a_page_runs_or_another_test_holds_it():
    unrun = set()
    for page in DOCUMENTS:
        lines = page.read_text(encoding="utf-8").splitlines()
        found = list(blocks(lines))
        for block, after in pairwise(found):
            between = "".join(lines[block.stop + 1 : after.first - 1]).strip()
            if block.language in ("sh", "c", "py") and after.language == "text" and not between:
                unrun.add(page.name)
    assert unrun == set(UNRUN)


def test_an_update_writes_the_real_output_under_each_command():
    console = ["```console", "$ python -c \\", "  'print(1); print(2)'", "old", "", "$ echo $?", "9", "```"]
    lines = [*console, "", "```python", "print(3)", "```"]
    assert updated(lines)[3:6] == ["1", "2", "$ echo $?"]
    assert updated(lines)[6:] == ["0", "```", "", "```python", "print(3)", "```", "", "```text", "3", "```"]
    assert updated(updated(lines)) == updated(lines)
    assert updated(["```pycon", ">>> for i in (1, 2):", "...     print(i)", ">>> print(3)", "```"])[3:7] == [
        "1",
        "2",
        ">>> print(3)",
        "3",
    ]
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
    assert settings.keys == {"duplicate": "ctrl+w", "sort": "f10"}


if __name__ == "__main__" and sys.argv[1:2] == ["--update"]:
    for path in [Path(name).absolute() for name in sys.argv[2:]] or [*DOCUMENTS, *sorted(TRANSCRIPTS.glob("*.md"))]:
        text = path.read_text(encoding="utf-8")
        new = "\n".join(updated(text.splitlines(), path.parent == TRANSCRIPTS)) + "\n"
        if new != text:
            path.write_text(new, encoding="utf-8")
            print(f"updated {path.relative_to(ROOT).as_posix()}")
