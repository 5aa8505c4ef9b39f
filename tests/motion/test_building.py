"""Building a project's databases: with the cache, after any change, the same to the last bit as without; and only what changed."""

import json
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_once import make_clip
from strategies import IS_FULL, examples, some

from contextdb.errors import ClipError, FileError, MotionError, SchemaError
from contextdb.motion import MotionConfig, MotionDatabase, load_bvh, write_bvh
from contextdb.motion.features.extraction import clip_features
from contextdb.motion.search.database import build_databases
from contextdb.motion.search.filters import Biases
from contextdb.motion.storage import extracting
from contextdb.motion.storage.building import build, build_all, open_or_build, saved_path
from contextdb.motion.storage.clip_files import unmatched
from contextdb.motion.storage.stored import EXTRACTION, FeatureCache, file_name, key_of, save_database

NAMES = ("idle", "jog", "jog_tired", "walk")
SECTIONS = {
    "features": {
        "loco": {
            "rate": 30.0,
            "mirror": [["Left*", "Right*"]],
            "channels": [
                {"type": "position", "bone": "LeftFoot", "weight": 0.75},
                {"type": "velocity", "bone": "Hips"},
                {"type": "trajectory", "what": "position", "at": [0.33, 1.0]},
            ],
        }
    },
    "databases": {
        "jog": {"clips": "clips/*.bvh", "features": "loco", "table": "locomotion"},
        "jog_tired": {"clips": "clips/*_tired.bvh", "features": "loco", "mirror": True, "markup": "marks.csv", "end_s": 0.5},
    },
}


def config_of(**changes):
    """The configuration with some keys of [databases.jog] or of the features changed."""
    sections = json.loads(json.dumps(SECTIONS))
    sections["features"]["loco"] |= changes.pop("features", {})
    sections["databases"]["jog"] |= changes
    return MotionConfig.from_dict(sections, file="contextdb.toml")


CONFIG = config_of()


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "clips").mkdir()
    for name in NAMES:
        write_bvh(make_clip(name).clip, tmp_path / "clips" / f"{name}.bvh", digits=3)
    (tmp_path / "marks.csv").write_text("asset,tag,from,to,value\njog_tired,DoNotChoose,0.5,1,\n", encoding="utf-8")
    return tmp_path


def bits(database):
    """All that a database answers with, as bytes."""
    arrays = [*vars(database.layout).values(), *vars(database.marks).values(), database.root, database.weights]
    arrays += [database.normalisation.offset, database.normalisation.scale, database.starts, database.stops, database.mirrored]
    return [array.tobytes() for array in arrays if isinstance(array, np.ndarray)], database.assets, database.biases


def computed(built):
    return {name: each.computed for name, each in built.items()}


def alter(path):
    """Another motion of the same length: the first value of the last frame is one more."""
    text = path.read_text(encoding="utf-8").rstrip("\n").split("\n")
    values = text[-1].split(" ")
    values[0] = f"{float(values[0]) + 1.0:.3f}"
    path.write_text("\n".join([*text[:-1], " ".join(values)]) + "\n", encoding="utf-8")


def entries(folder):
    return sorted(path.relative_to(folder).as_posix() for path in (folder / ".contextdb-cache").rglob("*.safetensors"))


# ---- with and without the cache


def test_a_build_gives_what_the_clips_give(folder):
    built = build(CONFIG, folder)
    schema = CONFIG.features["loco"]
    clips = {name: CONFIG.load_clips(name, folder) for name in CONFIG.databases}
    assert bits(built["jog"])[1:] == (NAMES, built["jog"].biases)
    usual = Biases(looping=-0.01, continuing=-0.1)
    expected = MotionDatabase.build(clips["jog"], schema, normalisation=built["jog"].normalisation, biases=usual, end_s=0.6)
    assert bits(built["jog"]) == bits(expected)
    assert built["jog"].normalisation is built["jog_tired"].normalisation


def test_databases_of_one_schema_are_those_that_build_databases_makes(folder):
    plain = {"features": "loco", "end_s": 0, "looping_bias": 0, "continuing_bias": 0}
    parts = {name: {"clips": part["clips"], **plain} for name, part in SECTIONS["databases"].items()}
    config = MotionConfig.from_dict({**SECTIONS, "databases": parts})
    clips = {name: config.load_clips(name, folder) for name in parts}
    expected = build_databases(clips, config.features["loco"])
    for name, database in build(config, folder).items():
        assert bits(database) == bits(expected[name])


def test_a_build_from_the_cache_is_the_same_to_the_last_bit_and_computes_nothing(folder):
    without = build(CONFIG, folder, cache=None)
    assert not (folder / ".contextdb-cache").exists()
    first, second = build_all(CONFIG, folder), build_all(CONFIG, folder)
    assert computed(first) == {"jog": NAMES, "jog_tired": ("jog_tired",)}
    assert computed(second) == {"jog": (), "jog_tired": ()}
    assert second["jog"].cached == NAMES
    for name, database in without.items():
        assert bits(first[name].database) == bits(second[name].database) == bits(database)
        assert first[name].digest == second[name].digest


def test_only_a_clip_that_changed_is_computed(folder):
    before = build_all(CONFIG, folder)
    alter(folder / "clips" / "walk.bvh")
    after = build_all(CONFIG, folder)
    assert computed(after) == {"jog": ("walk",), "jog_tired": ()}
    for name, database in build(CONFIG, folder, cache=None).items():
        assert bits(after[name].database) == bits(database)
        assert bits(after[name].database) != bits(before[name].database)  # they share a normalisation


def drop(folder, name):
    (folder / "clips" / f"{name}.bvh").unlink(missing_ok=True)


def add(folder, name):
    write_bvh(make_clip(name).clip, folder / "clips" / f"{name}.bvh", digits=3)


def spoil(folder, name):
    entries_now = sorted((folder / ".contextdb-cache").rglob("*.safetensors"))
    if entries_now:
        entries_now[len(name) % len(entries_now)].write_bytes(name.encode())


edits = st.tuples(st.sampled_from([drop, add, spoil]), st.sampled_from(["idle", "jog", "run", "walk"])) | st.fixed_dictionaries(
    {}, optional={"up": st.sampled_from(["y", "z"]), "mirror": st.booleans(), "end_s": st.sampled_from([0.0, 0.2])}
)


@examples(0.25)
@given(st.lists(st.lists(edits, min_size=1, max_size=3), min_size=1, max_size=4))
def test_after_any_edits_a_build_with_the_cache_is_one_without(tmp_path_factory, rounds):
    folder = tmp_path_factory.mktemp("edits")
    (folder / "clips").mkdir()
    (folder / "marks.csv").write_text("asset,tag,from,to\n", encoding="utf-8")
    add(folder, "jog_tired")
    changes = {}
    for made in rounds:
        for edit in made:
            if isinstance(edit, dict):
                changes |= edit
            else:
                edit[0](folder, edit[1])
        config = config_of(**changes)
        kept, full = build_all(config, folder), build_all(config, folder, cache=None)
        for name, each in full.items():
            assert bits(kept[name].database) == bits(each.database)
            assert kept[name].digest == each.digest


CHANGES = {
    "the unit": ({"metres_per_unit": 0.02}, True),
    "the axis": ({"up": "z"}, True),
    "the rate": ({"features": {"rate": 60.0}}, True),
    "a channel": ({"features": {"channels": [{"type": "velocity", "bone": "Hips"}]}}, True),
    "the root": ({"features": {"root": "Spine"}}, True),
    "a weight of the schema": (
        {"features": {"channels": [{**c, "weight": 2.0} for c in SECTIONS["features"]["loco"]["channels"]]}},
        False,
    ),
    "a group": ({"features": {"channels": [{**c, "group": "g"} for c in SECTIONS["features"]["loco"]["channels"]]}}, False),
    "a weight of the database": ({"weights": {"Hips velocity": 3.0}}, False),
    "a bias": ({"continuing_bias": -0.2}, False),
    "the end": ({"end_s": 1.0}, False),
    "markup": ({"markup": "marks.csv"}, False),
}


@pytest.mark.parametrize(("change", "is_computed"), some(CHANGES.values(), 3), ids=some(CHANGES, 3))
def test_a_changed_setting_gives_what_a_full_build_gives(folder, change, is_computed):
    before = build_all(CONFIG, folder)
    config = config_of(**change)
    after = build_all(config, folder)
    assert computed(after)["jog"] == (NAMES if is_computed else ())
    assert bits(after["jog"].database) == bits(build(config, folder, cache=None)["jog"])
    assert bits(after["jog"].database) != bits(before["jog"].database)
    assert after["jog"].digest != before["jog"].digest


def test_mirroring_computes_the_clips_of_the_database_again_and_keeps_both_sides(folder):
    build(CONFIG, folder)
    config = config_of(mirror=True)
    first, second = build_all(config, folder), build_all(config, folder)
    assert computed(first)["jog"] == NAMES
    assert computed(second)["jog"] == ()
    assert bits(second["jog"].database) == bits(first["jog"].database)
    assert second["jog"].database.assets == tuple(name for name in NAMES for _ in range(2))
    assert second["jog"].database.mirrored.tolist() == [False, True] * 4


def test_the_settings_of_a_database_reach_it(folder):
    config = config_of(base_bias=0.5, looping_bias=-0.25, continuing_bias=-1.5, weights={"Hips velocity": 3.0}, end_s=0.0)
    database = build(config, folder)["jog"]
    assert (database.biases.base, database.biases.looping, database.biases.continuing) == (0.5, -0.25, -1.5)
    assert database.weights.tolist() == [0.75, 3.0, 1.0]
    tired = build(config, folder)["jog_tired"]
    assert tired.biases.base == 0.0
    query = tired.raw(20)
    assert tired.search(query).frame not in range(15, 31)  # DoNotChoose from 0.5 s to 1 s


def test_a_database_of_a_table_holds_the_clips_of_its_assets(folder):
    built = build(CONFIG, folder, {"locomotion": ["walk", "jog", "swim"]})
    assert built["jog"].assets == ("jog", "walk")


def test_assets_without_a_clip_and_clips_that_no_database_holds_are_found(folder):
    rows = {"locomotion": ["walk", "swim", "jog", "swim"], "other": ["idle"]}
    assert unmatched(CONFIG.databases.values(), folder, rows) == ({"locomotion": ["swim"]}, ["idle"])
    assert unmatched(CONFIG.databases.values(), folder, {"locomotion": NAMES}) == ({}, [])


def test_one_database_alone_has_the_normalisation_of_all_of_its_features(folder):
    every = build(CONFIG, folder)
    alone = build(CONFIG, folder, names=["jog_tired"])
    assert list(alone) == ["jog_tired"]
    assert bits(alone["jog_tired"]) == bits(every["jog_tired"])
    with pytest.raises(SchemaError, match=r'there is no \[databases.jgo\].*Did you mean "jog"\?'):
        build(CONFIG, folder, names=["jgo"])


def test_custom_channels_are_computed_each_time_and_never_up_to_date(folder):
    features = {"channels": [{"type": "custom", "function": "height", "size": 1}]}
    config = config_of(features=features).with_functions({"height": lambda poses, path: poses.positions[:, 0, 1:2]})
    for _ in range(2):
        built = build_all(config, folder)
        assert computed(built)["jog"] == NAMES
        assert built["jog"].digest == ""
    assert entries(folder) == []
    with pytest.raises(SchemaError, match=r'no channel has function = "hight".*Did you mean "height"\?'):
        config.with_functions({"hight": lambda poses, path: poses.positions[:, 0]})


# ---- the cache


@pytest.mark.parametrize(
    "broken", [b"", b"\0" * 500, None][:: 1 if IS_FULL else 2], ids=["empty", "zeros", "altered"][:: 1 if IS_FULL else 2]
)
def test_broken_entries_are_computed_again_without_a_word(folder, broken, capfd):
    before = build(CONFIG, folder)
    for entry in (folder / ".contextdb-cache").rglob("*.safetensors"):
        raw = bytearray(entry.read_bytes())
        raw[-1] ^= 1
        entry.write_bytes(bytes(raw) if broken is None else broken)
    after = build_all(CONFIG, folder)
    assert computed(after)["jog"] == NAMES
    assert bits(after["jog"].database) == bits(before["jog"])
    assert computed(build_all(CONFIG, folder))["jog"] == ()
    assert capfd.readouterr() == ("", "")


def test_an_entry_under_the_wrong_key_is_not_taken(folder):
    build(CONFIG, folder)
    one, other = (folder / entry for entry in entries(folder)[:2])
    one.write_bytes(other.read_bytes())
    assert len(build_all(CONFIG, folder)["jog"].computed) == 1


def test_entries_of_another_numpy_are_computed_again(folder, monkeypatch):
    build(CONFIG, folder)
    monkeypatch.setattr(np, "__version__", "1.0")
    assert computed(build_all(CONFIG, folder))["jog"] == NAMES


def test_entries_of_clips_that_changed_or_are_gone_are_removed(folder):
    build(CONFIG, folder)
    before = entries(folder)
    assert len(before) == 4 + 2  # a mirrored range is an entry of its own
    alter(folder / "clips" / "walk.bvh")
    (folder / "clips" / "idle.bvh").unlink()
    build(CONFIG, folder)
    after = entries(folder)
    assert len(after) == 3 + 2
    assert len(set(after) - set(before)) == 1


def test_entries_of_a_database_that_is_no_longer_declared_are_removed(folder):
    build(CONFIG, folder)
    sections = json.loads(json.dumps(SECTIONS))
    del sections["databases"]["jog_tired"]
    build(MotionConfig.from_dict(sections), folder)
    assert [path.name for path in (folder / ".contextdb-cache").glob("*.features")] == ["jog.features"]


def test_what_is_no_entry_stays_where_it_is(folder):
    (folder / "own.features").mkdir()
    (folder / "own.features" / "notes.txt").write_text("mine", encoding="utf-8")
    build(CONFIG, folder, cache=".")
    build(CONFIG, folder, cache=".")
    assert (folder / "own.features" / "notes.txt").read_text(encoding="utf-8") == "mine"
    assert not (folder / ".gitignore").exists()
    assert (folder / "jog.features").is_dir()


def test_a_new_cache_folder_is_ignored_by_git(folder):
    build(CONFIG, folder, cache="deep/cache")
    assert (folder / "deep" / "cache" / ".gitignore").read_text(encoding="utf-8") == "*\n"


def test_a_cache_that_cannot_be_written_is_no_error(folder):
    (folder / ".contextdb-cache").write_text("a file", encoding="utf-8")
    assert computed(build_all(CONFIG, folder))["jog"] == NAMES
    assert computed(build_all(CONFIG, folder))["jog"] == NAMES


def test_an_interrupted_build_keeps_the_clips_that_were_done(folder):
    def stop(done, total, name):
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build(CONFIG, folder, progress=stop)
    assert computed(build_all(CONFIG, folder))["jog"] == ("walk",)


def test_builds_at_once_give_the_same_and_leave_a_whole_cache(folder):
    expected = bits(build(CONFIG, folder, cache=None)["jog"])
    found = []
    builds = [threading.Thread(target=lambda: found.append(build(CONFIG, folder)["jog"])) for _ in range(4)]
    for each in builds:
        each.start()
    for each in builds:
        each.join()
    assert [bits(database) for database in found] == [expected] * 4
    assert computed(build_all(CONFIG, folder)) == {"jog": (), "jog_tired": ()}
    assert len(entries(folder)) == 6


def test_a_clip_that_changes_while_it_is_read_never_stands_under_a_wrong_key(folder, monkeypatch):
    path = folder / "clips" / "walk.bvh"
    real = extracting.extract

    def extract_and_alter(file, cache):
        found = real(file, cache)
        if file.asset == "walk":
            alter(path)
        return found

    monkeypatch.setattr(extracting, "extract", extract_and_alter)
    build(CONFIG, folder)
    monkeypatch.undo()
    after = build_all(CONFIG, folder)
    assert computed(after)["jog"] == ("walk",)
    assert bits(after["jog"].database) == bits(build(CONFIG, folder, cache=None)["jog"])


def test_names_that_no_file_can_have_are_written_otherwise():
    assert file_name("jog", ".features") == "jog.features"
    assert file_name("a/b\\c:d*\n%", ".x") == "a%2Fb%5Cc%3Ad%2A%0A%25.x"
    assert file_name("..", ".features") == "...features"
    assert file_name("дом 表", ".x") == "дом 表.x"


def test_a_database_of_any_name_is_built(folder):
    sections = {
        **SECTIONS,
        "databases": {"../evil\n": {"clips": "clips/*.bvh", "features": "loco"}, "x" * 300: SECTIONS["databases"]["jog"]},
    }
    config = MotionConfig.from_dict(sections)
    build(config, folder)
    assert computed(build_all(config, folder)) == {"../evil\n": (), "x" * 300: NAMES}  # a name too long for a file is not kept
    assert [path.name for path in folder.parent.glob("*evil*")] == []


def test_the_features_of_a_made_clip_are_those_of_this_version_of_the_extraction():
    """The cache takes features of the same EXTRACTION for equal: when this fails, raise EXTRACTION and change the numbers."""
    schema = CONFIG.features["loco"]
    features = clip_features(make_clip("walk").clip, schema, mirrored=True).features.astype(np.float64)
    assert EXTRACTION == 6
    expected = [0.094953, 0.10326, 0.21417, 0.14775, 0.21764, 1.2923, 0.039924, 0.42737, 0.07116, 1.2976]
    assert np.abs(features).mean(axis=0) == pytest.approx(expected, rel=1e-3, abs=1e-4)


def test_a_key_depends_on_the_contents_and_on_what_they_are_taken_for():
    schema = CONFIG.features["loco"]
    base = {"metres_per_unit": 0.01, "up": "y", "mirrored": False, "looping": False}
    others = [{"metres_per_unit": 0.1}, {"up": "z"}, {"mirrored": True}, {"looping": True}]
    keys = [
        key_of(b"a", schema, **base),
        key_of(b"b", schema, **base),
        *(key_of(b"a", schema, **(base | other)) for other in others),
    ]
    assert len(set(keys)) == len(keys)


def test_a_cache_answers_nothing_for_what_it_does_not_hold(tmp_path):
    assert FeatureCache(tmp_path / "none").read("jog", "0" * 32, "walk", mirrored=False) is None


# ---- progress and faults


def test_progress_is_told_clip_by_clip(folder):
    told = []
    build(CONFIG, folder, progress=lambda *at: told.append(at))
    assert told == [(i + 1, 5, name) for i, name in enumerate([*NAMES, "jog_tired"])]


def test_the_faults_of_all_clips_and_databases_are_told_together_and_once(folder):
    (folder / "clips" / "broken_tired.bvh").write_text("HIERARCHY", encoding="utf-8")
    (folder / "clips" / "worse.bvh").write_bytes(b"\0\0")
    with pytest.raises(ClipError) as error:
        build(CONFIG, folder)
    assert [fault.place.file for fault in error.value.faults] == [
        str(folder / "clips" / name) for name in ("broken_tired.bvh", "worse.bvh")
    ]


def test_missing_clips_and_markup_are_told_together(folder):
    (folder / "marks.csv").unlink()
    with pytest.raises(MotionError) as error:
        build(config_of(clips="nowhere/*.bvh"), folder)
    assert len(error.value.faults) == 2
    assert 'contextdb.toml: [databases.jog] no file matches clips = "nowhere/*.bvh".' in str(error.value)
    assert "marks.csv: there is no such file." in str(error.value)


def test_two_clips_of_one_name_are_refused(folder):
    (folder / "clips" / "more").mkdir()
    (folder / "clips" / "more" / "walk.bvh").write_bytes((folder / "clips" / "walk.bvh").read_bytes())
    with pytest.raises(MotionError, match=r'\[databases.jog\] two clips are named "walk": '):
        build(config_of(clips="clips/**/*.bvh"), folder)


def test_markup_that_does_nothing_is_told(folder):
    marks = "asset,tag,from,to\njog_tierd,DoNotChoose,0,1\njog_tired,Move,99,100\nwalk,Move,0,1\n"
    (folder / "marks.csv").write_text(marks, encoding="utf-8")
    faults = [str(fault) for fault in build_all(CONFIG, folder)["jog_tired"].markup_faults]
    assert len(faults) == 3
    assert 'line 2, column "asset": no database holds the asset "jog_tierd".' in faults[0]
    assert 'Did you mean "jog_tired"?' in faults[0]
    assert "line 3" in faults[1]
    assert 'no database holds the asset "walk"' in faults[2]
    shared = config_of(markup="marks.csv")
    assert len(build_all(shared, folder)["jog_tired"].markup_faults) == 2  # jog, which shares the file, holds walk


def test_markup_with_faults_is_refused(folder):
    (folder / "marks.csv").write_text("asset,tag,from,to\njog_tired,DoNotChose,0,1\n", encoding="utf-8")
    with pytest.raises(MotionError, match="DoNotChoose"):
        build(CONFIG, folder)


# ---- saved databases


def save(built, folder):
    for name, each in built.items():
        save_database(each.database, saved_path(folder, name), inputs=each.digest)


def is_mapped(database):
    return not database.layout.blocks.flags.owndata


def test_saved_databases_that_are_up_to_date_are_opened(folder):
    built = build_all(CONFIG, folder)
    save(built, folder)
    opened = open_or_build(CONFIG, folder, progress=lambda *at: pytest.fail("nothing is to be built"))
    assert list(opened) == ["jog", "jog_tired"]
    for name, database in opened.items():
        assert is_mapped(database)
        assert bits(database) == bits(built[name].database)


def test_a_database_that_is_not_saved_or_out_of_date_is_built(folder):
    save(build_all(CONFIG, folder), folder)
    saved_path(folder, "jog").unlink()
    found = open_or_build(CONFIG, folder)
    assert {name: is_mapped(database) for name, database in found.items()} == {"jog": False, "jog_tired": True}
    save(build_all(CONFIG, folder), folder)
    alter(folder / "clips" / "walk.bvh")  # jog_tired does not hold it, but shares the normalisation
    found = open_or_build(CONFIG, folder)
    assert not any(map(is_mapped, found.values()))
    for name, database in build(CONFIG, folder, cache=None).items():
        assert bits(found[name]) == bits(database)


def test_changed_markup_settings_or_assets_put_a_saved_database_out_of_date(folder):
    save(build_all(CONFIG, folder), folder)
    (folder / "marks.csv").write_text("asset,tag,from,to\n", encoding="utf-8")
    found = open_or_build(CONFIG, folder)
    assert {name: is_mapped(database) for name, database in found.items()} == {"jog": True, "jog_tired": False}
    assert not is_mapped(open_or_build(config_of(end_s=0.1), folder)["jog"])
    assert not is_mapped(open_or_build(CONFIG, folder, {"locomotion": ["walk"]})["jog"])


def test_a_broken_saved_file_is_passed_over(folder):
    save(build_all(CONFIG, folder), folder)
    saved_path(folder, "jog").write_bytes(b"broken")
    assert open_or_build(CONFIG, folder)["jog"].assets == NAMES


def test_saved_databases_may_lie_elsewhere(folder):
    (folder / "out").mkdir()
    save(build_all(CONFIG, folder), folder / "out")
    assert is_mapped(open_or_build(CONFIG, folder, saved="out")["jog"])
    assert not is_mapped(open_or_build(CONFIG, folder)["jog"])


def test_clips_that_cannot_be_read_are_an_error_when_opening_too(folder):
    save(build_all(CONFIG, folder), folder)
    (folder / "clips" / "dir.bvh").mkdir()
    with pytest.raises(FileError, match="this is a folder"):
        open_or_build(CONFIG, folder)
    assert load_bvh(folder / "clips" / "walk.bvh").name == "walk"
