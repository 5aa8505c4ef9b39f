"""`contextdb ci`: what it compares with what, its files, what it refuses; and that no change walks round its gates."""

import json
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import polars as pl
import pytest
import yaml
from running import ROOT, Result, run

import contextdb as cdb
from contextdb.commands.ci_command import REPORTS

TOML = """\
[conditions.gait]
type = "enum"
values = ["Idle", "Walk", "Run"]

[conditions.speed]
type = "number"
min = 0.0
max = 7.0

[conditions.brisk]
type = "bool"
expr = "speed > 3"

[tables.moves]
policy = "unique"
assume = ["not (gait == 'Idle' and speed > 6)"]

[tables.dive]
enabled = "On"

[tables.land]
when = "Rule"
"""
MOVES = "Asset,gait,speed\nidle,Idle,0..1\nwalk,Walk,0..3\nrun,Run,2..5\nsprint,Run,(5..7]\n"
DIVE = "Asset,gait,speed,On\nroll,Run,0..4,True\nleap,Run,4..7,True\n"
LAND = "Asset,gait,Rule\nsoft,Any,speed < 3\nhard,Run,\n"
CASES = "Case,gait,speed,Expected\nstroll,Walk,1,walk\nflat out,Run,6.5,sprint\n"


def git(*arguments: str) -> str:
    own = ("-c", "user.name=a", "-c", "user.email=a@example.com", "-c", "commit.gpgsign=false")
    done = subprocess.run(["git", *own, *arguments], check=True, capture_output=True, encoding="utf-8")
    return done.stdout.strip()


pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="needs git")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with three tables in game/tables on its branch main, in which a change is about to be made."""
    repository = tmp_path / "repository"
    (repository / "game/tables").mkdir(parents=True)
    monkeypatch.chdir(repository)
    for name, text in {
        "contextdb.toml": TOML,
        "moves.csv": MOVES,
        "moves.cases.csv": CASES,
        "dive.csv": DIVE,
        "land.csv": LAND,
    }.items():
        write(name, text)
    git("init", "--quiet", "--initial-branch=main")
    git("add", ".")
    git("commit", "--quiet", "-m", "tables")
    return repository


def write(name: str, text: str) -> None:
    Path("game/tables", name).write_text(text, encoding="utf-8")


def edit(name: str, old: str, new: str) -> None:
    text = Path("game/tables", name).read_text(encoding="utf-8")
    assert old in text
    write(name, text.replace(old, new))


def remove(*names: str) -> None:
    for name in names:
        Path("game/tables", name).unlink()


def rename(old: str, new: str) -> None:
    Path("game/tables", old).rename(Path("game/tables", new))


def compared(*options: str) -> Result:
    return run("ci", "game/tables", "--against", "main", *options)


# ---- what is compared with what


def test_the_first_line_says_what_was_compared_with_what():
    result = compared()
    commit = git("rev-parse", "main")[:12]
    assert result.code == 0, result.out + result.err
    assert result.lines[0] == f"game/tables: 3 tables, compared with main (commit {commit}): 3 tables, 2 saved contexts."
    assert result.lines[-1] == "PASSED."
    assert (
        run("ci", "game/tables").lines[0]
        == "game/tables: 3 tables, compared with nothing; --against REF or --baseline FILE compares."
    )


def test_the_folder_is_the_current_one_unless_it_is_named(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir("game/tables")
    assert run("ci", "--against", "main").lines[0].startswith(".: 3 tables, compared with main (commit ")


def test_the_files_of_an_earlier_run_are_a_baseline_for_the_next():
    assert compared("--out", "../reports").code == 0
    assert run("ci", "game/tables", "--baseline", "../reports/coverage.json").code == 0
    edit("moves.csv", "sprint,Run,(5..7]\n", "")
    edit("moves.cases.csv", "flat out,Run,6.5,sprint\n", "")
    result = run("ci", "game/tables", "--baseline", "../reports/coverage.json")
    assert result.code == 1
    assert "compared with ../reports/coverage.json: 3 tables, 2 saved contexts." in result.lines[0]
    assert result.lines[-1] == 'FAILED: max-drop of "moves", fewer-cases of "moves".'


def test_every_report_file_is_written_and_says_whether_it_passed():
    result = compared("--out", "new/reports", "--max-drop", "1")
    assert result.code == 0
    out = Path("new/reports")
    assert sorted(path.name for path in out.iterdir()) == sorted(REPORTS)
    assert "**PASSED.**" in (out / "summary.md").read_text(encoding="utf-8")
    assert "## contextdb coverage" in (out / "summary.md").read_text(encoding="utf-8")
    for name in ("check.xml", "coverage.xml"):
        assert ET.parse(out / name).getroot().get("failures") == "0"
    assert json.loads((out / "contextdb.sarif").read_text(encoding="utf-8"))["version"] == "2.1.0"
    assert run("verify", out / "coverage.json").code == 0


def test_reports_of_coverage_are_not_left_from_a_run_before_where_tables_cannot_be_read():
    assert compared("--out", "reports").code == 0
    edit("moves.csv", "0..1", "slow")
    result = compared("--out", "reports")
    assert (result.code, result.lines[-1]) == (1, "FAILED: check, coverage, which cannot be measured.")
    assert sorted(path.name for path in Path("reports").iterdir()) == ["check.xml", "contextdb.sarif", "summary.md"]


@pytest.mark.skipif(os.name == "nt", reason="links need a right on Windows")
def test_a_report_is_not_written_through_a_link(tmp_path: Path):
    Path("reports").mkdir()
    (tmp_path / "victim").write_text("mine", encoding="utf-8")
    Path("reports/coverage.html").symlink_to(tmp_path / "victim")
    result = compared("--out", "reports")
    assert (result.code, "a link leads to" in result.err) == (2, True)
    assert (tmp_path / "victim").read_text(encoding="utf-8") == "mine"


def test_annotations_are_printed_between_the_first_line_and_the_verdict():
    edit("moves.csv", "sprint,Run,(5..7]\n", "")
    result = compared("--format", "github")
    assert all(line.startswith("::") for line in result.lines[1:-1])
    assert any(line.startswith("::error file=game/tables/moves.csv") and "fell by" in line for line in result.lines)


def test_a_comparison_leaves_the_checkout_and_its_branch_as_they_are():
    compared()
    assert git("status", "--porcelain", "--ignored") == ""
    assert git("worktree", "list").count("\n") == 0


def test_a_table_that_lies_in_a_folder_below_is_read_from_the_commit_too():
    Path("game/tables/more").mkdir()
    edit("contextdb.toml", "[tables.dive]", '[tables.dive]\nfile = "more/dive.csv"')
    rename("dive.csv", "more/dive.csv")
    git("add", ".")
    git("commit", "--quiet", "-m", "moved")
    assert compared().code == 0


# ---- what cannot be compared


@pytest.mark.parametrize("ref", ["nowhere", "--help", "-h", "--output=x", "", " ", "main:game", "a\nb", "--upload-pack=touch x"])
def test_a_ref_that_is_no_commit_is_refused_in_one_sentence_and_is_no_option_of_git(ref: str, here: Path):
    before = sorted(here.rglob("*"))
    result = run("ci", "game/tables", f"--against={ref}")
    assert (result.code, result.out, len(result.err.splitlines())) == (2, "", 1)
    assert "git has no commit" in result.err
    assert sorted(here.rglob("*")) == before


def test_a_branch_that_only_the_remote_has_is_suggested():
    git("update-ref", "refs/remotes/origin/release", "HEAD")
    assert 'Did you mean "origin/release"?' in run("ci", "game/tables", "--against", "release").err


def test_a_shallow_clone_is_named_as_the_reason(here: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write("moves.csv", MOVES + "\n")
    git("commit", "--quiet", "-am", "second")
    git("clone", "--quiet", "--depth", "1", here.as_uri(), str(tmp_path / "shallow"))
    monkeypatch.chdir(tmp_path / "shallow")
    result = run("ci", "game/tables", "--against", "HEAD~1")
    assert (result.code, "fetch-depth: 0 of actions/checkout, as this clone is shallow" in result.err) == (2, True)


def test_without_git_or_a_repository_one_sentence_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    shutil.copytree("game/tables", tmp_path / "alone")
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path))
    result = run("ci", tmp_path / "alone", "--against", "main")
    assert (result.code, "is in no git repository" in result.err) == (2, True)
    monkeypatch.setenv("PATH", "")
    result = compared()
    assert (result.code, "git cannot be run" in result.err) == (2, True)


def test_a_folder_that_the_commit_does_not_have_fails_unless_that_is_accepted():
    shutil.copytree("game/tables", "game/other")
    result = run("ci", "game/other", "--against", "main")
    assert result.code == 1
    assert "compared with nothing, as main (commit " in result.lines[0]
    assert "has no tables in this folder. Where that is intended: --uncompared." in " ".join(result.out.split())
    assert run("ci", "game/other", "--against", "main", "--uncompared").code == 0


def test_tables_of_the_commit_that_cannot_be_read_fail_unless_that_is_accepted():
    edit("moves.csv", "0..1", "slow")
    git("commit", "--quiet", "-am", "broken")
    edit("moves.csv", "slow", "0..1")
    result = compared()
    said = " ".join(result.out.split())
    assert (result.code, "cannot be measured: moves.csv: cannot read" in said) == (1, True)
    assert compared("--uncompared").code == 0


def test_a_table_that_is_a_pointer_of_git_lfs_is_named(here: Path):
    write("dive.csv", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    git("commit", "--quiet", "-am", "pointer")
    write("dive.csv", DIVE)
    assert "is a pointer of Git LFS" in " ".join(compared().out.split())


@pytest.mark.skipif(os.name == "nt", reason="links need a right on Windows")
def test_a_link_in_the_commit_is_never_made(here: Path):
    remove("dive.csv")
    Path("game/tables/dive.csv").symlink_to("/etc/passwd")
    git("add", ".")
    git("commit", "--quiet", "-m", "link")
    remove("dive.csv")
    write("dive.csv", DIVE)
    result = compared("--format", "github")
    assert (result.code, "root:" in result.out) == (1, False)


@pytest.mark.skipif(os.name == "nt", reason="a script of the shell")
def test_a_comparison_runs_no_filter_and_no_hook_of_the_repository(tmp_path: Path):
    ran, script = tmp_path / "ran", tmp_path / "script"
    script.write_text(f"#!/bin/sh\ntouch {shlex.quote(str(ran))}\n")
    script.chmod(0o700)
    Path(".gitattributes").write_text("*.csv filter=own diff=own\n")
    git("add", ".gitattributes")
    git("commit", "--quiet", "-m", "attributes")
    for key in ("filter.own.smudge", "filter.own.clean", "filter.own.process", "diff.own.textconv", "diff.own.command"):
        git("config", key, str(script))
    git("config", "core.fsmonitor", str(script))
    git("config", "core.hooksPath", "hooks")
    Path("hooks").mkdir()
    for hook in ("post-checkout", "post-index-change", "reference-transaction", "pre-auto-gc"):
        shutil.copy(script, Path("hooks", hook))
    assert (compared("--against", "HEAD").code, ran.exists()) == (0, False)


def test_a_folder_that_looks_like_a_repository_of_its_own_is_not_taken_for_one(here: Path, tmp_path: Path):
    """Else a change could bring the commit that it is compared with."""
    git("init", "--quiet", "--bare", str(tmp_path / "own.git"))
    without_sprint()
    for path in (tmp_path / "own.git").iterdir():
        path.rename(Path("game/tables") / path.name)
    own = Path("game/tables").absolute()
    git(f"--git-dir={own}", "config", "core.bare", "false")
    git(f"--git-dir={own}", "config", "core.worktree", str(own))
    git(f"--git-dir={own}", f"--work-tree={own}", "add", "moves.csv", "moves.cases.csv", "dive.csv", "land.csv", "contextdb.toml")
    git(f"--git-dir={own}", f"--work-tree={own}", "commit", "--quiet", "-m", "own")
    git(f"--git-dir={own}", "update-ref", "refs/heads/main", "HEAD")
    for worktree in (own, here):
        git(f"--git-dir={own}", "config", "core.worktree", str(worktree))
        result = compared()
        assert (result.code, "is in no git repository" in result.err) == (2, True)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--max-drop", "1"), "--max-drop compares with a baseline."),
        (("--gone", "moves"), "--gone compares with a baseline."),
        (("--uncompared",), "--uncompared is about a commit."),
        (("--against", "main", "--uncompared"), "--uncompared accepts nothing"),
        (("--against", "main", "--baseline", "x.json"), "not allowed with argument"),
        (("--against", "main", "--gone", "mvoes"), '--gone "mvoes" accepts nothing'),
        (("--baseline", "missing.json"), "missing.json"),
    ],
)
def test_bad_use_exits_with_2(options: tuple[str, ...], said: str):
    result = run("ci", "game/tables", *options)
    assert (result.code, said in result.err) == (2, True)


# ---- no change walks round the gates. Each of these would hide a loss; beside each, what the report says


def example(monkeypatch: pytest.MonkeyPatch, *options: str) -> Result:
    """The command of the example in docs/ci.md, as the runner calls it, with options after it."""
    blocks = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/ci.md").read_text(encoding="utf-8"), re.S)
    steps = next(yaml.safe_load(block) for block in blocks if "contextdb ci" in block)["jobs"]["tables"]["steps"]
    (command,) = [step["run"] for step in steps if "contextdb ci" in step.get("run", "")]
    git("update-ref", "refs/remotes/origin/main", "main")
    monkeypatch.chdir("game")
    program, *arguments = shlex.split(command.replace("$GITHUB_BASE_REF", "main").replace("$RUNNER_TEMP", "../.."))
    assert program == "contextdb"
    return run(*arguments, *options)


def gut_and_nest() -> None:
    write("moves.csv", "Asset,gait,speed\nidle,Idle,0..1\n")
    write("moves.cases.csv", "Case,gait,speed,Expected\n")
    write("wrap.csv", "Asset,gait\n@moves,Any\n")


def nest_as_parquet() -> None:
    write("moves.csv", "Asset,gait,speed\nidle,Idle,0..1\n")
    cdb.load("game/tables/moves.csv").save("game/tables/moves.parquet")
    remove("moves.csv")


def session_in_its_place() -> None:
    """A file that is taken for a recorded session, and so for no table."""
    pl.DataFrame({"Asset": ["idle"]}).write_parquet("game/tables/dive.parquet", metadata={"contextdb.trace": "2"})
    remove("dive.csv")
    edit("contextdb.toml", '[tables.dive]\nenabled = "On"\n', "")


def without_sprint() -> None:
    edit("moves.csv", "sprint,Run,(5..7]\n", "")
    edit("moves.cases.csv", "flat out,Run,6.5,sprint\n", "flat out,Run,4.5,run\n")


def then(change: Callable[[], object]) -> Callable[[], None]:
    """The loss of a row, and what should hide it."""

    def both() -> None:
        without_sprint()
        change()

    return both


ATTACKS: dict[str, tuple[Callable[[], object], str]] = {
    "a row deleted": (without_sprint, "max-drop"),
    "a row disabled": (lambda: edit("dive.csv", "4..7,True", "4..7,False"), "max-drop"),
    "table renamed": (
        then(lambda: (rename("dive.csv", "dive2.csv"), edit("contextdb.toml", "[tables.dive]", "[tables.dive2]"))),
        "gone",
    ),
    "table renamed, but for contextdb.toml": (then(lambda: rename("moves.csv", "moves2.csv")), "check"),
    "table in other capitals": (
        then(lambda: (rename("moves.csv", "x.csv"), edit("contextdb.toml", "[tables.moves]", "[tables.Moves]\nfile = 'x.csv'"))),
        "gone",
    ),
    "table nested": (gut_and_nest, "max-drop"),
    "table as Parquet": (nest_as_parquet, "max-drop"),
    "table as a session": (session_in_its_place, "gone"),
    "table deleted": (lambda: (remove("dive.csv"), edit("contextdb.toml", '[tables.dive]\nenabled = "On"\n', "")), "gone"),
    "table hidden": (
        lambda: (rename("dive.csv", ".dive.csv"), edit("contextdb.toml", '[tables.dive]\nenabled = "On"\n', "")),
        "gone",
    ),
    "table emptied": (lambda: write("dive.csv", "Asset,gait,speed,On\n"), "gone"),
    "assume added": (then(lambda: edit("contextdb.toml", "assume = [", 'assume = ["speed <= 5", ')), "redefined"),
    "assume taken away": (lambda: edit("contextdb.toml", "assume = [\"not (gait == 'Idle' and speed > 6)\"]", ""), "redefined"),
    "bounds narrowed": (then(lambda: edit("contextdb.toml", "max = 7.0", "max = 5.0")), "redefined"),
    "bounds taken away": (then(lambda: edit("contextdb.toml", "min = 0.0\nmax = 7.0\n", "")), "redefined"),
    "value deleted": (
        lambda: (
            edit("contextdb.toml", '"Idle", ', ""),
            edit("contextdb.toml", "gait == 'Idle'", "gait == 'Run'"),
            edit("moves.csv", "idle,Idle,0..1\n", ""),
        ),
        "redefined",
    ),
    "column deleted": (lambda: write("dive.csv", "Asset,gait,On\nroll,Run,True\n"), "redefined"),
    "column an output": (lambda: edit("contextdb.toml", 'enabled = "On"', 'enabled = "On"\noutputs = ["speed"]'), "check"),
    "column renamed": (lambda: edit("dive.csv", "speed", "pace"), "redefined"),
    "column of rules": (lambda: edit("contextdb.toml", 'when = "Rule"', 'outputs = ["Rule"]'), "redefined"),
    "type changed": (then(lambda: edit("contextdb.toml", 'type = "number"', 'type = "int"')), "redefined"),
    "derived fact rewritten": (
        lambda: edit(
            "contextdb.toml",
            'type = "number"\nmin = 0.0\nmax = 7.0',
            'type = "number"\nmin = 0.0\nmax = 7.0\nexpr = "pace * 1"\n[conditions.pace]\ntype = "number"\nmin = 0.0\nmax = 3.0',
        ),
        "redefined",
    ),
    "policy weakened": (lambda: edit("contextdb.toml", 'policy = "unique"', 'policy = "collect"'), "redefined"),
    "contextdb.toml deleted": (lambda: remove("contextdb.toml"), "check"),
    "cases deleted": (lambda: remove("moves.cases.csv"), "fewer-cases"),
    "cases emptied": (lambda: write("moves.cases.csv", "Case,gait,speed,Expected\n"), "fewer-cases"),
    "cases that expect nothing": (lambda: edit("moves.cases.csv", "6.5,sprint", "6.5,"), "fewer-cases"),
    "cases that cannot fail": (lambda: edit("moves.cases.csv", "6.5,sprint", "6.5,-nobody"), "fewer-cases"),
    "cases that are one another": (lambda: edit("moves.cases.csv", "Run,6.5,sprint", "Walk,1,walk"), "fewer-cases"),
    "cases that expect less": (lambda: edit("moves.cases.csv", "6.5,sprint", "6.5,+sprint"), "fewer-cases"),
    "cases of nobody": (lambda: rename("moves.cases.csv", "mvoes.cases.csv"), "fewer-cases"),
    "unreadable": (lambda: edit("dive.csv", "0..4", "fast"), "check"),
    "a case that fails": (lambda: edit("moves.csv", "walk,Walk,0..3", "walk,Walk,2..3"), "check"),
}


@pytest.mark.parametrize("name", ATTACKS)
def test_a_change_that_would_walk_round_a_gate_ends_red(name: str, monkeypatch: pytest.MonkeyPatch):
    attack, gate = ATTACKS[name]
    attack()
    result = example(monkeypatch)
    assert result.code == 1, result.out + result.err
    assert gate in result.lines[-1]


def test_a_baseline_that_was_emptied_or_altered_ends_red():
    assert compared("--out", "reports").code == 0
    path = Path("reports/coverage.json")
    document = json.loads(path.read_text(encoding="utf-8"))
    for change in ({"tables": []}, {"cases": {}}, {"digest": "0" * 32}, {"writer": "other", "digest": ""}):
        path.write_text(json.dumps({**document, **change}), encoding="utf-8")
        assert run("ci", "game/tables", "--baseline", "reports/coverage.json").code == 2


HONEST: dict[str, tuple[Callable[[], object], tuple[str, ...]]] = {
    "nothing": (lambda: None, ()),
    "a row more": (lambda: write("moves.csv", MOVES + "stroll,Walk,(3..4]\n"), ()),
    "a cell wider": (lambda: edit("dive.csv", "0..4", "0..5"), ()),
    "rows in another order": (lambda: write("dive.csv", "Asset,gait,speed,On\nleap,Run,4..7,True\nroll,Run,0..4,True\n"), ()),
    "a case more": (lambda: write("moves.cases.csv", CASES + "rest,Idle,0.5,idle\n"), ()),
    "values in another order": (lambda: edit("contextdb.toml", '"Idle", "Walk", "Run"', '"Run", "Walk", "Idle"'), ()),
    "a description": (lambda: edit("contextdb.toml", "max = 7.0", 'max = 7.0\ndescription = "m/s"'), ()),
    "a fallback": (lambda: edit("contextdb.toml", 'policy = "unique"', 'policy = "unique"\nfallback = "idle"'), ()),
    "the table as Parquet": (
        lambda: (cdb.load("game/tables/dive.csv").save("game/tables/dive.parquet"), remove("dive.csv")),
        (),
    ),
    "a row less, within the drop": (without_sprint, ("--max-drop", "30")),
    "a new table": (lambda: write("fall.csv", "Asset,gait\nfall,Run\n"), ("--new", "fall")),
    "a renamed table": (
        lambda: (rename("dive.csv", "dives.csv"), edit("contextdb.toml", "[tables.dive]", "[tables.dives]")),
        ("--gone", "dive", "--new", "dives"),
    ),
    "other bounds": (
        lambda: edit("contextdb.toml", "max = 7.0", "max = 8.0"),
        ("--redefined", "moves", "--redefined", "dive", "--redefined", "land"),
    ),
    "fewer cases": (lambda: remove("moves.cases.csv"), ("--fewer-cases", "moves")),
}


@pytest.mark.parametrize("name", HONEST)
def test_an_honest_change_ends_green(name: str, monkeypatch: pytest.MonkeyPatch):
    change, options = HONEST[name]
    change()
    result = example(monkeypatch, *options)
    assert result.code == 0, result.out + result.err
    assert result.lines[-1] == "PASSED."
