"""Commands that write a file write into pipes and devices too, or refuse in a sentence; and paths that begin with a dash."""

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from running import run

from contextdb.disk import write_atomic
from contextdb.errors import FileError

RAW = b"Asset,speed\nwalk,0..5\nrun,5..9\n"
TOML = '[conditions.speed]\ntype = "number"\nmin = 0.0\nmax = 9.0\n'
WRITERS = {
    "coverage": ("coverage", "t.csv", "-o", "OUT"),
    "coverage page": ("coverage", "t.csv", "--format", "html", "-o", "OUT"),
    "export": ("export", "t.csv", "OUT", "--as", "tsv"),
    "merge": ("merge", "t.csv", "t.csv", "t.csv", "-o", "OUT"),
    "evaluate": ("evaluate", "t.csv", "moments.csv", "--out", "OUT"),
}


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("t.csv", "-t.csv"):
        (tmp_path / name).write_bytes(RAW)
    (tmp_path / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (tmp_path / "moments.csv").write_text("speed\n1\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names")
@pytest.mark.parametrize("arguments", WRITERS.values(), ids=WRITERS)
def test_a_pipe_gets_what_a_file_would(here, arguments):
    os.mkfifo("pipe")
    file = "out.csv" if arguments[0] == "evaluate" else "out"
    assert run(*(file if a == "OUT" else a for a in arguments)).code == 0
    with ThreadPoolExecutor(1) as pool:
        read = pool.submit(Path("pipe").read_bytes)
        assert run(*("pipe" if a == "OUT" else a for a in arguments)).code == 0
        assert read.result() == Path(file).read_bytes()
    assert stat.S_ISFIFO(os.stat("pipe").st_mode)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device that is full")
@pytest.mark.parametrize("arguments", WRITERS.values(), ids=WRITERS)
def test_a_device_that_takes_nothing_is_named(arguments):
    result = run(*("/dev/full" if a == "OUT" else a for a in arguments))
    assert result.code == 2
    assert "/dev/full: " in result.err
    assert "old file" not in result.err


@pytest.mark.skipif(not Path("/dev/null").exists(), reason="a device")
@pytest.mark.parametrize("arguments", [*WRITERS.values(), ("compile", "t.csv", "-o", "OUT"), ("import", "t.csv", "OUT")])
def test_nowhere_takes_everything_or_is_refused_and_stays_nowhere(arguments):
    result = run(*("/dev/null" if a == "OUT" else a for a in arguments))
    assert result.code in (0, 2)
    assert result.code == 0 or "/dev/null: " in result.err
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)


def test_what_is_neither_a_file_nor_a_stream_is_refused(here):
    with pytest.raises(FileError, match="this is a folder"):
        write_atomic(here, b"x")


# ---- a dash in front


ASKED = {
    "check": ("check", "TABLE"),
    "query": ("query", "TABLE", "speed=1"),
    "coverage": ("coverage", "TABLE"),
    "evaluate": ("evaluate", "TABLE", "moments.csv"),
    "diff": ("diff", "TABLE", "t.csv"),
    "merge": ("merge", "TABLE", "TABLE", "TABLE"),
    "git text": ("git", "text", "TABLE"),
    "import": ("import", "TABLE", "./-new.csv"),
    "export": ("export", "TABLE", "-"),
    "compile": ("compile", "TABLE"),
}


@pytest.mark.parametrize("way", ["./", "--"])
@pytest.mark.parametrize("arguments", ASKED.values(), ids=ASKED)
def test_a_table_whose_name_begins_with_a_dash_is_asked_as_any_other(arguments, way):
    n = 2 if arguments[0] == "git" else 1
    more = ("--as", "tsv") if arguments[0] == "export" else ()
    behind = [("./-t.csv" if way == "./" else "-t.csv") if a == "TABLE" else a for a in arguments[n:]]
    result = run(*arguments[:n], *more, *(["--", *behind] if way == "--" else behind))
    assert (result.code, result.err if arguments[0] not in ("export", "compile") else "") == (0, "")


def test_the_table_is_known_by_its_name_too(here):
    assert run("query", "--", "-t", "speed=1").code == 0
    assert run("query", "speed=1", "--", "-t").code == 2
    assert run("check", "--", "-t.csv", "more").code == 2


def test_a_file_that_looks_like_an_option_is_told_how_it_can_be_named():
    result = run("check", "-t.csv")
    assert (result.code, result.out) == (2, "")
    assert f'"-t.csv" is a file, and looks like an option. Did you mean "{os.path.join(".", "-t.csv")}"?' in result.err
