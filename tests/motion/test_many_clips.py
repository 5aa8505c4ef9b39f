"""Many clips: the same bytes here, on all cores and on Dask; a run that was killed goes on where it stopped."""

import os
import pickle
import signal
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from made_once import make_clip
from running import run
from strategies import in_full_runs

from contextdb import motion
from contextdb.authoring import clip_looks
from contextdb.disk import engines
from contextdb.errors import MotionError
from contextdb.files import scratch, tensors
from contextdb.motion.features.normalisation import Normalisation
from contextdb.motion.preparing.proposal import ClipHead, key_of
from contextdb.motion.storage import extracting, pose_files
from contextdb.motion.storage.building import build_all
from contextdb.motion.storage.pose_files import poses_alone, save_poses
from contextdb.motion.storage.stored import save_database

NAMES = ("idle", "walk", "run", "walk_turn_left_90", "start_walk")
N = 12


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Clips of which more than three are many."""
    for module in (extracting, pose_files):
        monkeypatch.setattr(module, "MANY", 3)
        monkeypatch.setattr(module, "CHUNK", 4)
    (tmp_path / "clips").mkdir()
    for i in range(N):
        clip = make_clip(NAMES[i % len(NAMES)]).clip
        motion.write_bvh(replace(clip, values=clip.values[i : i + 40]), tmp_path / f"clips/{i:02}.bvh")
    return tmp_path


def config_of(**keys: object) -> motion.MotionConfig:
    channels = [{"type": "position", "bone": "LeftFoot"}, {"type": "trajectory", "what": "position", "at": [0.3]}]
    features = {"jog": {"rate": 30.0, "mirror": [["Left*", "Right*"]], "channels": channels}}
    databases = {"jog": {"clips": "clips/*.bvh", "features": "jog", "mirror": True, **keys}}
    return motion.MotionConfig.from_dict({"features": features, "databases": databases})


CONFIG = config_of()
CORES = partial(engines.on_cores, n_processes=2)


def on_two_cores(work, what, items, named=str, *, is_much=False):
    return CORES(work, what, items, named)


def saved(folder: Path, name: str, run_on: engines.Engines) -> tuple[bytes, bytes, tuple[str, ...]]:
    """The bytes of the database and of the poses, and which clips were computed."""
    built = build_all(CONFIG, folder, engines=run_on)["jog"]
    save_database(built.database, folder / f"{name}.motion.safetensors", inputs=built.digest)
    save_poses(poses_alone(CONFIG, folder, saved=name, engines=run_on)["jog"], folder / f"{name}.poses.safetensors")
    files = [(folder / f"{name}.{kind}.safetensors").read_bytes() for kind in ("motion", "poses")]
    return files[0], files[1], built.computed


def test_all_cores_build_the_same_bytes_and_fill_the_same_cache(folder: Path):
    *here, computed = saved(folder, "here", engines.here)
    assert len(computed) == N
    for path in (folder / ".contextdb-cache").rglob("*.safetensors"):
        path.unlink()
    *cores, computed = saved(folder, "cores", on_two_cores)
    assert (cores, len(computed)) == (here, N)
    assert saved(folder, "again", engines.here) == (*here, ())


@in_full_runs  # all cores every day
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")
def test_dask_builds_the_same_bytes_although_a_worker_is_killed(folder: Path):
    distributed = pytest.importorskip("distributed", reason='dask is not installed: pip install "contextdb[dask]"')
    built = build_all(CONFIG, folder, cache=None)["jog"]
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        victim, killed = next(iter(cluster.workers.values())).pid, []

        def kill(done: int, total: int, name: str) -> None:
            if not killed:
                killed.append(victim)
                os.kill(victim, signal.SIGKILL)

        there = build_all(CONFIG, folder, None, kill, engines=engines.dask(cluster.scheduler_address, ""))["jog"]
    assert killed
    assert there.digest == built.digest
    assert there.database.layout.blocks.tobytes() == built.database.layout.blocks.tobytes()
    assert build_all(CONFIG, folder)["jog"].computed == ()  # the workers filled the cache


def test_arrays_that_are_too_large_for_memory_give_the_same_bytes(folder: Path, monkeypatch: pytest.MonkeyPatch):
    *plain, _ = saved(folder, "plain", engines.here)
    for module in (scratch, tensors):
        monkeypatch.setattr(module, "LARGE_BYTES", 1000)
    assert saved(folder, "large", engines.here) == (*plain, ())


def test_faults_of_many_clips_come_in_the_order_of_the_clips(folder: Path):
    for i in (1, 6, 11):
        (folder / f"clips/{i:02}.bvh").write_text("HIERARCHY", encoding="utf-8")
    messages = []
    for run_on in (engines.here, on_two_cores):
        with pytest.raises(MotionError) as error:
            build_all(CONFIG, folder, cache=None, engines=run_on)
        messages.append([str(fault) for fault in error.value.faults])
    assert messages[0] == messages[1]
    assert [message.partition(".bvh")[0][-2:] for message in messages[0]] == ["01", "06", "11"]


def test_a_build_that_was_stopped_goes_on_where_it_stopped(folder: Path):
    class Stopped(Exception):
        pass

    def stop(done: int, total: int, name: str) -> None:
        if done == 5:
            raise Stopped

    with pytest.raises(Stopped):
        build_all(CONFIG, folder, progress=stop, engines=on_two_cores)
    assert len(build_all(CONFIG, folder)["jog"].computed) <= N - 5


@pytest.mark.parametrize("command", ["describe", "prepare"])
def test_all_cores_describe_and_prepare_as_one_process_does(folder: Path, command: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(clip_looks, "MANY", 3)
    monkeypatch.setattr(clip_looks, "CHUNK", 4)
    (folder / "clips/05.bvh").write_text("HIERARCHY", encoding="utf-8")
    results = []
    for n_cores in (1, 2):
        monkeypatch.setattr(engines, "n_cores", lambda n=n_cores: n)
        results.append(run("motion", command, folder / "clips"))
    assert (results[0].code, results[0].out, results[0].err) == (results[1].code, results[1].out, results[1].err)
    assert results[0].out.count("\n") >= N


@pytest.mark.parametrize("command", ["describe", "prepare"])
def test_a_run_that_was_stopped_does_not_look_again_at_what_it_saw(folder: Path, command: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(clip_looks, "MANY", 3)
    monkeypatch.setattr(clip_looks, "CHUNK", 4)
    monkeypatch.setattr(engines, "n_cores", lambda: 1)
    whole = run("motion", command, folder / "clips")
    assert not list(folder.rglob("seen"))
    names: list[str] = []
    real = clip_looks.look_at

    def look(looks: clip_looks.Looks, at: clip_looks.ClipAt) -> clip_looks.Seen | clip_looks.LeftOut:
        names.append(at.name)
        if len(names) == 7:
            raise KeyboardInterrupt
        return real(looks, at)

    monkeypatch.setattr(clip_looks, "look_at", look)
    assert run("motion", command, folder / "clips").code == 130
    again = run("motion", command, folder / "clips")
    assert names[7:] == [f"{i:02}" for i in range(4, N)]
    assert (again.code, again.out, again.err) == (whole.code, whole.out, whole.err)
    assert not list(folder.rglob("seen"))


def test_a_head_of_a_clip_has_its_first_frame_and_its_length(folder: Path):
    clip = motion.load_bvh(folder / "clips/01.bvh")
    for head in (ClipHead.of(clip, "key"), pickle.loads(pickle.dumps(ClipHead.of(clip, "key")))):
        assert (head.n_frames, head.duration_s, key_of(head)) == (clip.n_frames, clip.duration_s, "key")
        assert np.array_equal(head.values[0], clip.values[0])
    assert len(pickle.dumps(ClipHead.of(clip, "key"))) < len(pickle.dumps(clip)) / 3


def test_a_normalisation_of_blocks_is_that_of_all_frames_at_once():
    random = np.random.default_rng(4)
    schema = CONFIG.features["jog"]
    blocks = [(random.random((n, schema.n_features)) * 9.0).astype(np.float32) for n in (7, 1, 0, 300, 45)]
    whole = np.concatenate(blocks).astype(np.float64)
    found = Normalisation.of(blocks, schema)
    assert found.offset.tolist() == whole.mean(axis=0).tolist()  # to the last bit
    for columns in schema.slices.values():
        assert found.scale[columns].tolist() == [whole.std(axis=0)[columns].mean()] * (columns.stop - columns.start)


def test_a_scheduler_needs_its_engine(folder: Path):
    channels = 'channels = [{ type = "position", bone = "LeftFoot" }]'
    text = f'[features.jog]\nrate = 30.0\n{channels}\n[databases.jog]\nclips = "clips/*.bvh"\nfeatures = "jog"\n'
    (folder / "contextdb.toml").write_text(text, encoding="utf-8")
    result = run("motion", "build", folder, "--scheduler", "tcp://10.0.0.5:8786")
    assert (result.code, result.out) == (2, "")
    assert "--scheduler is the address of Dask's. Accepted: --engine dask with it." in result.err
