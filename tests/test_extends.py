"""`[project] extends`: the conditions and blueprints of another project, found inside the repository, through no link."""

import os
import subprocess

import pytest

from contextdb import Project, load, watch
from contextdb.disk.boundary import TYPED_ROOT
from contextdb.edits.renaming import renaming
from contextdb.edits.schema_file import schema_change
from contextdb.errors import ContextDBError, FileError, SchemaError
from contextdb.tables.changes import Sections
from tests.running import run

STUDIO = """\
[project]
name = "studio"
[conditions.speed]
type = "number"
min = 0
max = 10
[conditions.fast]
type = "bool"
expr = "speed > 5"
[blueprints.moving]
conditions = ["speed", "fast"]
[tables.elsewhere]
policy = "first"
"""
GAME = """\
[project]
name = "game"
extends = "../studio/contextdb.toml"
[conditions.Air]
type = "bool"
[tables.moves]
assume = ["not (Air and fast)"]
"""


@pytest.fixture
def game(tmp_path):
    """A repository with the projects studio and game."""
    (tmp_path / ".git").mkdir()
    for name, text in (("studio", STUDIO), ("game", GAME)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "contextdb.toml").write_text(text)
    (tmp_path / "game" / "moves.csv").write_text("Asset,speed,Air\nwalk,0..5,False\nrun,5..,Any\n")
    return tmp_path / "game"


def refused(folder):
    with pytest.raises(ContextDBError) as error:
        Project.load(folder)
    return str(error.value)


def test_a_project_has_the_conditions_and_blueprints_of_the_one_that_it_extends(game):
    project = Project.load(game)
    assert list(project.schema.conditions) == ["speed", "fast", "Air"]
    assert project.schema.blueprints == {"moving": ("speed", "fast")}
    assert list(project.schema.tables) == ["moves"]
    assert project.schema.name == "game"
    assert project["moves"].condition("speed").condition.domain.maximum == 10
    assert project["moves"].compile().query({"speed": 7, "Air": True}).assets == ["run"]
    assert "unused-condition" not in run("check", game, "--format", "json").out


def test_what_the_project_declares_itself_holds(game):
    (game / "contextdb.toml").write_text(GAME + '[conditions.speed]\ntype = "number"\nmax = 20\n')
    assert load(game / "moves.csv").condition("speed").condition.domain.maximum == 20


def test_a_studio_may_extend_another(game):
    (game.parent / "studio" / "contextdb.toml").write_text('[project]\nextends = "../house.toml"\n' + STUDIO.split("\n", 2)[2])
    (game.parent / "house.toml").write_text('[conditions.mood]\ntype = "enum"\nvalues = ["calm", "angry"]\n')
    assert list(Project.load(game).schema.conditions) == ["mood", "speed", "fast", "Air"]
    (game.parent / "house.toml").write_text('[project]\nextends = "game/contextdb.toml"\n')
    assert "the project extends itself" in refused(game)


def test_it_climbs_to_the_repository_and_no_farther(game):
    (game.parent / ".git").rmdir()
    (game / ".git").mkdir()
    assert "the file is not in" in refused(game)
    assert run("check", game).code == 1
    assert run("check", game, "--root", game.parent).code == 0
    assert TYPED_ROOT.get() is not None
    TYPED_ROOT.set(None)


def test_a_typed_root_that_does_not_hold_the_project_counts_for_nothing(game, tmp_path_factory):
    (game.parent / ".git").rmdir()
    token = TYPED_ROOT.set(tmp_path_factory.mktemp("other"))
    try:
        assert "the file is not in" in refused(game)
    finally:
        TYPED_ROOT.reset(token)


@pytest.mark.parametrize("linked", ["file", "folder"])
def test_it_never_goes_through_a_link(game, linked):
    studio = game.parent / "studio"
    secret = game.parent / "secret"
    studio.rename(secret)
    if linked == "folder":
        studio.symlink_to(secret)
    else:
        studio.mkdir()
        (studio / "contextdb.toml").symlink_to(secret / "contextdb.toml")
    assert "a link is on its way" in refused(game)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("../nobody/contextdb.toml", "there is no such file"),
        ("../../../../../../../../etc/x.toml", "the file is not in"),
        ("/etc/contextdb.toml", "it names a place on one machine"),
        ("..\\\\studio", 'Did you mean extends = "../studio/contextdb.toml"?'),
        ("../studio", 'Did you mean extends = "../studio/contextdb.toml"?'),
        ("", "this is empty"),
        ("contextdb.toml", "the project extends itself"),
    ],
)
def test_a_path_that_cannot_be_extended_is_an_error(game, path, words):
    (game / "contextdb.toml").write_text(GAME.replace("../studio/contextdb.toml", path))
    assert words in refused(game)


def test_faults_of_the_studio_are_reported_at_their_place(game):
    (game.parent / "studio" / "contextdb.toml").write_text(STUDIO.replace('"bool"', '"bol"'))
    assert f"{game.parent / 'studio' / 'contextdb.toml'}, line 8" in refused(game)


def test_an_edit_changes_nothing_of_the_studio(game):
    table = load(game / "moves.csv")
    own = Sections(parts={"conditions": {"Air": {"type": "bool", "description": "off the ground"}}}).apply(table)
    change = schema_change(table, own)
    assert change is not None
    assert b"off the ground" in change.raw
    assert b"[conditions.speed]" not in change.raw
    shared = Sections(parts={"conditions": {"speed": {"type": "number", "min": 0, "max": 99}}}).apply(table)
    with pytest.raises(SchemaError, match=r"\[conditions\.speed\] is not declared in this file"):
        schema_change(table, shared)
    with pytest.raises(SchemaError, match=r"\[conditions\.speed\] is not declared in this file"):
        renaming(table, "speed", "pace")


def test_a_change_of_the_studio_reloads_the_project(game):
    times = iter(range(0, 1000, 10))
    with watch(game, poll_s=None, settle_s=0.0, clock=lambda: float(next(times))) as now:
        assert now["moves"].query({"speed": 12, "Air": False}).assets == ["run"]
        (game.parent / "studio" / "contextdb.toml").write_text(STUDIO.replace("speed > 5", "speed > 7"))
        assert any(now.poll() for _ in range(4))
        assert now.project.schema.conditions["fast"].expr == "speed > 7"


def test_ci_reads_the_studio_as_it_was(game):
    (game.parent / ".git").rmdir()
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(game.parent)]
    for words in (["init", "-q"], ["add", "."], ["commit", "-qm", "one"]):
        subprocess.run([*git, *words], check=True, capture_output=True, env={**os.environ, "GIT_CONFIG_GLOBAL": os.devnull})
    (game.parent / "studio" / "contextdb.toml").write_text(STUDIO.replace("max = 10", "max = 12"))
    done = run("ci", game, "--against", "HEAD")
    assert "1 table" in done.lines[0]
    assert "conditions" in done.out or done.code == 1


def test_reading_a_missing_studio_is_a_file_error(game):
    (game.parent / "studio" / "contextdb.toml").unlink()
    with pytest.raises(FileError):
        load(game / "moves.csv")
