"""Arrays in .safetensors files: what is written is read as views of the file, and a file that cannot be used is refused."""

import json
import mmap
import os
import random
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of
from safetensors import safe_open
from safetensors.numpy import save as as_safetensors

from contextdb.errors import ArtefactError, FileError
from contextdb.files.tensors import FileKind, digest_of, read_tensors, texts_from_array, texts_to_array, write_tensors

KIND = FileKind("things", 3, "a thing", "a thing of this version", "to make the thing again")
DTYPES = ("<u8", "<i8", "<f8", "<i4", "<f4", "<u2", "u1", "?", ">f4", ">i8")

arrays = arrays_of.arrays(
    st.sampled_from([np.dtype(d) for d in DTYPES]), arrays_of.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4)
)
tensors = st.dictionaries(st.text(st.characters(exclude_categories=["Cs"]), max_size=5), arrays, max_size=5).filter(
    lambda found: "__metadata__" not in found
)


def refusal(path: Path) -> str:
    """Why a file is refused."""
    with pytest.raises(ArtefactError) as caught:
        read_tensors(path, KIND)
    (fault,) = caught.value.faults
    assert (fault.place.file, fault.rule) == (str(path), "bad-artefact")
    assert (fault.accepted, fault.mend) == ("a thing of this version", "to make the thing again")
    return fault.found


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.safetensors"
    write_tensors(path, KIND, {"a": np.arange(3), "b": np.array([True, False])}, {"about": "{}"})
    return path


# ---- out and in


@given(tensors, st.dictionaries(st.text(st.characters(exclude_categories=["Cs"]), max_size=5), st.text(max_size=5), max_size=3))
def test_what_is_written_is_read(tmp_path_factory, written, metadata):
    path = tmp_path_factory.getbasetemp() / "t.safetensors"
    metadata = {key: value.encode("utf-8", "replace").decode() for key, value in metadata.items()}
    write_tensors(path, KIND, written, {**metadata, "things": "3"})
    found, told = read_tensors(path, KIND)
    assert told == {**metadata, "things": "3"}
    assert found.keys() == written.keys()
    for name, array in written.items():
        assert (found[name].dtype, found[name].shape) == (array.dtype.newbyteorder("<"), array.shape)
        assert found[name].tobytes() == array.astype(array.dtype.newbyteorder("<")).tobytes()
        assert found[name].ctypes.data % array.itemsize == 0 or not array.size
    assert digest_of(found) == digest_of(written)


@given(tensors)
def test_any_reader_of_safetensors_reads_the_file(tmp_path_factory, written):
    path = tmp_path_factory.getbasetemp() / "any.safetensors"
    write_tensors(path, KIND, written, {"ключ": "значение"})
    with safe_open(path, framework="numpy") as file:
        assert file.metadata() == {"things": "3", "ключ": "значение"}
        assert set(file.keys()) == written.keys()
        for name, array in written.items():
            np.testing.assert_array_equal(file.get_tensor(name), array, strict=array.dtype.byteorder != ">")


def test_arrays_are_views_of_the_mapped_file_and_cannot_be_written(small: Path):
    found, _ = read_tensors(small, KIND)
    for array in found.values():
        assert not array.flags.writeable
        owner = array
        while isinstance(owner, np.ndarray):
            owner = owner.base
        assert isinstance(owner.obj if isinstance(owner, memoryview) else owner, mmap.mmap)


def test_the_same_arrays_give_the_same_bytes_in_any_order(tmp_path: Path):
    one, other = {"x": np.arange(3.0), "y": np.ones((2, 2), np.float32)}, {}
    other.update(reversed(one.items()))
    write_tensors(tmp_path / "1", KIND, one, {})
    write_tensors(tmp_path / "2", KIND, other, {})
    assert (tmp_path / "1").read_bytes() == (tmp_path / "2").read_bytes()


def test_arrays_in_pieces_are_written_in_their_order(tmp_path: Path):
    whole = np.arange(12).reshape(3, 4)
    write_tensors(tmp_path / "t", KIND, {"turned": whole.T, "some": whole[::2, ::3]}, {})
    found, _ = read_tensors(tmp_path / "t", KIND)
    assert found["turned"].tolist() == whole.T.tolist()
    assert found["some"].tolist() == whole[::2, ::3].tolist()


@pytest.mark.skipif(os.name == "nt", reason="Windows does not replace a file that is mapped")
def test_arrays_stay_as_they_are_while_their_file_is_replaced(small: Path):
    found, _ = read_tensors(small, KIND)
    write_tensors(small, KIND, {"a": np.arange(7)}, {})
    assert found["a"].tolist() == [0, 1, 2]
    assert read_tensors(small, KIND)[0]["a"].tolist() == list(range(7))


@given(st.lists(st.text()))
def test_texts_come_back_from_an_array(texts):
    assert texts_from_array(texts_to_array(texts)) == texts


# ---- digests


def test_a_digest_tells_names_types_shapes_and_contents_apart():
    base = {"a": np.arange(4)}
    others = [
        {"b": np.arange(4)},
        {"a": np.arange(4).astype(np.uint64)},
        {"a": np.arange(4).reshape(2, 2)},
        {"a": np.array([0, 1, 2, 4])},
        {"a": np.arange(4), "b": np.arange(0)},
    ]
    digests = [digest_of(base), digest_of(base, "x"), *map(digest_of, others)]
    assert len(set(digests)) == len(digests)


def test_a_digest_does_not_depend_on_how_an_array_lies_in_memory():
    array = np.arange(6).reshape(2, 3)
    assert digest_of({"a": array}) == digest_of({"a": np.asfortranarray(array)}) == digest_of({"a": array.astype(">i8")})


# ---- files that are refused


def test_a_file_cut_off_anywhere_is_refused(small: Path):
    whole = small.read_bytes()
    for length in range(len(whole)):
        small.write_bytes(whole[:length])
        assert refusal(small)


def test_a_header_with_any_byte_altered_is_refused_or_has_arrays_of_the_file(small: Path):
    whole = small.read_bytes()
    rng = random.Random(1)
    for at in range(8 + int.from_bytes(whole[:8], "little")):
        altered = bytearray(whole)
        altered[at] ^= rng.randrange(1, 256)
        small.write_bytes(altered)
        try:
            found, _ = read_tensors(small, KIND)
        except ArtefactError:
            continue
        assert sum(array.nbytes for array in found.values()) <= len(whole)


def test_a_file_of_another_kind_or_layout_is_refused(small: Path):
    small.write_bytes(as_safetensors({"a": np.zeros(2)}, {"others": "1"}))
    assert refusal(small) == "a .safetensors file, but not a thing."
    small.write_bytes(as_safetensors({"a": np.zeros(2)}, {"things": "2"}))
    assert refusal(small) == "layout 2; this version reads layout 3."
    small.write_bytes(as_safetensors({"a": np.zeros(2, np.float16)}, {"things": "3"}))
    assert refusal(small) == "the file does not hold what its header says (KeyError)."


def test_a_file_that_is_replaced_between_two_looks_is_read_as_one(small: Path):
    """The frame is checked on one file and the arrays mapped from the next: its own header counts."""
    other = as_safetensors({"a": np.arange(5)}, {"things": "2"})

    def replace(*arguments, **more):
        frame = safe_open(*arguments, **more)
        small.unlink()
        small.write_bytes(other)
        return frame

    with mock.patch("safetensors.safe_open", replace):
        assert refusal(small) == "layout 2; this version reads layout 3."


def test_no_file_and_a_folder_are_told_as_such(small: Path):
    with pytest.raises(FileError, match="there is no such file"):
        read_tensors(small.with_name("none"), KIND)
    with pytest.raises(FileError, match="this is a folder"):
        read_tensors(small.parent, KIND)
    with pytest.raises(FileError, match="File name too long"):
        read_tensors(small.with_name("x" * 300), KIND)


def test_the_header_is_json_with_the_arrays_in_the_order_of_the_data(small: Path):
    raw = small.read_bytes()
    header = json.loads(raw[8 : 8 + int.from_bytes(raw[:8], "little")])
    assert header == {
        "__metadata__": {"things": "3", "about": "{}"},
        "a": {"dtype": "I64", "shape": [3], "data_offsets": [0, 24]},
        "b": {"dtype": "BOOL", "shape": [2], "data_offsets": [24, 26]},
    }
