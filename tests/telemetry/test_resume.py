"""Runs over telemetry that are interrupted, go on, and never count a file twice or an old one."""

import os
import sys

import polars as pl
import pytest

from contextdb.tables.table import Table
from contextdb.telemetry import observe

SCHEMA = {"speed": {"type": "number", "min": 0.0, "max": 10.0}}
TABLE = Table.from_columns({"Asset": ["a", "b"], "speed": ["0..2", "4..5"]}, SCHEMA)


@pytest.fixture
def recorded(tmp_path):
    """Three files of ten moments each, and a folder for what is kept."""
    folder = tmp_path / "telemetry"
    folder.mkdir()
    for i in range(3):
        pl.DataFrame({"speed": [float(i)] * 9 + [7.0 + i / 10]}).write_parquet(folder / f"{i}.parquet")
    return folder


@pytest.fixture
def read(monkeypatch):
    """The names of the files that are read."""
    seen = []
    module = sys.modules["contextdb.telemetry.observe"]
    true = module.observe_file

    def spied(plan, path, *more):
        seen.append(os.path.basename(path))
        return true(plan, path, *more)

    monkeypatch.setattr(module, "observe_file", spied)
    return seen


def test_an_interrupted_run_goes_on_where_it_stopped(recorded, read, tmp_path):
    def interrupt(n_done, n_files):
        if n_done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept", progress=interrupt)
    assert read == ["0.parquet", "1.parquet"]
    told = []
    found = observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept", progress=lambda *args: told.append(args))
    assert read == ["0.parquet", "1.parquet", "2.parquet"]
    assert told == [(2, 3), (3, 3)]
    assert found == observe(TABLE, f"{recorded}/*")


def test_a_changed_file_is_read_anew(recorded, read, tmp_path):
    observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept")
    pl.DataFrame({"speed": [3.0] * 50}).write_parquet(recorded / "1.parquet")
    read.clear()
    found = observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept")
    assert read == ["1.parquet"]
    assert (found.moments, found.uncovered) == (70, 52)


def test_a_changed_table_reads_every_file_anew(recorded, read, tmp_path):
    observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept")
    read.clear()
    wider = Table.from_columns({"Asset": ["a", "b"], "speed": ["0..2", "4..8"]}, SCHEMA)
    assert observe(wider, f"{recorded}/*", resume=tmp_path / "kept").uncovered == 0
    assert len(read) == 3


def test_another_count_column_reads_every_file_anew(recorded, tmp_path):
    frame = pl.DataFrame({"speed": [1.0], "n": [5]})
    for i in range(3):
        frame.write_parquet(recorded / f"{i}.parquet")
    assert observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept").moments == 3
    assert observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept", count="n").moments == 15


def test_damaged_sums_are_worked_out_anew(recorded, read, tmp_path):
    whole = observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept")
    kept = sorted((tmp_path / "kept").iterdir())
    kept[0].write_bytes(kept[0].read_bytes()[:200])
    kept[1].write_bytes(b"")
    kept[2].write_bytes(b"PK\x03\x04 not a zip")
    read.clear()
    assert observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept") == whole
    assert len(read) == 3


def test_a_file_that_could_not_be_read_is_tried_again(recorded, read, tmp_path):
    good = (recorded / "1.parquet").read_bytes()
    (recorded / "1.parquet").write_bytes(good[:-9])
    assert not observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept").is_complete
    (recorded / "1.parquet").write_bytes(good)
    assert observe(TABLE, f"{recorded}/*", resume=tmp_path / "kept").moments == 30
