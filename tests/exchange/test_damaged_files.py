"""Whatever a file holds, reading it gives a table or an error in words, never anything else."""

from contextlib import suppress
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contextdb.errors import ContextDBError
from contextdb.exchange.formats import FORMATS, ReadOptions, read, write
from contextdb.exchange.importing import table_of
from contextdb.exchange.mapping import propose
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.table import Table

NAMES = [name for name, one in FORMATS.items() if one.is_read]


@cache
def whole(name: str) -> bytes:
    declared = {"pos": {"type": "enum", "values": ["CB", "FS"]}}
    columns = {"Asset": ["jog", "run"], "speed": ["5..10", "20, 9.99"], "pos": ["CB", "not FS"], "on": ["True", "Any"]}
    return write(Table.from_columns(columns, declared), FORMATS[name])[0]


def reads_or_refuses(name: str, raw: bytes) -> None:
    with suppress(ContextDBError):
        reading = read(raw, f"x.{name}", ReadOptions(name))
        mapped = propose(reading, EMPTY, TableSettings("x"))
        table, _ = table_of(reading, mapped, EMPTY, TableSettings("x"))
        assert [c.n_rows for c in table.columns] == [reading.n_rows] * len(table.columns)


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
def test_a_file_with_some_bytes_changed_is_read_or_refused(name: str, data: st.DataObject):
    raw = bytearray(whole(name))
    for _ in range(data.draw(st.integers(1, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    reads_or_refuses(name, bytes(raw))


@pytest.mark.parametrize("name", NAMES)
@given(data=st.data())
def test_a_file_that_is_cut_or_grown_is_read_or_refused(name: str, data: st.DataObject):
    raw, at = whole(name), data.draw(st.integers(0, 5000))
    more = data.draw(st.binary(max_size=20))
    reads_or_refuses(name, raw[: at % len(raw)] + more)
    reads_or_refuses(name, raw + more)


@pytest.mark.parametrize("name", NAMES)
@given(raw=st.binary(max_size=60) | st.text(st.sampled_from('ab"[]{}:,;\t\n\r<>/|=1.5'), max_size=40).map(str.encode))
def test_any_bytes_are_read_or_refused(name: str, raw: bytes):
    reads_or_refuses(name, raw)
