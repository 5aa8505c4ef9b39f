"""Parquet files that are damaged: refused before polars decodes them, and every altered bit of our own found."""

import io
import subprocess
from contextlib import suppress
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run
from warm_start import python

import contextdb as cdb
from contextdb.columns import TextColumn
from contextdb.errors import TableError
from contextdb.files.parquet import read_parquet, rewritten_parquet
from contextdb.files.parquet_frame import UNSEALED, DamagedFrame, require_whole, require_whole_file

CORPUS = sorted((Path(__file__).parent / "corpus/parquet").glob("*.parquet"))


def written(frame: pl.DataFrame, **options) -> bytes:
    out = io.BytesIO()
    frame.write_parquet(out, **options)
    return out.getvalue()


def our_table() -> bytes:
    columns = [TextColumn.of("Asset", ["walk", "run"]), TextColumn.of("speed", ["0..4", "Any"])]
    return rewritten_parquet(columns, None, np.full(2, -1)).raw


def texts_of(raw: bytes) -> list[list[str]]:
    return [column.to_list() for column in read_parquet(raw, "t.parquet")[1]]


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: path.stem)
def test_a_file_that_made_the_decoder_end_the_process_is_refused_in_a_sentence(path: Path):
    with pytest.raises(TableError, match="the file is damaged"):
        read_parquet(path.read_bytes(), path.name)


@pytest.mark.parametrize("path", CORPUS, ids=lambda path: path.stem)
def test_every_command_that_reads_it_ends_with_its_exit_code(path: Path, tmp_path: Path):
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,0..4\n", encoding="utf-8")
    table = str(tmp_path / "t.csv")
    for arguments in (("check", path), ("import", path, tmp_path / "new.csv"), ("evaluate", table, path), ("diff", path, path)):
        result = run(*map(str, arguments))
        assert result.code in (1, 2)
        assert "the file is damaged" in result.out + result.err


def nested(kind: int, depth: int) -> bytes:
    """A file whose footer holds lists, maps or structs within each other."""
    inner = {9: b"\x19", 11: b"\x01\xbb\x00", 12: b"\x1c"}[kind] * depth
    footer = bytes([0x10 | kind]) + inner
    return b"PAR1" + footer + len(footer).to_bytes(4, "little") + b"PAR1"


@pytest.mark.parametrize("kind", [9, 11, 12])
def test_a_footer_that_is_nested_deep_is_refused_by_every_command(kind: int, tmp_path: Path):
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,0..4\n", encoding="utf-8")
    path = tmp_path / "deep.parquet"
    path.write_bytes(nested(kind, 20_000))
    new, table = tmp_path / "new.csv", tmp_path / "t.csv"
    for arguments in (
        ("check", path),
        ("import", path, new),
        ("evaluate", table, path),
        ("verify", path),
        ("motion", "replay", path),
    ):
        result = run(*arguments)
        assert result.code in (1, 2)
        assert "the file is damaged" in result.out + result.err


def test_a_small_file_of_very_many_rows_is_refused_before_it_is_read_and_its_contexts_can_be_evaluated(tmp_path: Path, monkeypatch):
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,0..4\n", encoding="utf-8")
    (tmp_path / "many.parquet").write_bytes(written(pl.select(pl.repeat(1.0, 12_000_000).alias("speed"))))
    assert (tmp_path / "many.parquet").stat().st_size < 100_000
    assert run("evaluate", tmp_path / "t.csv", tmp_path / "many.parquet").code == 0
    monkeypatch.setattr(pl, "read_parquet", lambda _: pytest.fail("the rows were read"))
    for arguments in (("check", tmp_path / "many.parquet"), ("import", tmp_path / "many.parquet", tmp_path / "new.csv")):
        result = run(*arguments)
        assert "the file has 12,000,000 rows of 1 column. Accepted: at most 10,000,000 rows and 100,000,000 cells." in (
            " ".join(f"{result.out} {result.err}".split())
        )


def test_a_watched_folder_keeps_its_table_when_a_damaged_file_takes_its_place(tmp_path: Path):
    (tmp_path / "t.parquet").write_bytes(our_table())
    told: list[object] = []
    with cdb.watch(tmp_path, on_error=told.append, poll_s=None, settle_s=0) as watch:
        (tmp_path / "t.parquet").write_bytes(CORPUS[0].read_bytes())
        watch.poll()
        assert list(watch["t"].assets) == ["walk", "run"]
    assert "damaged" in str(told[0])


def test_every_single_altered_bit_of_our_own_file_is_found():
    raw = our_table()
    for bit in range(8 * len(raw)):
        altered = bytearray(raw)
        altered[bit // 8] ^= 1 << bit % 8
        with pytest.raises(DamagedFrame):
            require_whole(bytes(altered))


def test_a_file_that_another_program_edited_and_whose_metadata_it_kept_is_read(tmp_path: Path):
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow, of the extra bench, keeps metadata")
    (tmp_path / "t.parquet").write_bytes(our_table())
    table = parquet.read_table(tmp_path / "t.parquet").slice(0, 1)
    parquet.write_table(table.replace_schema_metadata(UNSEALED), tmp_path / "t.parquet")
    raw = (tmp_path / "t.parquet").read_bytes()
    assert not require_whole(raw).is_sealed
    assert texts_of(raw) == [["walk"], ["0..4"]]


def test_a_file_with_our_marks_and_the_name_of_another_writer_is_read_without_its_digest():
    raw = our_table().replace(b"Polars (python)", b"parquet-cpp-arr")
    assert not require_whole(raw).is_sealed
    assert texts_of(raw) == texts_of(our_table())


COLUMNS = st.sampled_from(
    [
        pl.Series("a", ["x", None, "y", "x"] * 30),
        pl.Series("b", [1.5, None, 2.0, -0.0] * 30),
        pl.Series("c", [None] * 120),
        pl.Series("d", [["a", "b"], [], None, ["c"]] * 30),
        pl.Series("e", [{"x": 1, "y": [2]}, None, {"x": None, "y": []}, {"x": 3, "y": [4, 5]}] * 30),
        pl.Series("f", ["p", "q", "p", None] * 30, dtype=pl.Categorical),
    ]
)


@given(
    st.lists(COLUMNS, unique_by=lambda series: series.name),
    st.sampled_from(["zstd", "lz4", "snappy", "gzip", "uncompressed"]),
    st.sampled_from([None, 7, 120]),
    st.sampled_from([None, 50]),
    st.integers(0, 120),
)
def test_every_file_that_polars_writes_is_whole(columns, compression: str, group: int | None, page: int | None, n_rows: int):
    frame = pl.DataFrame(columns).head(n_rows)
    raw = written(frame, compression=compression, row_group_size=group, data_page_size=page)
    assert require_whole(raw).writer.startswith("Polars")


@given(st.binary(max_size=40), st.integers(0, 200), st.booleans())
def test_any_bytes_are_whole_or_refused(noise: bytes, at: int, keeps_ends: bool):
    raw = our_table()
    altered = raw[:at] + noise + raw[at + len(noise) :] if keeps_ends else noise
    with suppress(DamagedFrame):
        assert require_whole(altered).start < len(altered)


def test_an_empty_file_and_a_file_that_is_cut_off_are_refused(tmp_path: Path):
    for raw in (b"", b"PAR1", our_table()[:-3]):
        (tmp_path / "t.parquet").write_bytes(raw)
        with pytest.raises(DamagedFrame):
            require_whole_file(tmp_path / "t.parquet")


def test_damaged_telemetry_is_refused_by_a_process_that_goes_on(tmp_path: Path):
    command = python("-m", "contextdb", "coverage", "t.csv", "--telemetry", CORPUS[0])
    (tmp_path / "t.csv").write_text("Asset,speed\nwalk,0..4\n", encoding="utf-8")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, encoding="utf-8", check=False)
    assert (done.returncode, "the file is damaged" in done.stderr + done.stdout) == (2, True)
