"""What tests of the live link share: a folder for running games of their own, tables, and waiting without a clock."""

import json
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import contextdb as cdb
from contextdb.telemetry.link.hearing import Hearing, Wanted, hear

SCHEMA: dict[str, dict[str, object]] = {
    "speed": {"type": "number"},
    "gait": {"type": "enum", "values": ["Idle", "Walk", "Half Way"]},
}
CELLS = {"Asset": ["idle", "walk", "run"], "speed": ["0..1", "0.5..3", "2.."], "gait": ["Idle", "Any", "Any"]}
FACTS = {"speed": 2.5, "gait": "Walk"}
LIMIT_S = 30.0


@pytest.fixture
def meeting(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder in which games of this test are met: with a short path, as sockets need one."""
    base = Path(tempfile.mkdtemp(prefix="cdb"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(base))
    yield base / "contextdb"
    shutil.rmtree(base, ignore_errors=True)


def table(**more: Any) -> cdb.CompiledTable:
    """A table of three rows."""
    return cdb.Table.from_columns(CELLS | more.pop("cells", {}), SCHEMA | more.pop("schema", {}), name="jog").compile()


def until(is_so: Callable[[], object]) -> None:
    """Wait until something is so."""
    end = time.monotonic() + LIMIT_S
    while not is_so():
        assert time.monotonic() < end, "it did not come to be so"
        time.sleep(0.001)


def listening(link: cdb.Link, folder: Path, **wanted: Any) -> Hearing:
    """Listen to a link of this process, which is heard from here on."""
    hearing = hear(folder / f"{link.name}.sock", Wanted(**wanted))
    until(lambda: link.is_heard)
    return hearing


def next_lines(hearing: Hearing, kind: str, n: int = 1) -> list[dict[str, Any]]:
    """The next lines of a kind."""
    found: list[dict[str, Any]] = []
    for batch in hearing.batches():
        found += [line for _, line in batch if line["line"] == kind]
        if len(found) >= n:
            return found
    raise AssertionError(f"the link ended after {len(found)} lines")


def recorded(path: Path, kind: str = "ask") -> list[dict[str, Any]]:
    """The lines of a kind in a recording."""
    return [line for text in path.read_text().splitlines() if (line := json.loads(text))["line"] == kind]
