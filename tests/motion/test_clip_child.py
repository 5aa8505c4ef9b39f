"""The child that reads FBX and USD: what ends it, what it leaves, and what it says of files that its libraries refuse."""

from __future__ import annotations

import signal
import tempfile
import tomllib
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import pytest
from clip_files import BODY, fbx, usda, usdc
from packaging.requirements import Requirement
from running import ROOT

from contextdb import motion
from contextdb.motion.clips import parser_process
from contextdb.motion.clips.parser_process import ParserProcess, has_wheel

ODD_LIBRARY = """
import os, time
axes_right_handed_y_up = None
class InheritModeHandling: HELPER_NODES = 1
def load_memory(content, **options):
    if b"die" in content:
        os._exit(11)
    if b"sleep" in content:
        time.sleep(600)
    while b"work" in content:
        pass
    raise ValueError("no scene")
"""


@pytest.fixture
def child() -> Iterator[ParserProcess]:
    """A child of its own, for what ends it."""
    process = ParserProcess("fbx", "ufbx", "fbx")
    yield process
    process.close()


@pytest.fixture
def odd_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of a library that dies or sleeps where a file says so."""
    file = tmp_path / "ufbx.py"
    file.write_text(ODD_LIBRARY, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return file


def test_one_child_reads_many_files(child: ParserProcess):
    raw = fbx(BODY)
    child.worlds(raw, 0, "walk.fbx")
    first = child.child
    for _ in range(20):
        child.worlds(raw, 0, "walk.fbx")
    assert first is child.child


def test_after_many_bytes_another_child_reads(child: ParserProcess, monkeypatch: pytest.MonkeyPatch):
    raw = fbx(BODY)
    monkeypatch.setattr(parser_process, "MOST_SENT", 2 * len(raw))
    children = []
    for _ in range(6):
        child.worlds(raw, 0, "walk.fbx")
        children.append(child.child)
    assert children[0] is children[1] is children[2]
    assert children[2] is not children[3]
    assert children[3] is children[4] is children[5]


def test_a_child_that_dies_is_one_fault_of_that_file_and_the_next_is_read(odd_library: Path, child: ParserProcess):
    for _ in range(2):
        with pytest.raises(motion.ClipError, match=r"walk\.fbx: the process that read the file ended \(exit code 11\)"):
            child.worlds(b"die", 0, "walk.fbx")
        with pytest.raises(motion.ClipError, match=r"run\.fbx: the file is damaged \(ValueError: no scene\)"):
            child.worlds(b"live", 0, "run.fbx")


def test_a_silent_child_is_given_up(odd_library: Path, child: ParserProcess, monkeypatch: pytest.MonkeyPatch):
    with pytest.raises(motion.ClipError):
        child.worlds(b"live", 0, "walk.fbx")
    assert child.folder is not None
    folder = Path(child.folder.name)
    assert folder.is_dir()
    monkeypatch.setattr(parser_process, "SILENCE_S", 0.5)
    with pytest.raises(motion.ClipError, match=r"walk\.fbx: the file was read for too long"):
        child.worlds(b"sleep", 0, "walk.fbx")
    assert child.child is None
    assert not folder.exists()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="whether a process sleeps is not known here")
def test_a_child_that_sleeps_on_a_file_is_given_up_long_before(
    odd_library: Path, child: ParserProcess, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(parser_process, "SILENCE_S", 500.0)
    monkeypatch.setattr(parser_process, "STILL_S", 0.2)
    for _ in range(2):
        with pytest.raises(motion.ClipError, match=r"walk\.fbx: the file was read for too long"):
            child.worlds(b"sleep", 0, "walk.fbx")
    with pytest.raises(motion.ClipError, match="no scene"):
        child.worlds(b"live", 0, "walk.fbx")


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="what a process works is not limited here")
def test_a_child_that_works_for_long_on_a_small_file_ends(odd_library: Path, child: ParserProcess, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(parser_process, "WORK_S", 0.3)
    with pytest.raises(motion.ClipError, match=r"walk\.fbx: the file takes longer to read than a file of its size may"):
        child.worlds(b"work", 0, "walk.fbx")


def test_a_child_that_answers_out_of_turn_is_ended(odd_library: Path, child: ParserProcess, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(parser_process, "MOST_LINE", 4)
    with pytest.raises(motion.ClipError, match=r"walk\.fbx: the process that read the file answered what is no clip"):
        child.worlds(b"live", 0, "walk.fbx")
    assert child.child is None


def test_without_the_library_a_message_names_the_extra(odd_library: Path, child: ParserProcess):
    odd_library.write_text("raise ImportError", encoding="utf-8")
    with pytest.raises(motion.ClipError, match=r"ufbx is not installed.*contextdb\[fbx\]"):
        child.worlds(b"live", 0, "walk.fbx")


def test_the_extra_installs_ufbx_where_it_has_wheels_and_a_message_says_where_not(
    odd_library: Path, child: ParserProcess, monkeypatch: pytest.MonkeyPatch
):
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    marker = Requirement(extras["fbx"][0]).marker
    assert marker is not None
    for system, machine in product(("linux", "darwin", "win32"), ("x86_64", "AMD64", "ARM64")):
        for minor in range(11, 17):
            where = {"sys_platform": system, "platform_machine": machine, "python_version": f"3.{minor}"}
            assert marker.evaluate(where) == has_wheel(system, machine, (3, minor))
    odd_library.write_text("raise ImportError", encoding="utf-8")
    monkeypatch.setattr(parser_process, "has_wheel", lambda *_: False)
    with pytest.raises(motion.ClipError, match=r"wheels for Python 3\.11 to 3\.14, and none for 3\.14 on Windows"):
        child.worlds(b"live", 0, "walk.fbx")


def test_a_usd_that_refers_to_other_files_is_refused(tmp_path: Path):
    (tmp_path / "walk.usda").write_bytes(usda(BODY, reference="other.usda"))
    with pytest.raises(motion.ClipError, match=r"refers to other files, such as 'other\.usda': flatten it"):
        motion.load_clips([tmp_path / "walk.usda"])


def test_damage_in_a_usd_is_reported_by_its_line(tmp_path: Path):
    lines = usda(BODY).split(b"\n")
    for damage, problem in ((b"\xff", r"line 9 is not UTF-8"), (b"{", "the file is damaged in line 9")):
        (tmp_path / "walk.usda").write_bytes(b"\n".join([*lines[:8], damage + lines[8], *lines[9:]]))
        with pytest.raises(motion.ClipError, match=problem):
            motion.load_clips([tmp_path / "walk.usda"])


def test_a_crate_that_ends_its_library_leaves_no_report_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    process, damaged = ParserProcess("usd", "usd-core", "usd"), bytearray(usdc(usda(BODY)))
    damaged[96] = 83
    with pytest.raises(motion.ClipError, match=r"^a\.usdc: "):
        process.worlds(bytes(damaged), 0, "a.usdc")
    process.close()
    assert not [*tmp_path.iterdir()]


def test_a_damaged_crate_is_refused_without_the_words_of_its_library(tmp_path: Path):
    whole = usdc(usda(BODY))
    for at in (609, 615, 639, 651):
        (tmp_path / "a.usdc").write_bytes(whole[:at] + bytes([whole[at] ^ 65]) + whole[at + 1 :])
        with pytest.raises(motion.ClipError, match=r"a\.usdc: [a-z ]+\. Accepted"):
            motion.load_clips([tmp_path / "a.usdc"])


def test_joints_above_themselves_are_refused(tmp_path: Path):
    (tmp_path / "a.usda").write_bytes(usda(BODY).replace(b'joints = ["Hips", ', b'joints = ["", '))
    with pytest.raises(motion.ClipError, match=r"a\.usda: a joint is above itself\."):
        motion.load_clips([tmp_path / "a.usda"])
