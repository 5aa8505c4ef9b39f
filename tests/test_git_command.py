"""`contextdb git`: a real repository whose merges, rebases and diffs go cell by cell once one command has been run."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from running import ROOT, run
from strategies import some
from warm_commands import warm_program
from warm_start import python

from contextdb import cli
from contextdb.commands.git_setup import Setup
from contextdb.errors import ContextDBError, Fault

BASE = "Asset,speed,hit\r\nwalk,0..5,True\r\nrun,5..9,Any\r\njump,Any,False\r\n"
TOML = '[conditions.speed]\ntype = "number"\nmin = 0.0\nmax = 10.0\n'
PROGRAM = """import os, sys
if "cli" not in sys.argv[1:2]:
    os.execv({python[0]!r}, [*{python!r}, os.path.abspath(__file__), "cli", *sys.argv[1:]])
del sys.argv[1]
sys.path.insert(0, {root!r})
from contextdb import cli
{change}
sys.exit(cli.main(sys.argv[1:]))
"""


def git(*arguments: str, fails: bool = False) -> str:
    done = subprocess.run(["git", *arguments], capture_output=True, encoding="utf-8")
    assert (done.returncode != 0) == fails, done.stderr
    return done.stdout + done.stderr


def commit(message: str) -> None:
    git("add", "-A")
    git("commit", "-q", "-m", message)


def put(name: str, text: str) -> None:
    Path(name).parent.mkdir(exist_ok=True)
    Path(name).write_bytes(text.encode())


def read(name: str) -> str:
    return Path(name).read_bytes().decode()


def branched(name: str, ours: str, theirs: str) -> None:
    git("checkout", "-q", "-b", "other")
    put(name, theirs)
    commit("theirs")
    git("checkout", "-q", "main")
    put(name, ours)
    commit("ours")


@pytest.fixture(scope="module")
def warm() -> Iterator[str]:
    with warm_program() as program:
        yield program


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, warm: str) -> Path:
    """A repository with one table, in a folder with a blank in its name; nobody's own git configuration holds."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    monkeypatch.setitem(cli.COMMANDS, "git", "tables in git")
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "global config"))
    monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")
    folder = tmp_path / "my game"
    folder.mkdir()
    (tmp_path / "a driver.py").write_text(warm, encoding="utf-8")
    monkeypatch.chdir(folder)
    git("init", "-q", "-b", "main")
    for key, value in {"user.name": "t", "user.email": "t@example.org", "core.autocrlf": "false"}.items():
        git("config", key, value)
    put("my tables/t.csv", BASE)
    put("my tables/contextdb.toml", TOML)
    commit("base")
    return folder


@pytest.fixture
def installed(here: Path) -> Path:
    assert install().code == 0
    commit("attributes")
    return here


@pytest.fixture
def installed_alone(installed: Path) -> Path:
    """Here git starts the whole of contextdb for each file, as it does for everybody."""
    in_a_process_of_its_own()
    return installed


def install(*arguments: str):
    program = Path("..", "a driver.py").resolve()
    return run("git", "install", *arguments, "--command", f"'{Path(sys.executable).as_posix()}' '{program.as_posix()}'")


def in_a_process_of_its_own(change: str = "") -> None:
    """Let the driver load contextdb, change something in it, and run there."""
    Path("..", "a driver.py").write_text(PROGRAM.format(root=str(ROOT), change=change, python=python()), encoding="utf-8")


# ---- install, status, uninstall


def test_install_says_what_it_wrote_and_does_nothing_the_second_time(here):
    put(".gitattributes", "*.png binary")
    first = install()
    assert first.lines[0] == ".gitattributes: 3 lines written; commit it"
    assert "merge.contextdb.driver" in first.lines[1]
    written = read(".gitattributes")
    assert written.startswith("*.png binary\n*.csv merge=contextdb diff=contextdb\n")
    assert install().out == "nothing to do: all is set\n"
    assert read(".gitattributes") == written


def test_a_line_that_was_there_already_is_not_written_again(here):
    put(".gitattributes", "*.csv merge=contextdb diff=contextdb\r\n")
    install()
    assert read(".gitattributes").count("*.csv") == 1
    assert read(".gitattributes").count("\r\n") == 3


def test_uninstall_takes_back_these_lines_and_keys_and_nothing_else(here):
    put(".gitattributes", "*.png binary\n")
    git("config", "merge.other.driver", "true")
    before = git("config", "--local", "--list")
    install()
    assert run("git", "uninstall").code == 0
    assert read(".gitattributes") == "*.png binary\n"
    assert git("config", "--local", "--list") == before
    assert run("git", "uninstall").out == "nothing to do: nothing is set\n"


@pytest.mark.parametrize("given", ["", "*.png binary\n"])
def test_an_install_whose_configuration_cannot_be_written_leaves_nothing(here, given):
    if given:
        put(".gitattributes", given)
    put(".git/config.lock", "")
    before = read(".git/config")
    result = install()
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert "could not lock config file" in result.err
    assert read(".git/config") == before
    assert (read(".gitattributes") if given else Path(".gitattributes").exists()) == (given or False)


@pytest.mark.parametrize("at", range(4))
@pytest.mark.parametrize("way", ["install", "uninstall"])
def test_a_change_that_fails_half_way_is_taken_back_whole(here, monkeypatch, way, at):
    git("config", "merge.contextdb.name", "an older one")
    git("config", "--add", "merge.contextdb.name", "of two lines\nor more")
    if way == "uninstall":
        install()
    before = (git("config", "--local", "--list"), Path(".gitattributes").exists())
    name, changes = ("set", []) if way == "install" else ("unset", [])
    change = getattr(Setup, name)

    def fails_later(setup: Setup, key: str, *value: str) -> None:
        changes.append(key)
        if len(changes) == at + 1:
            raise ContextDBError(Fault("git config failed: no room."))
        change(setup, key, *value)

    monkeypatch.setattr(Setup, name, fails_later)
    result = install() if way == "install" else run("git", "uninstall")
    assert (result.code, result.err) == (2, "contextdb: git config failed: no room.\n")
    assert sorted(git("config", "--local", "--list").split("\n")) == sorted(before[0].split("\n"))
    assert Path(".gitattributes").exists() == before[1]


def test_attributes_that_held_nothing_else_are_removed(here):
    install()
    run("git", "uninstall")
    assert git("status", "--porcelain") == ""


def test_status_exits_with_1_until_all_is_set(here):
    result = run("git", "status")
    assert (result.code, result.out.count("missing")) == (1, 7)
    install()
    result = run("git", "status")
    assert (result.code, result.out.count("missing")) == (0, 0)
    assert "merge %O %A %B --path=%P || {" in result.out
    assert "git text --\n" in result.out


def test_the_attributes_can_stand_in_a_folder_with_a_blank(here):
    install("my tables")
    assert Path("my tables", ".gitattributes").is_file()
    assert not Path(".gitattributes").exists()
    assert "my tables/t.csv: merge: contextdb" in git("check-attr", "merge", "my tables/t.csv")


def test_the_configuration_of_all_repositories_is_left_to_global(here):
    before = git("config", "--local", "--list")
    install("--global")
    assert git("config", "--local", "--list") == before
    assert "git text" in git("config", "--global", "diff.contextdb.textconv")
    run("git", "uninstall", "--global")
    assert git("config", "--global", "--list") == ""


def test_a_folder_of_no_repository_is_named(tmp_path, monkeypatch):
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    monkeypatch.setitem(cli.COMMANDS, "git", "tables in git")
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    result = run("git", "install", tmp_path)
    assert (result.code, result.out) == (2, "")
    assert "the folder is in no git repository" in result.err
    assert run("git", "install", tmp_path / "missing").code == 2


def test_a_machine_without_git_is_told_so(here, monkeypatch):
    monkeypatch.setenv("PATH", "")
    result = run("git", "install")
    assert result.code == 2
    assert "git cannot be run" in result.err


@pytest.mark.parametrize("command", ["install", "status", "uninstall"])
def test_this_clone_is_meant_unless_told_otherwise(here, command):
    git("config", "--global", "user.name", "somebody")
    if command != "install":
        install("--local")
    done = install() if command == "install" else run("git", command)
    assert done.code == 0
    assert "the configuration of this clone" in done.out
    assert git("config", "--global", "--list") == "user.name=somebody\n"


# ---- what git then does


def test_two_branches_merge_and_rebase_cell_by_cell(installed_alone):
    ours, theirs = BASE.replace("walk,0..5", "walk,1..5"), BASE.replace("0..5,True", "0..5,False")
    branched("my tables/t.csv", ours, theirs)
    git("merge", "-q", "other", "-m", "both")
    assert read("my tables/t.csv") == ours.replace("1..5,True", "1..5,False")
    git("reset", "-q", "--hard", "HEAD~1")
    git("rebase", "-q", "other")
    assert read("my tables/t.csv") == ours.replace("1..5,True", "1..5,False")


def test_a_conflict_stands_between_marks_and_the_file_stays_unmerged(installed):
    branched("my tables/t.csv", BASE.replace("5..9", "1..2"), BASE.replace("5..9", "3..4"))
    said = git("merge", "-q", "other", "-m", "both", fails=True)
    assert "my tables/t.csv: run, speed" in said
    assert "<<<<<<< ours\r\nrun,1..2,Any" in read("my tables/t.csv")
    assert git("status", "--porcelain") == 'UU "my tables/t.csv"\n'


def test_edits_go_into_a_file_that_the_other_branch_renamed(installed):
    git("checkout", "-q", "-b", "other")
    git("mv", "my tables/t.csv", "my tables/moved here.csv")
    commit("renamed")
    git("checkout", "-q", "main")
    put("my tables/t.csv", BASE.replace("5..9", "1..2"))
    commit("ours")
    git("merge", "-q", "other", "-m", "both")
    assert read("my tables/moved here.csv") == BASE.replace("5..9", "1..2")


def test_columns_added_on_both_sides_are_both_declared(installed):
    more = [TOML + f'\n[conditions.{name}]\ntype = "bool"\n' for name in ("inAir", "stunned")]
    branched("my tables/contextdb.toml", *more)
    git("merge", "-q", "other", "-m", "both")
    merged = read("my tables/contextdb.toml")
    assert "[conditions.inAir]" in merged
    assert "[conditions.stunned]" in merged


def test_git_diff_and_git_log_show_the_asset_and_the_cell(installed_alone):
    put("my tables/t.csv", BASE.replace("5..9", "5..8"))
    told = git("diff")
    assert "\n run\n-  speed: 5..9\n+  speed: 5..8\n   hit: Any\n" in told
    commit("slower")
    assert "\n run\n-  speed: 5..9\n+  speed: 5..8\n" in git("log", "-p", "-1")


def test_the_heading_of_a_hunk_names_its_asset(installed):
    names = [f"c{i}" for i in range(9)]
    wide = f"Asset,{','.join(names)}\nwalk,{','.join('1' * 9)}\n"
    put("wide.csv", wide)
    commit("wide")
    put("wide.csv", wide.removesuffix("1\n") + "2\n")
    assert "@@ walk\n" in git("diff")


def test_git_diff_shows_a_file_that_is_no_table_as_it_is(installed):
    put("my tables/t.csv", BASE + "too,many,cells,here\r\n")
    assert "+too,many,cells,here" in git("diff")


# ---- what cannot be merged cell by cell


OPEN_QUOTE = BASE.replace("walk,0..5", 'walk,"0..4') + "land,Any,Any\r\n"
WAYS = {
    "merge": ("merge", "-q", "other", "-m", "both"),
    "rebase": ("rebase", "-q", "other"),
    "cherry-pick": ("cherry-pick", "other"),
}


CASES = [
    ("cells", "merge", True),
    ("cells", "merge", False),
    ("cells", "rebase", False),
    ("cells", "rebase", True),
    ("cells", "cherry-pick", True),
    ("cells", "cherry-pick", False),
    ("without contextdb", "merge", True),
    ("without contextdb", "rebase", False),
    ("without git merge-file", "merge", False),
]


def driven(driver: str) -> None:
    """Have git call the driver, one that is not there, or one that finds no git."""
    if driver == "without contextdb":
        assert run("git", "install", "--command", "no-such-contextdb").code == 0
    if driver == "without git merge-file":
        in_a_process_of_its_own("import subprocess\nsubprocess.run = lambda *a, **b: (_ for _ in ()).throw(OSError())")


@pytest.mark.parametrize(("driver", "way", "is_ours"), some(CASES))
def test_of_a_side_that_cannot_be_read_no_row_is_left_out_without_a_mark(installed, driver, way, is_ours):
    driven(driver)
    other = BASE.replace("walk,0..5", "walk,1..5") + "climb,Any,Any\r\n"
    branched("my tables/t.csv", *((OPEN_QUOTE, other) if is_ours else (other, OPEN_QUOTE)))
    said = git(*WAYS[way], fails=True)
    if driver != "without contextdb":
        assert "my tables/t.csv (" in said
        assert ".merge_file" not in said
    assert git("status", "--porcelain") == 'UU "my tables/t.csv"\n'
    git("add", "-A")
    git("-c", "core.editor=true", "commit", "-q", "-m", "without looking")
    for row in ('walk,"0..4', "walk,1..5", "land,", "climb,"):
        assert row in read("my tables/t.csv")
    checked = run("check", "my tables")
    assert checked.code != 0
    assert "my tables/t.csv" in checked.out.replace("\\", "/")
    assert "an unresolved git conflict" in checked.out


@pytest.mark.parametrize("broken", ["[conditions.speed\n", "\udcff"], ids=["no TOML", "not UTF-8"])
def test_of_a_contextdb_toml_that_cannot_be_read_no_key_is_left_out_without_a_mark(installed, broken):
    ours, theirs = TOML.replace("10.0", "20.0"), TOML.replace("10.0", "30.0")
    git("checkout", "-q", "-b", "other")
    Path("my tables/contextdb.toml").write_bytes(theirs.encode() + broken.encode(errors="surrogateescape"))
    commit("theirs")
    git("checkout", "-q", "main")
    put("my tables/contextdb.toml", ours)
    commit("ours")
    said = git("merge", "-q", "other", "-m", "both", fails=True)
    assert "my tables/contextdb.toml (theirs)" in said.replace("\\", "/")
    raw = Path("my tables/contextdb.toml").read_bytes()
    assert all(part in raw for part in (b"<<<<<<< ours", b"max = 20.0", b"max = 30.0", b">>>>>>> theirs"))


def test_lines_that_go_together_are_told_all_the_same(installed):
    long = BASE + "".join(f"a{i},Any,Any\r\n" for i in range(20))
    put("my tables/t.csv", long)
    commit("more")
    broken = long + 'land,"open,Any\r\n'
    branched("my tables/t.csv", long.replace("walk,0..5", "walk,1..5"), broken)
    said = git("merge", "-q", "other", "-m", "both", fails=True)
    assert "lines were merged instead of cells, with 0 places between marks." in said
    assert read("my tables/t.csv") == broken.replace("walk,0..5", "walk,1..5")


def test_a_table_whose_name_begins_with_a_dash_merges_and_is_shown_cell_by_cell(installed):
    put("-t.csv", BASE)
    commit("dash")
    branched("-t.csv", BASE.replace("walk,0..5", "walk,1..5"), BASE.replace("5..9", "5..8"))
    git("merge", "-q", "other", "-m", "both")
    assert read("-t.csv") == BASE.replace("walk,0..5", "walk,1..5").replace("5..9", "5..8")
    put("-t.csv", BASE)
    assert "-  speed: 5..8\n" in git("diff", "--", "-t.csv")
    assert "fatal" not in git("log", "-p", "--no-merges", "-2", "--", "-t.csv")
    commit("back")
    branched_again = BASE.replace("5..9", "1..2"), BASE.replace("5..9", "3..4")
    git("branch", "-D", "other")
    branched("-t.csv", *branched_again)
    assert "-t.csv: run, speed" in git("merge", "-q", "other", "-m", "both", fails=True)


def test_a_table_that_both_sides_added_has_the_rows_of_both(installed):
    git("checkout", "-q", "-b", "other")
    put("new.csv", "Asset,speed\nwalk,1\nswim,2\n")
    commit("theirs")
    git("checkout", "-q", "main")
    put("new.csv", "Asset,speed\nwalk,1\nclimb,3\n")
    commit("ours")
    git("merge", "-q", "other", "-m", "both", fails=True)
    assert all(part in read("new.csv") for part in ("<<<<<<< ours", "climb,3", "swim,2", ">>>>>>> theirs"))


def test_a_parquet_file_that_cannot_be_read_is_told_and_stays_as_ours_has_it(installed):
    Path("t.parquet").write_bytes(b"PAR1 base")
    commit("base of it")
    git("checkout", "-q", "-b", "other")
    Path("t.parquet").write_bytes(b"PAR1 theirs")
    commit("theirs")
    git("checkout", "-q", "main")
    Path("t.parquet").write_bytes(b"PAR1 ours")
    commit("ours")
    said = git("merge", "-q", "other", "-m", "both", fails=True)
    assert "t.parquet: the file stays as ours has it. Try to take one side with git checkout --ours or --theirs." in said
    assert git("status", "--porcelain") == "UU t.parquet\n"
    assert Path("t.parquet").read_bytes() == b"PAR1 ours"
