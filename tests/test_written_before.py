"""Files that the version before the packages wrote: each still opens, and says what it said then; or says why it does not.

`tests/written_before` holds a project, a table in Parquet, the journal of an editor that was killed, and a motion database;
`said.json` holds what that version itself read in them. The costs of databases are on another scale today, so these are refused.
"""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from running import ROOT, run

import contextdb as cdb
from contextdb.errors import ArtefactError
from contextdb.motion.storage.stored import open_database
from tui.model.session import Session

WRITTEN = ROOT / "tests/written_before"


def parquet(folder: Path) -> Any:
    table = cdb.load(folder / "dive.parquet")
    return [
        run("verify", str(folder / "dive.parquet"), "--json").json["files"][0]["state"],
        table.assets,
        *map(list, table.columns),
    ]


def journal(folder: Path) -> Any:
    home = folder / ".contextdb-journal"
    home.mkdir()
    shutil.copy(folder / "moves.csv.journal", home)
    session = Session(folder / "moves.csv")
    return [session.sheet.history.names, [list(column) for column in session.sheet.table.columns]]


READERS: dict[str, Callable[[Path], Any]] = {read.__name__: read for read in (parquet, journal)}


def what_is_said(name: str, folder: Path) -> Any:
    """What a file says, as JSON has it."""
    return json.loads(json.dumps(READERS[name](folder)))


@pytest.mark.parametrize("name", READERS)
def test_a_file_written_before_the_packages_says_what_it_said(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    shutil.copytree(WRITTEN, tmp_path / "game")
    monkeypatch.chdir(tmp_path)
    said = json.loads((WRITTEN / "said.json").read_text(encoding="utf-8"))
    assert what_is_said(name, Path("game")) == said[name]


def test_a_database_with_costs_on_the_old_scale_is_refused_with_the_reason():
    message = "layout 1; this version reads layout 4.* build it again with `contextdb motion build`"
    with pytest.raises(ArtefactError, match=message):
        open_database(WRITTEN / "walk.database.safetensors")
