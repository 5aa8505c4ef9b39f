"""The command line as a whole: help, misspellings, exit codes, and what goes to which stream."""

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

import pytest
from running import ROOT, Result, run, run_process
from strategies import for_each, some
from warm_start import python

import contextdb
from contextdb import cli
from contextdb.commands import check_command, query_command
from contextdb.console import ExitCode

ESCAPE = "\x1b"
EXAMPLE = re.compile(r"  (?:\w+ \| |git config [\w.]+ \")?contextdb (\w+) ")
"""A line of a help that shows a command, perhaps with what is piped into it, or what tells git of it."""
FIRST_COMMANDS = f"{', '.join([*cli.COMMANDS][:6])} and {len(cli.COMMANDS) - 6} more"
"""What a message says of the commands there are: the first, and a count."""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a table of one row."""
    (tmp_path / "t.csv").write_text("Asset,ok\na,True\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


# ---- the overview, help and version


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["help"]])
def test_help_lists_every_command(arguments: list[str]):
    result = run(*arguments)
    assert (result.code, result.err) == (0, "")
    assert [line.split()[0] for line in result.lines if line.startswith("  ")] == list(cli.COMMANDS)


def test_without_a_command_the_overview_is_a_message_and_the_use_is_wrong():
    assert run() == Result(2, "", run("--help").out)


def test_the_version_is_that_of_the_package():
    result = run("--version")
    assert (result.code, result.lines[0], result.err) == (0, f"contextdb {contextdb.__version__}", "")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["version"] == contextdb.__version__


def test_beside_the_version_are_those_of_the_packages_and_how_to_get_what_is_missing(monkeypatch: pytest.MonkeyPatch):
    installed = {"numpy": "2.1.0", "polars": "2.0.0"}

    def version(name: str) -> str:
        if name not in installed:
            raise metadata.PackageNotFoundError(name)
        return installed[name]

    required = ["numpy<3,>=2", "polars>=1.30", "rich>=14; python_version < '3.16'", 'pygltflib>=1.16; extra == "gltf"']
    monkeypatch.setattr(metadata, "requires", lambda _: [*required, 'ruff; extra == "dev"'])
    monkeypatch.setattr(metadata, "version", version)
    told = [line.split(maxsplit=1) for line in run("--version").lines[1:]]
    assert [name for name, _ in told] == ["python", "numpy", "polars", "rich", "pygltflib"]
    assert [text.split(";")[0] for _, text in told[1:]] == ["2.1.0", "2.0.0", "not installed", "not installed"]
    assert told[-1][1].endswith('pip install "contextdb[gltf]"')


def test_a_folder_that_was_not_installed_has_a_version_too(monkeypatch: pytest.MonkeyPatch):
    def requires(name: str) -> list[str]:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "requires", requires)
    assert [line.split()[0] for line in run("--version").lines] == ["contextdb", "python"]


@for_each(cli.COMMANDS)
def test_each_command_has_a_help_with_its_arguments(command: str):
    result = run(command, "--help")
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith(f"usage: contextdb {command} ")
    assert "show this help message and exit" in result.out
    assert run("help", command) == result


@pytest.mark.parametrize("command", cli.COMMANDS)
@pytest.mark.parametrize("width", [60, 100])
def test_help_fits_the_terminal_but_for_examples(monkeypatch: pytest.MonkeyPatch, command: str, width: int):
    monkeypatch.setenv("COLUMNS", str(width))
    lines = run(command, "--help").lines
    assert [line for line in lines if len(line) > width and not EXAMPLE.match(line)] == []


@for_each(cli.COMMANDS)
def test_the_examples_of_a_help_stand_on_lines_of_their_own(command: str):
    mentions = [line for line in run(command, "--help").lines if "contextdb " in line and not line.startswith("usage")]
    examples = [found[1] for line in mentions if (found := EXAMPLE.match(line))]
    assert len(examples) == len(mentions)
    assert set(examples) <= {command}
    assert len(examples) >= 2 or command == "demo"


# ---- misspellings


@pytest.mark.parametrize(("word", "near"), [("qeury", "query"), ("Check", "check"), ("compil", "compile")])
def test_a_misspelt_command_is_named_with_the_nearest(word: str, near: str):
    assert run(word, "t.csv") == Result(
        2,
        "",
        f'contextdb: there is no command "{word}". Accepted: {FIRST_COMMANDS}. Did you mean "{near}"?\n',
    )


def test_a_command_that_is_like_none_is_refused_without_a_guess():
    assert run("xyzzy").err == f'contextdb: there is no command "xyzzy". Accepted: {FIRST_COMMANDS}.\n'


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["query", "t", "--jsn"], 'there is no option "--jsn". Did you mean "--json"?'),
        (["query", "t", "--unknwon=any"], 'there is no option "--unknwon=any". Did you mean "--unknown"?'),
        (["query", "t", "--exp"], 'there is no option "--exp".'),
        (["query", "t", "-x"], 'there is no option "-x".'),
        (["query", "t", "--unknown", "nevr"], 'argument --unknown: there is no "nevr". Accepted: "error", "any", "never". '),
        (["query", "t", "--unknown"], "argument --unknown: expected one argument"),
        (["query"], "the following arguments are required: TABLE"),
        (["check", ".", "more"], '"more" is one argument too many.'),
        (["check", ".", "--format", "jsn"], 'Did you mean "json"?'),
        (["check", ".", "--fail-on", "info"], 'there is no "info". Accepted: "error", "warning", "none".'),
        (["evaluate", "t"], "the following arguments are required: CONTEXTS"),
        (["evaluate", "t", "c.csv", "--engine", "dusk"], 'there is no "dusk". Accepted: "local", "dask". Did you mean "dask"?'),
        (["compile", "t", "--outt", "x"], 'there is no option "--outt". Did you mean "--out"?'),
        (["coverage", "t", "--html", "x"], 'there is no option "--html". Did you mean "--format html"?'),
    ],
)
def test_a_misspelt_argument_is_named_with_the_nearest_and_the_help(arguments: list[str], message: str):
    result = run(*arguments)
    assert (result.code, result.out) == (2, "")
    first, last = result.err.splitlines()
    assert first.startswith(f"contextdb {arguments[0]}: ")
    assert message in first
    assert last == f'Try "contextdb {arguments[0]} --help".'


# ---- streams


@pytest.mark.parametrize(
    ("arguments", "code", "how"),
    [
        (["query", "t.csv", "ok=True"], 0, run),
        (["query", "t.csv", "ok=False"], 1, run_process),
        (["query", "t.csv", "ok=x"], 2, run),
        (["query", "none.csv"], 2, run_process),
        (["check", "t.csv"], 0, run_process),
        (["check", "none"], 2, run),
        (["compile", "t.csv"], 0, run),
        (["demo", "--tables", "none"], 2, run),
    ],
)
def test_data_goes_to_standard_output_and_messages_to_standard_error(arguments: list[str], code: int, how: Callable[..., Result]):
    result = how(*arguments)
    assert result.code == code
    if code == 2:
        assert result.out == ""
        assert result.err.startswith("contextdb: ")
    else:
        assert result.out
        assert "Traceback" not in result.err


def test_the_installed_command_and_the_module_are_the_same_function():
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]
    assert scripts["contextdb"] == "contextdb.cli:main"
    assert run_process("--version").out == run("--version").out


def test_no_colour_where_no_terminal_is(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    result = run_process("check", "t.csv", env={"TERM": "xterm-256color"})
    assert ESCAPE not in result.out + result.err
    for arguments in (["query", "t.csv", "ok=True"], ["query", "t.csv", "ok=False"], ["demo"]):
        result = run(*arguments)
        assert ESCAPE not in result.out + result.err


@pytest.mark.parametrize(
    ("environment", "is_coloured"), [({"FORCE_COLOR": "1"}, True), ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False)]
)
def test_colour_can_be_forced_and_forbidden(environment: dict[str, str], is_coloured: bool, monkeypatch: pytest.MonkeyPatch):
    assert (ESCAPE in run_process("query", "t.csv", "ok=True", env=environment).out) is is_coloured
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert (ESCAPE in run("query", "t.csv", "ok=True").out) is is_coloured
    assert (ESCAPE in run("query", "t.csv", "ok=True", "--json").out) is False


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_output_is_utf_8_whatever_the_terminal_says(here: Path, encoding: str):
    (here / "t.csv").write_text("Asset,ok\nläuft → 走,True\n", encoding="utf-8")
    result = run_process("query", "t.csv", "ok=True", env={"PYTHONIOENCODING": encoding})
    assert "läuft → 走" in result.out


# ---- what ends a command early


def test_an_interrupt_ends_with_130_and_without_a_traceback(monkeypatch: pytest.MonkeyPatch):
    def interrupted(*_: object) -> ExitCode:
        raise KeyboardInterrupt

    monkeypatch.setattr(query_command, "run", interrupted)
    assert run("query", "t.csv", "ok=True") == Result(130, "", "contextdb: interrupted\n")


def test_what_the_system_refuses_is_told_without_a_traceback(monkeypatch: pytest.MonkeyPatch):
    def refused(*_: object) -> ExitCode:
        raise PermissionError(13, "Permission denied", "secret/tables")

    monkeypatch.setattr(check_command, "run", refused)
    assert run("check", "t.csv") == Result(2, "", "contextdb: secret/tables: Permission denied.\n")


HOW = ("", "1")
"""PYTHONUNBUFFERED."""
UNWRITTEN = [["query", "t.csv", "ok=True"], ["check", "t.csv"], ["--version"], ["query", "--help"]]
posix = pytest.mark.skipif(os.name == "nt", reason="pipes and devices as POSIX has them")


STOPPED = [
    (["query", "big.csv", "ok=True"], 0),
    (["query", "big.csv", "ok=True", "--json"], 0),
    (["query", "big.csv", "ok=False"], 1),
    (["check", "bad.csv", "--all"], 1),
    (["check", "bad.csv"], 1),
    (["query", "--help"], 0),
]


@posix
@pytest.mark.parametrize(("arguments", "code", "unbuffered"), some(((*one, how) for one in STOPPED for how in HOW), 3))
def test_a_reader_who_stops_reading_changes_no_exit_code(here: Path, arguments: list[str], code: int, unbuffered: str):
    (here / "big.csv").write_text("Asset,ok\n" + "".join(f"{'a' * 50}{i},True\n" for i in range(5000)), encoding="utf-8")
    (here / "bad.csv").write_text("Asset,ok\n" + "".join(f"a{i},5..3\n,True\n,True\n" for i in range(500)), encoding="utf-8")
    command = python("-m", "contextdb", *arguments)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": unbuffered}
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, env=environment, encoding="utf-8")
    finally:
        os.close(writing)
    said = [line for line in done.stderr.splitlines() if "checking bad: " not in line]  # on a slow machine
    assert (done.returncode, said) == (code, [])


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
@pytest.mark.parametrize(("arguments", "unbuffered"), some(((one, how) for one in UNWRITTEN for how in HOW), 3))
def test_output_that_cannot_be_written_is_an_error(arguments: list[str], unbuffered: str):
    command = python("-m", "contextdb", *arguments)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": unbuffered}
    with open("/dev/full", "w", encoding="utf-8") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, env=environment, encoding="utf-8")
    assert (done.returncode, done.stderr) == (2, "contextdb: standard output: No space left on device.\n")


def test_an_error_message_moves_no_cursor():
    result = run("query", "\x1b[31mred\x07\u202e\nnew line")
    assert result.code == 2
    assert len(result.err.splitlines()) == 1
    assert re.search(r"[\x00-\x09\x0b-\x1f\x7f\u202e]", result.err) is None
    result = run("query", "t.csv", "--\x1b[2J")
    assert ESCAPE not in result.err


# ---- start-up


def test_a_query_loads_neither_the_editor_nor_the_compilers():
    heavy = "textual", "numba", "dask", "scipy", "rich", "contextdb.motion"
    code = (
        "import sys; from contextdb.cli import main; main(['query', 't.csv', 'ok=True']); "
        f"sys.exit(' '.join(m for m in {heavy!r} if m in sys.modules) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, env={**os.environ, "PYTHONPATH": str(ROOT)}, encoding="utf-8"
    )
    assert (done.returncode, done.stderr) == (0, "")
