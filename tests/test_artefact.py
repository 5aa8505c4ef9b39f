"""Artefacts: a table opened from its file answers as the table that was saved; any other file is refused with a reason."""

import errno
import json
import mmap
import os
import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import numpy as np
import polars as pl
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st
from safetensors import safe_open
from safetensors.numpy import save as as_safetensors

from contextdb.cells.facts import cell
from contextdb.cells.kinds import KINDS
from contextdb.compiled.classes import FLAT_BYTES, NumberMasks, TagMasks, ValueMasks, WideMasks
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.errors import ArtefactError, FileError
from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

COLUMNS = pytest.mark.parametrize("flat_bytes", [FLAT_BYTES, 0], ids=["flat", "wide"])
"""How number columns are kept: in flat masks, or all of them in two digits as very long ones are."""

SCHEMA = {
    "ok": {"type": "bool", "description": "Größe, 大きさ"},
    "n": {"type": "int", "min": -3, "max": 9},
    "speed": {"type": "number", "min": 0, "unit": "m/s"},
    "heading": {"type": "angle"},
    "state": {"type": "enum", "values": ["Ground", "Half Air"]},
    "word": {"type": "text"},
    "Defender.Tags": {"type": "tags", "values": ["Move.Run", "InAir"]},
}
ROWS = {
    "Asset": ["run", "jump ✈", 'a "b"\n'],
    "On": ["True", "True", "False"],
    "P": ["1", "-2", ""],
    "W": ["0.5", "", "3"],
    "ok": ["True", "Any", "Any"],
    "n": ["1..3", "not 2", "Any"],
    "speed": ["20, 9.99", "5.. ~2.5", "1 | 3"],
    "heading": ["170, 20", "Any", "0..90"],
    "state": ["Ground", '"Half Air" ~1', "Any"],
    "word": ["a b", "not a", "Any"],
    "Defender.Tags": ["+Move -InAir", "not +InAir", "Any"],
}
CONTEXT = {"ok": True, "n": 3, "speed": 21.5, "heading": -175, "state": "Ground", "word": "b", "Defender.Tags": ["Move.Run"]}


def full_table(flat_bytes: int = FLAT_BYTES) -> CompiledTable:
    """A table of every kind of column, with soft cells and a disabled row."""
    settings = TableSettings("names ünd 表", enabled="On", priority="P", weight="W", fallback="idle ☂", policy="priority")
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        return Table.from_columns(ROWS, SCHEMA, settings, settings.name).compile()


def saved(compiled: CompiledTable, folder: Path, name: str = "t.safetensors") -> Path:
    path = folder / name
    compiled.save(path)
    return path


def refusal(path: Path) -> str:
    """Why a file is refused."""
    with pytest.raises(ArtefactError) as caught:
        CompiledTable.open(path)
    (fault,) = caught.value.faults
    assert fault.rule == "bad-artefact"
    message = str(fault)
    end = " Accepted: a file that this version of contextdb compiled. Try to compile the table again."
    assert message.startswith(f"{path}: ")
    assert message.endswith(end)
    return message[len(f"{path}: ") : -len(end)]


@contextmanager
def patched_failure(name: str, code: int) -> Iterator[None]:
    with mock.patch(name, side_effect=OSError(code, os.strerror(code))):
        yield


# ---- the same table


@COLUMNS
@given(strategies.tables(), st.data())
def test_an_opened_table_answers_as_the_saved_one(tmp_path_factory, flat_bytes: int, table: Table, data: st.DataObject):
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        before = table.compile()
    after = CompiledTable.open(saved(before, tmp_path_factory.getbasetemp()))
    context, _ = data.draw(strategies.contexts(table, has_missing=True, has_sets=True))
    for unknown in ("any", "never"):
        one, other = before.query(context, unknown=unknown), after.query(context, unknown=unknown)
        assert one == other
        assert one.assets == other.assets
        assert one.always.tolist() == other.always.tolist()
        assert before.penalties(context, unknown=unknown).tolist() == after.penalties(context, unknown=unknown).tolist()
        assert [str(r) for r in before.explain(context, unknown=unknown)] == [
            str(r) for r in after.explain(context, unknown=unknown)
        ]


@COLUMNS
@given(strategies.tables(tuple(kind for kind in KINDS if kind != "tags")), st.data())
def test_an_opened_table_answers_many_contexts_as_the_saved_one(
    tmp_path_factory, flat_bytes: int, table: Table, data: st.DataObject
):
    with mock.patch("contextdb.compiled.classes.FLAT_BYTES", flat_bytes):
        before = table.compile()
    after = CompiledTable.open(saved(before, tmp_path_factory.getbasetemp()))
    contexts = [data.draw(strategies.contexts(table))[0] for _ in range(3)]
    columns = {c.name: [context.get(c.name) for context in contexts] for c in before.conditions}
    one, other = before.query_many(columns), after.query_many(columns)
    assert one.counts.tolist() == other.counts.tolist()
    assert one.hits.tolist() == other.hits.tolist()
    assert one.codes.tolist() == other.codes.tolist()


@COLUMNS
def test_every_kind_of_column_and_all_settings_come_back(tmp_path: Path, flat_bytes: int):
    before = full_table(flat_bytes)
    after = CompiledTable.open(saved(before, tmp_path))
    kinds = {type(m) for m in data_of(after).masks}
    assert kinds == {ValueMasks, TagMasks, NumberMasks if flat_bytes else WideMasks}
    assert (after.name, after.policy, after.fallback) == ("names ünd 表", "priority", "idle ☂")
    assert list(after.assets) == ROWS["Asset"]
    assert after.conditions == before.conditions
    assert [after.priorities.tolist(), after.row_weights.tolist()] == [[1, -2, 0], [0.5, 1.0, 3.0]]
    assert [column.to_list() for column in data_of(after).texts] == [ROWS[name] for name in SCHEMA]
    assert after.query(CONTEXT).assets == before.query(CONTEXT).assets == ["run", "jump ✈"]
    assert after.penalties(CONTEXT).tolist() == [0.0, 1.0, 0.0]
    assert after.pick(CONTEXT, rng=1) == "run"
    assert after.query(CONTEXT | {"speed": cell("0..100")}).always.tolist() == [2]
    assert after.nbytes == before.nbytes


@pytest.mark.parametrize("n_rows", [0, 1, 64, 65])
def test_a_table_without_conditions_comes_back(tmp_path: Path, n_rows: int):
    table = Table.from_columns({"Asset": [f"a{i}" for i in range(n_rows)]}).compile()
    assert CompiledTable.open(saved(table, tmp_path)).query({}).assets == list(table.assets)


def test_a_table_without_rows_comes_back(tmp_path: Path):
    columns: dict[str, list[str]] = {name: [] for name in ("Asset", *SCHEMA)}
    table = Table.from_columns(columns, SCHEMA).compile()
    opened = CompiledTable.open(saved(table, tmp_path))
    assert opened.n_rows == 0
    assert opened.query(CONTEXT).indices.tolist() == []
    assert opened.query_many({name: [value] for name, value in CONTEXT.items()}).counts.tolist() == [0]


def test_names_that_are_no_whole_unicode_come_back(tmp_path: Path):
    odd = "half \ud83d of a pair"
    table = Table.from_columns({"Asset": [odd], odd: ["True"]}, {odd: {"type": "bool"}}, TableSettings(odd), odd).compile()
    opened = CompiledTable.open(saved(table, tmp_path))
    assert (opened.name, opened.query({odd: True}).assets) == (odd, [odd])


def test_more_than_a_thousand_conditions_come_back(tmp_path: Path):
    names = [f"c{i}" for i in range(1002)]
    columns = {name: ["True" if i % 2 else "False"] for i, name in enumerate(names)}
    table = Table.from_columns({"Asset": ["a"], **columns}, {name: {"type": "bool"} for name in names}).compile()
    opened = CompiledTable.open(saved(table, tmp_path))
    context = {name: bool(i % 2) for i, name in enumerate(names)}
    assert opened.query(context).assets == ["a"]
    assert opened.query(context | {"c1000": True}).assets == []


def test_the_same_table_gives_the_same_bytes(tmp_path: Path):
    one, other = saved(full_table(), tmp_path, "1.safetensors"), saved(full_table(), tmp_path, "2.safetensors")
    assert one.read_bytes() == other.read_bytes()
    again = saved(CompiledTable.open(one), tmp_path, "3.safetensors")
    assert again.read_bytes() == one.read_bytes()


def test_any_reader_of_safetensors_can_read_the_file(tmp_path: Path):
    with safe_open(saved(full_table(), tmp_path), framework="numpy") as file:
        assert json.loads(file.metadata()["about"])["rows"] == 3
        assert json.loads(bytes(file.get_tensor("assets"))) == ROWS["Asset"]


# ---- by memory map


@COLUMNS
def test_masks_are_views_of_the_mapped_file_and_cannot_be_written(tmp_path: Path, flat_bytes: int):
    opened = CompiledTable.open(saved(full_table(flat_bytes), tmp_path))
    arrays = [data_of(opened).enabled, opened.priorities, opened.row_weights, *(column.codes for column in data_of(opened).texts)]
    for masks in data_of(opened).masks:
        arrays += [masks.low, masks.high, masks.any_mask, masks.bounds] if isinstance(masks, WideMasks) else [masks.masks]
    for array in arrays:
        assert not array.flags.writeable
        assert not array.flags.owndata
        assert isinstance(_owner(array), mmap.mmap)


def _owner(array: object) -> object:
    while isinstance(array, np.ndarray):
        array = array.base
    return array.obj if isinstance(array, memoryview) else array


@pytest.mark.skipif(os.name == "nt", reason="Windows does not replace a file that is mapped")
def test_a_table_that_is_open_answers_on_while_its_file_is_replaced(tmp_path: Path):
    path = saved(full_table(), tmp_path)
    opened = CompiledTable.open(path)
    Table.from_columns({"Asset": ["other"]}).compile().save(path)
    assert opened.query(CONTEXT).assets == ["run", "jump ✈"]
    assert list(CompiledTable.open(path).assets) == ["other"]


# ---- saving


def test_saving_on_a_full_disk_leaves_the_old_artefact_whole(tmp_path: Path):
    path = saved(full_table(), tmp_path)
    before = path.read_bytes()
    with patched_failure("os.fsync", errno.ENOSPC), pytest.raises(FileError, match="the disk is full"):
        Table.from_columns({"Asset": ["other"]}).compile().save(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["t.safetensors"]


def test_a_path_may_be_a_text(tmp_path: Path):
    path = str(tmp_path / "t.safetensors")
    full_table().save(path)
    assert CompiledTable.open(path).n_rows == 3


# ---- files that are refused


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """An artefact of a few hundred bytes, with a mask, a bound and a soft cell."""
    columns = {"Asset": ["a", "b"], "x": ["1..2", "Any"], "y": ["True ~2", "False"]}
    table = Table.from_columns(columns, {"x": {"type": "number"}, "y": {"type": "bool"}})
    return saved(table.compile(), tmp_path)


def test_a_file_with_any_single_byte_altered_is_refused(small: Path):
    whole = small.read_bytes()
    start = 8 + int.from_bytes(whole[:8], "little")
    padding = len(whole[:start]) - len(whole[:start].rstrip(b" "))
    rng = random.Random(1)
    for at in (at for at in range(len(whole)) if not start - padding <= at < start):
        altered = bytearray(whole)
        altered[at] ^= rng.randrange(1, 256)
        small.write_bytes(altered)
        with pytest.raises(ArtefactError):
            CompiledTable.open(small)


def test_altered_blanks_between_header_and_data_change_no_answer(tmp_path: Path):
    for length in range(1, 9):  # the header is filled up to a multiple of eight bytes: with some names there are blanks
        name = "x" * length
        columns = {"Asset": ["a", "b"], name: ["1..2", "Any"], "y": ["True ~2", "False"]}
        table = Table.from_columns(columns, {name: {"type": "number"}, "y": {"type": "bool"}})
        small = saved(table.compile(), tmp_path)
        whole = small.read_bytes()
        end = 8 + int.from_bytes(whole[:8], "little")
        if whole[end - 1 : end] == b" ":
            break
    assert whole[end - 1 : end] == b" "
    for byte in range(256):
        small.write_bytes(whole[: end - 1] + bytes([byte]) + whole[end:])
        try:
            opened = CompiledTable.open(small)
        except ArtefactError:
            continue
        assert bytes([byte]).isspace()
        assert opened.query({name: 1.5, "y": True}).assets == ["a"]


def test_a_file_cut_off_anywhere_is_refused(small: Path):
    whole = small.read_bytes()
    for length in [*range(0, 40), *range(40, len(whole), 7), len(whole) - 1]:
        small.write_bytes(whole[:length])
        assert refusal(small)


def test_a_file_with_something_after_its_end_is_refused(small: Path):
    small.write_bytes(small.read_bytes() + b"\0")
    assert refusal(small).startswith("not a whole .safetensors file (")


def test_what_is_wrong_with_a_file_is_said(small: Path):
    whole = small.read_bytes()
    small.write_bytes(b"")
    assert refusal(small) == "the file has 0 bytes, too few for any artefact."
    small.write_bytes(whole[:-1])
    assert refusal(small).startswith("not a whole .safetensors file (")
    small.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert refusal(small) == "the file was altered: its contents do not match its digest."


@pytest.mark.parametrize("content", [b"Asset,x\na,1\n" * 20, b"\x89PNG\r\n\x1a\n" + bytes(200), b"{" * 5000, b"\xff" * 64])
def test_a_file_of_another_kind_is_refused(small: Path, content: bytes):
    small.write_bytes(content)
    assert refusal(small).startswith("not a whole .safetensors file (")


def test_a_safetensors_file_of_another_program_is_refused(small: Path):
    small.write_bytes(as_safetensors({"weight": np.zeros((2, 2), np.float32)}))
    assert refusal(small) == "a .safetensors file, but not one that contextdb compiled."
    small.write_bytes(as_safetensors({"weight": np.zeros(2, np.float16)}, {"format": "pt"}))
    assert refusal(small) == "a .safetensors file, but not one that contextdb compiled."


def test_another_layout_is_refused_with_both_versions(small: Path):
    small.write_bytes(as_safetensors({"enabled": np.zeros(1, np.uint64)}, {"contextdb": "5", "about": "{}", "digest": ""}))
    assert refusal(small) == "layout 5; this version reads layout 4."


def test_a_file_that_says_nothing_of_its_table_is_refused(small: Path):
    small.write_bytes(as_safetensors({"enabled": np.zeros(1, np.uint64)}, {"contextdb": "4"}))
    assert refusal(small) == "the file does not hold what its header says (KeyError)."


def test_a_missing_artefact_is_named_with_the_nearest_there_is(small: Path):
    wrong = small.with_name("t.safetensor")
    with pytest.raises(FileError) as caught:
        CompiledTable.open(wrong)
    assert str(caught.value) == f'{wrong}: there is no such file. Did you mean "{small}"?'


def test_a_folder_is_no_artefact(small: Path):
    with pytest.raises(FileError, match="this is a folder"):
        CompiledTable.open(small.parent)


def test_a_file_that_may_not_be_read_is_no_broken_artefact(small: Path):
    with (
        patched_failure("safetensors.safe_open", errno.EACCES),
        patched_failure("os.open", errno.EACCES),
        pytest.raises(FileError, match="the file may not be read"),
    ):
        CompiledTable.open(small)


def test_a_parquet_of_contexts_can_be_asked_of_an_opened_table(small: Path):
    contexts = pl.DataFrame({"x": [1.5, 9.0, None], "y": [True, False, True]})
    assert CompiledTable.open(small).query_many(contexts, unknown="any").counts.tolist() == [1, 1, 1]
