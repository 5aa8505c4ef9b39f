"""`--max-memory` and `--max-time`: exit code 2 and one sentence, and nothing half-written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from running import ROOT, run, run_process
from strategies import for_each, some
from telemetry.links import meeting

import contextdb as cdb
from contextdb.cli import COMMANDS, Group

__all__ = ["meeting"]

IS_LINUX = sys.platform == "linux"
SCRIPT = """
import os, sys, time
import contextdb.commands.check_command as command
from contextdb.cli import main
from contextdb.disk import write_atomic
from pathlib import Path

def waits(_):
    time.sleep(600)

def goes_on_and_on(_):
    while True:
        pass

def computes_without_python(_):
    sum(range(10**12))

def swallows(_):
    try:
        time.sleep(600)
    except KeyboardInterrupt:
        return 0

def writes(_):
    def pieces():
        yield b"x" * 100_000
        time.sleep(600)
    write_atomic(Path("new.csv"), pieces())

def grows(_):
    grown = []
    while True:
        grown.append(bytearray(1_000_000))

def asks_for_too_much(_):
    return len(bytearray(1 << 40))

def aborts(_):
    os.write(2, b"last words")
    os.abort()

def ends(_):
    print("done")
    print("said", file=sys.stderr)
    return 1

command.run = {name}
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "t.csv").write_text("Asset,ok\na,True\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def limited(name: str, *options: str) -> tuple[int, str, str]:
    """Run `check` with something else in its place, in the process that watches and in the one that is watched."""
    script = SCRIPT.format(name=name)
    grace_s = 1.0 if name == "computes_without_python" else 60.0  # that one is killed
    watched = f"import contextdb.commands.limits as limits\nlimits.GRACE_S = {grace_s}\nlimits._START = " + repr(
        "import sys; sys.path.append(sys.argv.pop(1))\n" + script
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", f"{watched}\n{script}", "check", ".", *options],
        capture_output=True,
        encoding="utf-8",
        env=environment,
        timeout=120,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("name", some(["writes", "waits", "goes_on_and_on", "computes_without_python", "swallows"]))
def test_a_command_ends_when_its_time_is_over_and_leaves_nothing_half_written(name):
    code, out, err = limited(name, "--max-time", "0.5")
    assert (code, out, err) == (2, "", "contextdb: the command needs more time than the 0.5 s of --max-time.\n")
    assert sorted(os.listdir()) == ["t.csv"]


@pytest.mark.skipif(not IS_LINUX, reason="supported on Linux")
@pytest.mark.parametrize("name", some(["grows", "asks_for_too_much", "aborts"], 3))
def test_a_command_ends_when_it_needs_more_memory(name):
    code, out, err = limited(name, "--max-memory", "300")
    assert (code, out, err) == (2, "", "contextdb: the command needs more memory than the 300 MB of --max-memory.\n")


@pytest.mark.skipif(not IS_LINUX, reason="supported on Linux")
def test_a_command_within_its_limits_answers_as_without_them():
    assert limited("ends", "--max-time", "100", "--max-memory", "2000") == (1, "done\n", "said\n")


def test_an_error_within_limits_is_an_error_of_contextdb():
    code, _, err = limited("[]", "--max-time", "100")
    assert code == 70
    assert "TypeError in contextdb check --max-time" in err


def test_memory_is_refused_where_the_system_has_no_such_limit(monkeypatch):
    monkeypatch.setattr(sys, "platform", "darwin")
    result = run("check", ".", "--max-memory", "100")
    assert (result.code, result.err) == (2, "contextdb: --max-memory is not supported on this system. Accepted: it on Linux.\n")


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "x", "1e10"])
def test_a_limit_is_a_number_within_reason(text):
    result = run("check", ".", f"--max-time={text}")
    assert result.code == 2
    assert f'"{text}" is not a limit. Accepted: a number from 0.1 to 1e9.' in result.err


def commands(group: Group) -> list[str]:
    found = []
    for name in group.commands:
        command = group.command(name)
        words = (*group.words, name)
        found += commands(Group(words, command.COMMANDS)) if hasattr(command, "COMMANDS") else [" ".join(words)]
    return found


@for_each(commands(Group((), COMMANDS)))
def test_every_command_has_both_limits(command):
    helped = run(*command.split(), "--help").out
    assert "--max-memory MB" in helped
    assert "--max-time S" in helped


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="sockets in folders of a user are of Unix")
def test_a_real_command_is_limited_from_a_shell(meeting: Path):
    with cdb.link("game"):
        result = run_process("live", "game", "--max-time", "0.1")
    assert (result.code, result.out) == (2, "")
