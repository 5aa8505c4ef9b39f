"""Saved databases: opened from its file, a database answers every search exactly as the one saved; any other file is refused."""

import json
import mmap
import os
import random
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from safetensors import safe_open
from safetensors.numpy import save as as_safetensors
from strategies import examples

from contextdb.errors import ArtefactError, FileError, MotionError
from contextdb.motion import Channel, FeatureSchema, MotionDatabase
from contextdb.motion.features.schema import schema_to_dict
from contextdb.motion.markup.marks import TagFilter
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.span_faults import Span
from contextdb.motion.search.filters import Biases
from contextdb.motion.storage.stored import inputs_of, open_database, save_database
from contextdb.tables.table import Table

CHANNELS = [
    {"type": "position", "bone": "LeftFoot", "weight": 0.75},
    {"type": "velocity", "bone": "Hips", "group": "speeds"},
    {"type": "trajectory", "what": "position", "at": [0.33, 1.0]},
]
SCHEMA = FeatureSchema.from_dict("loco ☂", {"rate": 30.0, "mirror": [["Left*", "Right*"]], "channels": CHANNELS})
SPANS = [
    Span("walk", "DoNotChoose", 0.5, 1.0),
    Span("*", "Move.On", 0.2, 2.0),
    Span("jog", "CostModifier", 0.0, 0.4, 0.5),
    Span("idle", "Looping"),
    Span("jog", "WarpPosition", 0.5, 0.8),
]


def built(**more):
    clips = [make_clip(name).clip for name in ("walk", "jog", "idle")]
    wanted = {"markup": Markup(SPANS), "mirror": True, "biases": Biases(0.1, -0.2, -0.3), "end_s": 0.3}
    return MotionDatabase.build(clips, SCHEMA, **(wanted | more))


@pytest.fixture(scope="module")
def walking():
    return built()


@pytest.fixture
def saved(walking, tmp_path):
    path = tmp_path / "loco.motion.safetensors"
    save_database(walking, path, inputs="of these clips")
    return path


def refusal(path, **more):
    """Why a file is refused."""
    with pytest.raises(ArtefactError) as caught:
        open_database(path, **more)
    (fault,) = caught.value.faults
    assert (fault.place.file, fault.rule) == (str(path), "bad-artefact")
    assert fault.accepted == "a motion database that this version of contextdb built"
    assert fault.mend == "to build it again with `contextdb motion build`"
    return fault.found


def assert_same(one, other):
    """Two databases of the same fields, to the last bit."""
    assert (one.assets, one.channel_names, one.slices) == (other.assets, other.channel_names, other.slices)
    assert (one.biases, one.schema, one.marks.tags) == (other.biases, other.schema, other.marks.tags)
    for part in ("layout", "marks", "normalisation"):
        here, there = getattr(one, part), getattr(other, part)
        for name in (each.name for each in fields(here)):
            np.testing.assert_array_equal(getattr(here, name), getattr(there, name))
            assert np.asarray(getattr(here, name)).dtype == np.asarray(getattr(there, name)).dtype
    for name in ("starts", "stops", "mirrored", "weights", "features", "root"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


# ---- the same database


def test_every_field_of_a_database_comes_back(walking, saved):
    opened = open_database(saved, verify=True)
    assert_same(opened, walking)
    assert opened.mirrored.tolist() == [False, True] * 3
    assert opened.schema.mirror == (("Left*", "Right*"),)
    assert inputs_of(saved) == "of these clips"


@st.composite
def made_databases(draw):
    """Ranges with gaps between them, over features of few values so that there are ties."""
    lengths = draw(st.lists(st.integers(0, 40), max_size=6))
    gaps = draw(st.lists(st.integers(0, 3), min_size=len(lengths), max_size=len(lengths)))
    starts, at = [], 0
    for length, gap in zip(lengths, gaps, strict=True):
        starts.append(at + gap)
        at += gap + length
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    features = rng.integers(-2, 3, (at, draw(st.integers(1, 5)))).astype(np.float32)
    stops = [start + length for start, length in zip(starts, lengths, strict=True)]
    return MotionDatabase.from_features(features, starts, stops, [f"asset {i % 4}" for i in range(len(lengths))])


@examples(1)
@given(made_databases(), st.data())
def test_an_opened_database_answers_every_search_exactly_as_the_saved_one(tmp_path_factory, before, data):
    path = tmp_path_factory.getbasetemp() / "made.motion.safetensors"
    save_database(before, path)
    after = open_database(path)
    n_frames, n_ranges = before.n_frames, len(before.assets)
    for _ in range(3):
        query = data.draw(st.lists(st.floats(-3, 3, width=32), min_size=before.n_features, max_size=before.n_features))
        flags = data.draw(st.none() | st.lists(st.booleans(), min_size=n_ranges, max_size=n_ranges).map(np.array))
        tags = data.draw(st.none() | st.lists(st.booleans(), min_size=n_frames, max_size=n_frames).map(lambda f: np.array(f, bool)))
        current = data.draw(st.none() | st.integers(-1, n_frames - 1)) if n_frames else None
        valid = None if flags is None else flags.astype(bool)
        assert before.search(query, valid, tags, current) == after.search(query, valid, tags, current)
        assert before.best_of_ranges(query, 1.0, valid) == after.best_of_ranges(query, 1.0, valid)
    assert_same(after, before)


@examples(1)
@given(seed=st.integers(0, 999), tag=st.sampled_from([None, "Move"]), current=st.integers(-1, 60))
def test_an_opened_database_of_clips_answers_as_the_built_one(walking, tmp_path_factory, seed, tag, current):
    path = tmp_path_factory.getbasetemp() / "clips.motion.safetensors"
    if not path.exists():
        save_database(walking, path)
    opened = open_database(path)
    rng = np.random.default_rng(seed)
    query = walking.raw(int(rng.integers(walking.n_frames))) + rng.normal(0.0, 0.3, walking.n_features)
    tags = None if tag is None else TagFilter(include=(tag,))
    valid = rng.random(len(walking.assets)) < 0.7
    one, other = (each.search(query, valid, tags, current) for each in (walking, opened))
    assert one == other
    assert opened.search_many([query, query], valid, tags=tags) == walking.search_many([query, query], valid, tags=tags)
    if one:
        assert opened.channel_costs(one, query) == walking.channel_costs(one, query)
        assert opened.time_s(one) == walking.time_s(one)


def test_the_same_database_gives_the_same_bytes(walking, saved, tmp_path):
    again = tmp_path / "again.safetensors"
    save_database(built(), again, inputs="of these clips")
    assert again.read_bytes() == saved.read_bytes()
    save_database(open_database(saved), again, inputs="of these clips")
    assert again.read_bytes() == saved.read_bytes()


def test_any_reader_of_safetensors_can_read_the_file(saved):
    with safe_open(saved, framework="numpy") as file:
        about = json.loads(file.metadata()["about"])
        assert about["schema"] == {"name": "loco ☂", "keys": schema_to_dict(SCHEMA)}
        assert file.get_tensor("layout.blocks").shape[1:] == (10, 8)


# ---- by memory map


def owner_of(array):
    while isinstance(array, np.ndarray):
        array = array.base
    return array.obj if isinstance(array, memoryview) else array


def test_nothing_that_grows_with_the_frames_is_copied(saved):
    opened = open_database(saved)
    parts = [opened.root, opened.starts, *vars(opened.layout).values(), *vars(opened.marks).values()]
    arrays = [part for part in parts if isinstance(part, np.ndarray) and part.size]
    assert len(arrays) > 9
    assert all(isinstance(owner_of(array), mmap.mmap) for array in arrays)


def test_a_file_that_may_only_be_read_is_opened_and_never_changed(walking, saved):
    saved.chmod(0o444)
    before = saved.read_bytes()
    opened = open_database(saved)
    opened.layout.blocks[:] = 0.0  # a private copy of the page
    assert saved.read_bytes() == before
    assert_same(open_database(saved), walking)


@pytest.mark.skipif(os.name == "nt", reason="Windows does not replace a file that is mapped")
def test_an_open_database_answers_on_while_its_file_is_replaced(walking, saved):
    opened = open_database(saved)
    save_database(built(mirror=False), saved)
    query = walking.raw(30)
    assert opened.search(query) == walking.search(query)
    assert len(open_database(saved).assets) == 3


# ---- schemas


SCHEMAS = [
    {"rate": 60.0, "channels": [{"type": "orientation", "bone": "Head", "relative_to": "Hips", "at": [-0.1, 0.2]}]},
    {"rate": 30.0, "root": "Hips", "facing": ["LeftUpLeg", "RightUpLeg"], "channels": [{"type": "phase"}]},
    {"rate": 29.97, "facing_smooth_s": 0.1, "channels": [{"type": "direction", "bone": "Head", "axis": "-x", "weight": 0.1}]},
    {"rate": 30.0, "channels": [{"type": "phase", "feet": ["A", "B"]}, {"type": "angular_velocity", "bone": "Hips"}]},
    {"rate": 30.0, "channels": [{"type": "custom", "function": "reach", "size": 3}]},
    {"rate": 30.0, "channels": [{"type": "trajectory", "what": "speed", "along": [-0.5, 2.0], "group": "path", "weight": 0.0},
                                {"type": "velocity", "bone": "Hips", "weight": 1e-3}]},
]  # fmt: skip


@pytest.mark.parametrize("mapping", SCHEMAS, ids=lambda mapping: mapping["channels"][0]["type"])
def test_a_schema_is_read_back_from_its_dictionary(mapping):
    schema = FeatureSchema.from_dict("s", mapping)
    again = json.loads(json.dumps(schema_to_dict(schema)))
    assert FeatureSchema.from_dict("s", again) == schema
    assert again.keys() == mapping.keys()


def test_a_schema_that_could_not_be_read_back_is_not_saved(tmp_path):
    schema = FeatureSchema("odd", 30.0, (Channel("velocity", bone="Hips", weight=0.0),))
    database = MotionDatabase.build([], schema)
    with pytest.raises(MotionError, match=r'the schema "odd" cannot be saved: .*the weight of every channel is 0'):
        save_database(database, tmp_path / "t.safetensors")
    assert list(tmp_path.iterdir()) == []


# ---- files that are refused


def test_an_altered_byte_is_found_at_once_or_when_it_is_asked_for(saved):
    whole = saved.read_bytes()
    rng = random.Random(7)
    start = 8 + int.from_bytes(whole[:8], "little")
    header = whole[:start].rstrip(b" ")
    places = [*rng.sample(range(len(header)), 150), *rng.sample(range(start, len(whole)), 150)]
    for at in places:
        altered = bytearray(whole)
        altered[at] ^= rng.randrange(1, 256)
        saved.write_bytes(altered)
        with pytest.raises(ArtefactError):
            open_database(saved, verify=True)


def test_an_altered_index_is_found_without_being_asked_for(walking, saved):
    whole = saved.read_bytes()
    header = json.loads(whole[8 : 8 + int.from_bytes(whole[:8], "little")])
    large = ("layout.blocks", "root")
    for name, entry in header.items():
        if name != "__metadata__" and entry["data_offsets"][0] < entry["data_offsets"][1]:
            altered = bytearray(whole)
            altered[8 + int.from_bytes(whole[:8], "little") + entry["data_offsets"][0]] ^= 1
            saved.write_bytes(altered)
            if name in large:
                assert len(open_database(saved).assets) == len(walking.assets)
            else:
                assert refusal(saved) == "the file was altered: its contents do not match its digest."
            assert refusal(saved, verify=True) == "the file was altered: its contents do not match its digest."


def test_a_file_cut_off_anywhere_is_refused(saved):
    whole = saved.read_bytes()
    for length in [*range(0, 40), *range(40, len(whole), 997), len(whole) - 1]:
        saved.write_bytes(whole[:length])
        assert refusal(saved)


def test_foreign_files_are_refused_with_a_reason(saved, tmp_path):
    saved.write_bytes(as_safetensors({"weight": np.zeros((2, 2), np.float32)}))
    assert refusal(saved) == "a .safetensors file, but not a motion database of contextdb."
    Table.from_columns({"Asset": ["a"]}).compile().save(saved)
    assert refusal(saved) == "a .safetensors file, but not a motion database of contextdb."
    saved.write_bytes(b"HIERARCHY\nROOT Hips\n" * 9)
    assert refusal(saved).startswith("not a whole .safetensors file (")
    saved.write_bytes(as_safetensors({"starts": np.zeros(1)}, {"contextdb.motion": "7"}))
    assert refusal(saved) == "layout 7; this version reads layout 4."
    saved.write_bytes(as_safetensors({"starts": np.zeros(1)}, {"contextdb.motion": "4"}))
    assert refusal(saved) == "the file does not hold what its header says (KeyError)."
    with pytest.raises(FileError, match="there is no such file"):
        open_database(tmp_path / "none.safetensors")
