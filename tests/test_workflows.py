"""What is published beside the code: the workflow for other repositories, run step by step in a checkout; forms; citation."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from warm_start import python

import contextdb

ROOT = Path(__file__).parent.parent
GITHUB = ROOT / ".github"
TABLE = "Asset,speed\nwalk,0..2\nrun,(2..5]\n"
TOML = '[conditions.speed]\ntype = "number"\nmin = 0\nmax = 5\n'


def read(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


WORKFLOW = read(GITHUB / "workflows" / "tables.yml")["jobs"]["tables"]
STEPS = {step["name"]: step["run"] for step in WORKFLOW["steps"] if "name" in step}


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A repository whose branch "main" lies at origin/main, and on whose own branch a row is missing."""
    made = tmp_path / "checkout"
    (made / "tables").mkdir(parents=True)
    (made / "tables" / "contextdb.toml").write_text(TOML, encoding="utf-8")
    (made / "tables" / "moves.csv").write_text(TABLE, encoding="utf-8")
    git(made, "init", "--quiet", "--initial-branch=main")
    git(made, "add", ".")
    git(made, "-c", "user.name=a", "-c", "user.email=a@example.com", "commit", "--quiet", "-m", "tables")
    git(made, "update-ref", "refs/remotes/origin/main", "HEAD")
    return made


def git(folder: Path, *arguments: str) -> None:
    subprocess.run(["git", *arguments], cwd=folder, check=True, capture_output=True)


def run_step(name: str, checkout: Path, max_drop: str = "0", accept: str = "") -> subprocess.CompletedProcess[str]:
    """A step of the workflow as the runner runs it."""
    temporary = checkout.parent / "runner"
    temporary.mkdir(exist_ok=True)
    program = temporary / "contextdb"
    program.write_text(f'#!/bin/sh\nexec {shlex.join(python("-m", "contextdb"))} "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    own = {
        "PATH": os.pathsep.join([str(temporary), str(Path(sys.executable).parent), os.environ["PATH"]]),
        "ACCEPT": accept,
        "FOLDER": "tables",
        "MAX_DROP": max_drop,
        "GITHUB_BASE_REF": "main",
        "GITHUB_STEP_SUMMARY": str(temporary / "summary.md"),
        "RUNNER_TEMP": str(temporary / "own"),
    }
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", STEPS[name]]
    return subprocess.run(command, cwd=checkout, env=os.environ | own, capture_output=True, encoding="utf-8")


def reports(checkout: Path) -> Path:
    return checkout.parent / "runner" / "own" / "contextdb"


pytestmark = pytest.mark.skipif(
    not (shutil.which("bash") and shutil.which("contextdb", path=str(Path(sys.executable).parent))),
    reason="needs bash, and contextdb installed beside this Python",
)


def test_the_workflow_lets_a_change_pass_that_opens_no_gap(checkout: Path):
    done = run_step("compare", checkout)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("tables: 1 table, compared with origin/main (commit ")
    assert (reports(checkout) / "coverage.html").is_file()
    assert run_step("summary", checkout).returncode == 0
    assert "moves" in (checkout.parent / "runner" / "summary.md").read_text(encoding="utf-8")


def test_the_workflow_fails_a_change_that_opens_a_gap_and_names_it(checkout: Path):
    (checkout / "tables" / "moves.csv").write_text(TABLE.replace("run,(2..5]\n", ""), encoding="utf-8")
    done = run_step("compare", checkout)
    assert done.returncode == 1
    assert "speed: (2..5]" in done.stdout
    assert (reports(checkout) / "coverage.html").is_file()
    assert run_step("compare", checkout, max_drop="60").returncode == 0


@pytest.mark.parametrize("is_there", [False, True])
def test_the_workflow_lets_the_first_tables_pass_and_those_that_mend_broken_ones_when_told(checkout: Path, is_there: bool):
    moves = checkout / "tables" / "moves.csv"
    if is_there:
        moves.write_text(TABLE.replace("0..2", "slow"), encoding="utf-8")
        git(checkout, "add", ".")
    else:
        git(checkout, "rm", "--quiet", "-r", "--cached", "tables")
    git(checkout, "-c", "user.name=a", "-c", "user.email=a@example.com", "commit", "--quiet", "--allow-empty", "-m", "before")
    git(checkout, "update-ref", "refs/remotes/origin/main", "HEAD")
    moves.write_text(TABLE, encoding="utf-8")
    done = run_step("compare", checkout)
    assert (done.returncode, "Where that is intended: --uncompared" in done.stdout) == (1, True)
    assert run_step("compare", checkout, accept="--uncompared").returncode == 0


def test_the_workflow_names_a_table_that_is_gone_and_lets_it_go_when_told(checkout: Path):
    (checkout / "tables" / "moves.csv").rename(checkout / "tables" / "steps.csv")
    done = run_step("compare", checkout)
    assert (done.returncode, "moves" in done.stdout) == (1, True)
    assert "moves" in (reports(checkout) / "summary.md").read_text(encoding="utf-8")
    assert run_step("compare", checkout, accept="--gone moves --new steps").returncode == 0
    assert run_step("compare", checkout, accept="--gone moves --gone others --new steps").returncode == 2


def test_the_workflow_fails_a_table_that_cannot_be_read_at_its_line(checkout: Path):
    (checkout / "tables" / "moves.csv").write_text(TABLE.replace("0..2", "fast"), encoding="utf-8")
    for step in ("check", "compare"):
        done = run_step(step, checkout)
        assert done.returncode == 1
        assert "::error file=tables/moves.csv,line=2" in done.stdout


def test_the_example_of_the_page_is_the_step_of_the_workflow():
    """The page shows one job; the gates that hold it are held in tests/test_ci_command.py."""
    page = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")
    job = next(yaml.safe_load(block) for block in re.findall(r"```yaml\n(.*?)```", page, re.S) if "contextdb ci" in block)
    (command,) = [step["run"] for step in job["jobs"]["tables"]["steps"] if "contextdb ci" in step.get("run", "")]
    assert command == 'contextdb ci tables --against "origin/$GITHUB_BASE_REF" --out "$RUNNER_TEMP/contextdb" --format github'
    assert command.replace("tables --against", '"$FOLDER" --against').split(" --out")[0] in STEPS["compare"]


def test_the_forms_of_issues_have_what_a_forge_asks_of_them():
    forms = [read(path) for path in sorted((GITHUB / "ISSUE_TEMPLATE").glob("*.yml")) if path.name != "config.yml"]
    assert len(forms) == 2
    for form in forms:
        assert {"name", "description", "body"} <= form.keys()
        ids = [part["id"] for part in form["body"]]
        assert len(ids) == len(set(ids))
        assert all(part["type"] in ("input", "textarea") and part["attributes"]["label"] for part in form["body"])


def test_the_citation_names_the_version():
    citation = read(ROOT / "CITATION.cff")
    assert (citation["cff-version"], citation["version"]) == ("1.2.0", contextdb.__version__)
