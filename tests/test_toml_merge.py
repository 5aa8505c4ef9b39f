"""Two versions of contextdb.toml made one, key by key, with the comments of ours."""

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import run

from contextdb import cli
from contextdb.edits.diffing.toml_merging import merge_toml
from contextdb.errors import SchemaError

BASE = """# the project
[project]
name = "gridiron"

[conditions.speed]
type = "number"   # m/s
max = 10.0

[tables.t]
outputs = ["Slots"]
"""
HIT = '\n[conditions.hit]\ntype = "bool"\n'
TAGS = '\n[conditions.tags]\ntype = "tags"\nvalues = ["A"]\n'


def test_columns_declared_on_both_sides_both_stand_in_the_merge():
    found = merge_toml(BASE, BASE + HIT, BASE + TAGS)
    assert found.conflicts == ()
    assert set(tomllib.loads(found.text)["conditions"]) == {"speed", "hit", "tags"}
    assert found.text.startswith(BASE.partition("[tables.t]")[0])


def test_keys_changed_on_either_side_are_changed_and_comments_stay():
    ours = BASE.replace("10.0", "20.0").replace("# the project", "# our project")
    theirs = BASE.replace('"number"', '"int"').replace('["Slots"]', '["Slots", "More"]')
    found = merge_toml(BASE, ours, theirs)
    assert found.text == ours.replace('"number"', '"int"').replace('["Slots"]', '["Slots", "More"]')


def test_a_key_and_a_section_that_theirs_took_away_are_gone():
    theirs = BASE.replace("max = 10.0\n", "").replace('[tables.t]\noutputs = ["Slots"]\n', "")
    said = tomllib.loads(merge_toml(BASE, BASE + HIT, theirs).text)
    assert said == tomllib.loads(theirs + HIT)


def test_a_key_changed_to_two_values_stands_between_marks():
    ours, theirs = BASE.replace("10.0", "20.0"), BASE.replace("10.0", "30.0") + HIT
    found = merge_toml(BASE, ours, theirs)
    assert found.conflicts == (("conditions", "speed", "max"),)
    marked = "<<<<<<< ours\nmax = 20.0\n||||||| base\nmax = 10.0\n=======\nmax = 30.0\n>>>>>>> theirs\n"
    assert found.with_markers == found.text.replace("max = 20.0\n", marked)
    assert "hit" in tomllib.loads(found.text)["conditions"]


def test_a_key_changed_here_and_taken_away_there_is_a_conflict():
    found = merge_toml(BASE, BASE.replace("10.0", "20.0"), BASE.replace("max = 10.0\n", ""))
    assert found.conflicts == (("conditions", "speed", "max"),)
    assert "max = 20.0\n||||||| base\nmax = 10.0\n=======\n>>>>>>> theirs\n" in found.with_markers


def test_a_section_taken_away_here_and_changed_there_puts_the_whole_file_between_marks():
    ours = BASE.partition("[conditions.speed]")[0]
    found = merge_toml(BASE, ours, BASE.replace("10.0", "20.0"))
    assert found.with_markers.startswith("<<<<<<< ours\n# the project\n")
    assert found.with_markers.count("=======") == 1


@pytest.mark.parametrize(
    ("theirs", "said"),
    [
        ('name = "gridiron"\n', {"name": "gridiron"}),
        ('project = "gridiron"\n', {"project": "gridiron"}),
        ('# theirs\nproject.name.long = "gridiron"\n', {"project": {"name": {"long": "gridiron"}}}),
    ],
)
def test_a_key_that_theirs_moved_out_of_a_section_or_into_one_is_moved(theirs, said):
    """A header that became part of a comment leaves its keys above all sections."""
    rest = BASE[BASE.index("[conditions") :]
    found = merge_toml(BASE, BASE, theirs + rest)
    assert (found.conflicts, _without_empty(tomllib.loads(found.text))) == ((), said | tomllib.loads(rest))


@pytest.mark.parametrize(("base", "ours"), [("", "a = 3\n"), ("a = 5\n", "a = 6\n")])
def test_a_value_here_and_a_section_of_that_name_there_are_a_conflict(base, ours):
    found = merge_toml(base, ours, "[a]\nb = 1\n")
    assert (found.conflicts[-1:], found.text) == ((("a",),) if base else (("a", "b"),), ours)
    assert found.with_markers == f"<<<<<<< ours\n{ours}||||||| base\n{base}=======\n[a]\nb = 1\n>>>>>>> theirs\n"


def test_a_section_here_and_a_value_of_that_name_there_are_a_conflict():
    assert merge_toml("", "[a]\nc = 2\n", "a = 5\n").conflicts == (("a",),)


def test_a_text_that_is_no_toml_is_refused_with_its_name():
    with pytest.raises(SchemaError, match=r"theirs\.toml"):
        merge_toml(BASE, BASE, "[conditions", ("base.toml", "ours.toml", "theirs.toml"))


@given(st.data())
def test_changes_of_different_keys_are_both_made(data):
    sections, keys = ["a", "b.c", "d"], ["x", "y", "z"]
    values = st.sampled_from([1, 2.5, "text", True, ["A", "B"]])

    def document(said: dict[tuple[str, str], object]) -> str:
        lines = []
        for section in sections:
            own = [f"{key} = {str(v).lower() if v is True else repr(v)}" for (s, key), v in said.items() if s == section]
            lines += [f"[{section}]", *own, ""] if own else []
        return "\n".join(lines).replace("'", '"')

    places = [(s, k) for s in sections for k in keys]
    base = {p: data.draw(values) for p in places if data.draw(st.booleans())}
    mine = {p for p in places if data.draw(st.booleans())}
    ours, theirs, both = dict(base), dict(base), dict(base)
    for place in places:
        side = ours if place in mine else theirs
        what = data.draw(st.sampled_from(["keep", "drop", "set"]))
        if what != "keep":
            for said in (side, both):
                said.pop(place, None)
                said |= {place: data.draw(values)} if what == "set" and said is side else {}
            both |= {place: side[place]} if place in side else {}
    found = merge_toml(document(base), document(ours), document(theirs))
    assert found.conflicts == ()
    made, expected = (_without_empty(tomllib.loads(text)) for text in (found.text, document(both)))
    assert _typed(made) == _typed(expected)


def _typed(said: dict[str, object]) -> list[str]:
    """What it says in any order, with 1, 1.0 and true apart."""
    return sorted(f"{key}: {_typed(value) if isinstance(value, dict) else repr(value)}" for key, value in said.items())


def _without_empty(said: dict[str, object]) -> dict[str, object]:
    inner = {key: _without_empty(value) if isinstance(value, dict) else value for key, value in said.items()}
    return {key: value for key, value in inner.items() if value != {}}


def test_the_command_merges_a_contextdb_toml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(cli.COMMANDS, "merge", "merge two versions of a table")
    monkeypatch.chdir(tmp_path)
    for name, text in (("base", BASE), ("ours", BASE + HIT), ("theirs", BASE + TAGS)):
        Path(name).write_text(text, encoding="utf-8")
    assert run("merge", "base", "ours", "theirs", "--path", "contextdb.toml").code == 0
    assert "[conditions.tags]" in Path("ours").read_text(encoding="utf-8")
    Path("theirs").write_text(BASE.replace("10.0", "5.0"), encoding="utf-8")
    Path("ours").write_text(BASE.replace("10.0", "6.0"), encoding="utf-8")
    result = run("merge", "base", "ours", "theirs", "--path", "contextdb.toml")
    assert result.code == 1
    assert '"conditions.speed.max" changed on both sides' in result.err
