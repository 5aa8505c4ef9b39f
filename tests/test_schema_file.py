"""contextdb.toml written from edits: it says what the table says, and every byte that no edit is about stays."""

import os
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from edit_strategies import insert_column, write_schema
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from contextdb.authoring.weights import set_selector
from contextdb.edits import edits
from contextdb.edits.schema_file import schema_change
from contextdb.errors import FileError, SchemaError
from contextdb.schema import toml_edit
from contextdb.schema.sections import schema_to_dict
from contextdb.tables.changes import Edit
from contextdb.tables.project import Project, load
from contextdb.tables.table import Table

TOML = """# a game
[project]
name = "game"      # ours


# ---- jog.csv

[tables.jog]
file = "jog.csv"
policy = "collect"              # variety
assume = ["not wet"]

[conditions.speed]
type = "number"
max = 7.0                       # nobody runs faster

[conditions.mood]
type = "enum"
values = [
  "calm",      # the usual
  # and when chased:
  "scared",
]

[blueprints.base]
conditions = ["mood"]


# ---- motion

[features.loco]
rate = 30.0
channels = [{ type = "position", bone = "Foot", weight = 1.0 }]

[databases.a]
clips = "a/*.bvh"
features = "loco"
[databases.b]
clips = "b/*.bvh"
features = "loco"

[selectors.walk]
order = [ { database = "a", threshold = 2.75 }, { database = "b" } ]   # tired first
"""
CSV = "Asset,speed,mood,wet,Slot,Rank\nwalk,0..2,calm,True,L,1\nrun,2..7,Any,Any,R,2\n"


def project(folder: Path, toml: str | bytes | None = TOML) -> Table:
    folder.mkdir(exist_ok=True)
    (folder / "jog.csv").write_text(CSV, encoding="utf-8")
    if toml is not None:
        (folder / "contextdb.toml").write_bytes(toml if isinstance(toml, bytes) else toml.encode())
    return load(folder / "jog.csv")


def raw(folder: Path) -> str:
    return (folder / "contextdb.toml").read_bytes().decode()


def saved(before: Table | None, after: Table) -> Table:
    """Save a table and what it says; gives it as it is loaded again."""
    after.save(overwrite=True)  # `after` need not go on from what was saved last
    write_schema(before, after)
    assert after.path is not None
    return load(after.path, strict=False)


def assert_says_the_same(now: Table, table: Table) -> None:
    assert now.settings == table.settings
    assert schema_to_dict(now.schema) == schema_to_dict(table.schema)


# ---- one key at a time: what the file says then, line by line


def changed_lines(before: str, after: str) -> list[str]:
    old, new = before.splitlines(), after.splitlines()
    return [f"-{line}" for line in old if line not in new] + [f"+{line}" for line in new if line not in old]


@pytest.mark.parametrize(
    ("edit", "lines"),
    [
        (
            lambda t: edits.set_settings(t, policy="first"),
            ['-policy = "collect"              # variety', '+policy = "first"              # variety'],
        ),
        (lambda t: edits.set_settings(t, priority="Rank", outputs=["Slot"]), ['+outputs = ["Slot"]', '+priority = "Rank"']),
        (lambda t: edits.set_settings(t, assume=None), ['-assume = ["not wet"]']),
        (
            lambda t: edits.set_settings(t, assume=["not wet", 'mood == "calm"']),
            ['-assume = ["not wet"]', '+assume = ["not wet", "mood == \\"calm\\""]'],
        ),
        (lambda t: edits.set_condition(t, "speed", min=-1, unit="m/s"), ["+min = -1", '+unit = "m/s"']),
        (lambda t: edits.set_condition(t, "mood", values=["calm", "scared", "mad"]), ['+  "mad",']),
        (lambda t: edits.set_condition(t, "speed", mirror="negate"), ['+mirror = "negate"']),
        (lambda t: edits.set_condition(t, "mood", mirror={"calm": "scared"}), ['+mirror = { calm = "scared" }']),
        (
            lambda t: edits.set_condition(t, "wet", description="in rain"),
            ["+[conditions.wet]", '+type = "bool"', '+description = "in rain"'],
        ),
        (
            lambda t: set_selector(t, "walk", [("a", 3.5), ("b", None)]),
            [
                '-order = [ { database = "a", threshold = 2.75 }, { database = "b" } ]   # tired first',
                '+order = [ { database = "a", threshold = 3.5 }, { database = "b" } ]   # tired first',
            ],
        ),
        (
            lambda t: edits.set_blueprint(t, "rain", ["wet", "mood"]),
            ["+[conditions.wet]", '+type = "bool"', "+[blueprints.rain]", '+conditions = ["wet", "mood"]'],
        ),
        (lambda t: edits.set_blueprint(t, "base", None), ["-[blueprints.base]", '-conditions = ["mood"]']),
        (lambda t: edits.rename_column(t, "speed", "pace"), ["+[conditions.pace]", "+max = 7"]),
        (
            lambda t: edits.rename_column(t, "speed", "pace", keep_declared=False),
            ["-[conditions.speed]", "+[conditions.pace]"],
        ),
    ],
)
def test_an_edit_changes_its_lines_and_no_other(tmp_path: Path, edit, lines: list[str]):
    table = project(tmp_path)
    after = edit(table).apply(table)
    assert_says_the_same(saved(table, after), after)
    assert changed_lines(TOML, raw(tmp_path)) == lines


@pytest.mark.parametrize(
    "edit",
    [
        lambda t: edits.set_settings(t, policy="first"),
        lambda t: edits.set_condition(t, "speed", min=0.0),
        lambda t: insert_column(t, 1, "a.b", declared={"type": "angle"}),
    ],
)
@pytest.mark.parametrize(
    "toml",
    [
        TOML.replace("\n", "\r\n"),
        "\ufeff" + TOML,
        TOML.rstrip("\n"),
        'tables.jog.file = "jog.csv"\nconditions.speed.type = "number" # dotted\nconditions."mood".type = "text"\n',
        'tables = { jog = { file = "jog.csv" } }\nconditions = { speed = { type = "number" } } # inline\n',
        '[tables]\njog = { file = "jog.csv" }\n[conditions]\nspeed = { type = "number", max = 9 }\n\n[project]\n',
        '[tables."jog"]\n  file = \'jog.csv\'\n[conditions."speed"]\n\ttype = """number"""\n# the end',
        "[project]\nname = 'x'",
        "",
    ],
)
def test_whatever_form_the_file_has_it_says_then_what_the_table_says_and_undo_takes_it_back(tmp_path: Path, toml: str, edit):
    table = project(tmp_path, toml)
    after = edit(table).apply(table)
    now = saved(table, after)
    assert schema_to_dict(now.schema) == schema_to_dict(after.schema)
    assert now.settings.policy == after.settings.policy
    ends = raw(tmp_path).count("\n") - raw(tmp_path).count("\r\n")
    assert ends == 0 if "\r" in toml else "\r" not in raw(tmp_path)
    saved(after, table)
    assert raw(tmp_path) == toml


@pytest.mark.parametrize(
    "said",
    [
        'mirror = { Left = "Right" } # sides',
        "mirror.Left = 'Right'",
        'mirror = {Left="Right", "far left" = "far right"}',
        '[conditions.mood.mirror]\nLeft = "Right"',
    ],
)
@pytest.mark.parametrize("mirror", [None, "none", {"Left": "far right"}, {"Left": "Right", "far left": "far right"}])
def test_a_mirror_is_said_anew_in_whatever_form_it_stands(tmp_path: Path, said: str, mirror: object):
    toml = f"[conditions.mood]\ntype = 'text'\n{said}\n\n[conditions.speed]\ntype = 'number' # fast\n"
    table = project(tmp_path, toml)
    after = edits.set_condition(table, "mood", mirror=mirror).apply(table)
    assert schema_to_dict(saved(table, after).schema) == schema_to_dict(after.schema)
    assert raw(tmp_path).endswith("\n[conditions.speed]\ntype = 'number' # fast\n")


def test_a_file_is_made_only_when_there_is_something_to_say(tmp_path: Path):
    table = project(tmp_path / "my game", toml=None)
    assert not write_schema(table, edits.set_cells(table, [(0, "speed", "1")]).apply(table))
    assert not (tmp_path / "my game" / "contextdb.toml").exists()
    after = edits.set_settings(table, policy="first").apply(table)
    assert write_schema(table, after)
    expected = '[project]\nname = "my game"\n\n[tables.jog]\nfile = "jog.csv"\npolicy = "first"\n'
    assert raw(tmp_path / "my game") == expected
    assert not write_schema(table, after)


def test_what_others_wrote_meanwhile_stays(tmp_path: Path):
    table = project(tmp_path)
    after = edits.set_condition(table, "speed", min=0.5).apply(table)
    (tmp_path / "contextdb.toml").write_text(TOML.replace("max = 7.0 ", "max = 9.0 ") + "# bye\n", encoding="utf-8")
    write_schema(table, after)
    assert (
        raw(tmp_path)
        == TOML.replace(
            "max = 7.0                       # nobody runs faster",
            "max = 9.0                       # nobody runs faster\nmin = 0.5",
        )
        + "# bye\n"
    )


def test_a_key_that_both_changed_is_named_and_nothing_is_written(tmp_path: Path):
    table = project(tmp_path)
    after = edits.set_condition(table, "speed", min=0.5, max=8.0).apply(table)
    theirs = TOML.replace("max = 7.0", "max = 9.0")
    (tmp_path / "contextdb.toml").write_text(theirs, encoding="utf-8")
    with pytest.raises(SchemaError, match=r"\[conditions.speed\] max is 9.0 in the file, where somebody else changed it"):
        write_schema(table, after)
    assert raw(tmp_path) == theirs


def test_a_key_that_both_changed_alike_is_no_conflict(tmp_path: Path):
    table = project(tmp_path)
    after = edits.set_condition(table, "speed", max=9).apply(table)
    theirs = TOML.replace("max = 7.0", "max = 9.0")
    (tmp_path / "contextdb.toml").write_text(theirs, encoding="utf-8")
    assert not write_schema(table, after)
    assert raw(tmp_path) == theirs


@pytest.mark.parametrize(
    "theirs",
    [
        b"[tables.jog\n",
        b"\xff\xfe",
        b'[tables.jog]\npolicy = "some"\n',
        b"<<<<<<< ours\n[project]\n=======\n",
        b"x = " + b"[" * 5000,
        b"[tables.jog]\npolicy = 1\npolicy = 2\n",
    ],
)
def test_a_file_that_cannot_be_read_is_told_and_left_as_it_is(tmp_path: Path, theirs: bytes):
    table = project(tmp_path)
    (tmp_path / "contextdb.toml").write_bytes(theirs)
    with pytest.raises(SchemaError) as refused:
        write_schema(table, edits.set_settings(table, policy="first").apply(table))
    assert refused.value.faults[0].place.file == str(tmp_path / "contextdb.toml")
    assert (tmp_path / "contextdb.toml").read_bytes() == theirs


@pytest.mark.skipif(os.name == "nt", reason="modes")
def test_a_file_that_is_marked_read_only_is_told(tmp_path: Path):
    table = project(tmp_path)
    (tmp_path / "contextdb.toml").chmod(0o444)
    with pytest.raises(FileError, match="read-only"):
        write_schema(table, edits.set_settings(table, policy="first").apply(table))
    assert raw(tmp_path) == TOML


def test_a_table_saved_under_another_name_takes_its_settings_and_conditions_with_it(tmp_path: Path):
    table = project(tmp_path / "one")
    (tmp_path / "two").mkdir()
    moved = edits.set_settings(table, priority="Rank").apply(table).save(tmp_path / "two" / "trot.csv")
    assert write_schema(None, moved)
    now = load(tmp_path / "two" / "trot.csv")
    assert now.name == "trot"
    assert now.settings.priority == "Rank"
    assert now.settings.assume == table.settings.assume
    assert now.condition("speed").condition == table.condition("speed").condition
    beside = edits.set_settings(table, priority="Rank").apply(table).save(tmp_path / "one" / "trot.csv")
    assert write_schema(None, beside)
    project_now = Project.load(tmp_path / "one")
    assert project_now["trot"].settings.priority == "Rank"
    assert project_now["jog"].settings == table.settings


def test_a_section_of_that_name_for_another_file_is_not_taken_over(tmp_path: Path):
    table = project(tmp_path, '[tables.jog]\nfile = "low/jog.csv"\n')
    after = edits.set_settings(table, policy="first").apply(table)
    with pytest.raises(SchemaError, match=r"\[tables.jog\] file"):
        write_schema(table, after)


def test_order_and_thresholds_of_a_list_on_many_lines_move_with_their_comments(tmp_path: Path):
    order = """order = [
  # when tired
  { database = "a", threshold = 2.75 },   # first
  { database = "b" }   # else
]
"""
    toml = TOML[: TOML.index("order = ")] + order
    table = project(tmp_path, toml)
    after = set_selector(table, "walk", [("b", 1.0), ("a", None)]).apply(table)
    assert_says_the_same(saved(table, after), after)
    assert raw(tmp_path).endswith("""order = [
  { database = "b", threshold = 1 },   # else
  # when tired
  { database = "a" },   # first
]
""")


def test_a_list_of_tables_becomes_one_list(tmp_path: Path):
    toml = TOML[: TOML.index("order = ")].replace("[selectors.walk]\n", "")
    toml += '[[selectors.walk.order]]\ndatabase = "a"\nthreshold = 1\n[[selectors.walk.order]]\ndatabase = "b"\n'
    table = project(tmp_path, toml)
    after = set_selector(table, "walk", [("b", 1.0), ("a", None)]).apply(table)
    assert_says_the_same(saved(table, after), after)


HOSTILE = """[project]
name = '''
[tables.jog]   # not one
policy = "none"
'''
[ "tables" . 'jog' ]  # "one"
"fi\\u006ce" = "jog.csv"# tight
assume = [ # [a]
  "Slot != ']'", 'Slot != "#"'#"
  , "not wet"
]
[conditions]
speed = {type="number",max = 7, "description"='a = {b}'}
"""


def test_brackets_quotes_and_signs_in_strings_and_comments_mislead_nobody(tmp_path: Path):
    table = project(tmp_path, HOSTILE)
    assert table.settings.assume == ("Slot != ']'", 'Slot != "#"', "not wet")
    after = edits.set_settings(table, policy="first", assume=['Slot != "#"', "Slot != ']'"]).apply(table)
    after = edits.set_condition(after, "speed", max=8, unit="}").apply(after)
    assert_says_the_same(saved(table, after), after)
    assert 'policy = "none"\n\'\'\'\n[ "tables" . \'jog\' ]  # "one"\n' in raw(tmp_path)
    saved(after, table)
    assert_says_the_same(load(tmp_path / "jog.csv"), table)


# ---- any edits, saved and undone at any time


@st.composite
def declaring(draw: st.DrawFn, table: Table) -> Edit:
    """An edit of what is declared; one that does not fit, as where an assumption needs another type, is none."""
    try:
        edit = draw(any_declaring(table))
        edit.apply(table)
    except SchemaError:
        return Edit("none", ())
    return edit


@st.composite
def any_declaring(draw: st.DrawFn, table: Table) -> Edit:
    names = [c.condition.name for c in table.conditions]
    columns = [c.name for c in table.columns if c.name not in table.schema.conditions and c.name != table.asset_column]
    kind = draw(st.sampled_from(["settings", "condition", "blueprint", "selector", "column", "rename"]))
    if kind == "settings":
        said = draw(
            st.fixed_dictionaries(
                {},
                optional={
                    "policy": st.sampled_from(["collect", "first", "unique", "priority", None]),
                    "fallback": st.sampled_from([None, "walk", 'say "no"', "é #[x]", "a\\b", "tab\tend"]),
                    "assume": st.lists(st.sampled_from(["not wet", "1 < 2 < 3", '`new #` == "calm"']), unique=True),
                    "outputs": st.lists(st.sampled_from(columns), unique=True) if columns else st.none(),
                },
            )
        )
        taken = {table.settings.enabled, table.settings.priority, table.settings.weight}
        said["outputs"] = [name for name in said.get("outputs") or [] if name not in taken]
        return edits.set_settings(table, **said)
    if kind == "condition" and names:
        part = draw(
            st.sampled_from(
                [
                    {"type": "number", "min": -1.5, "max": 1e22},
                    {"type": "int", "min": 0, "max": 10**15},
                    {"type": "enum", "values": ["calm", "a b", 'q"q', "#", "]"]},
                    {"type": "tags", "values": ["x"], "unit": "µ", "description": "one\ntwo"},
                    {"type": "text", "expr": '"a" if 1 < 2 else "b # c"', "values": None, "min": None, "max": None},
                    {"description": None, "unit": "m/s"},
                ]
            )
        )
        return edits.set_condition(table, draw(st.sampled_from(names)), **part)
    if kind == "blueprint" and names:
        chosen = draw(st.none() | st.lists(st.sampled_from(names), unique=True))
        return edits.set_blueprint(table, draw(st.sampled_from(["base", "new", "a.b"])), chosen)
    if kind == "selector" and table.schema.databases:
        order = draw(st.permutations(list(table.schema.databases)))[: draw(st.integers(1, 2))]
        thresholds = [draw(st.sampled_from([0.5, 2.75, 1e-7])) for _ in order[:-1]]
        return set_selector(table, draw(st.sampled_from(["walk", "run"])), list(zip(order, [*thresholds, None], strict=True)))
    free = next(f"new.{i}" for i in range(99) if f"new.{i}" not in [c.name for c in table.columns])
    if kind == "rename" and names:
        return edits.rename_column(table, draw(st.sampled_from(names)), free)
    return insert_column(table, 1, free, "condition", draw(st.sampled_from([None, {"type": "angle"}, {"type": "bool"}])))


FORMS = [
    TOML,
    TOML.replace("\n", "\r\n"),
    "\ufeff" + TOML.rstrip(),
    'tables = { jog = { file = "jog.csv" } }\nconditions = { speed = { type = "number" } } # inline\n[features]\n',
    'conditions.speed.type = "number" # dotted\nconditions."mood".type = "text"\n\n# x\n',
    "",
    None,
]


def masked(text: str) -> list[str]:
    """The lines that no edit is about."""
    parts = ("[features", "[databases", "[project", "clips", "features", "rate", "channels", "#", "name")
    return [line for line in text.removeprefix("\ufeff").splitlines() if line.startswith(parts)]


@given(st.data())
@examples(1)
def test_any_edits_saved_and_undone_at_any_time_leave_a_file_that_says_what_the_table_says(tmp_path_factory, data):
    folder, form = tmp_path_factory.mktemp("game"), data.draw(st.sampled_from(FORMS))
    states = [project(folder, form)]
    on_disk = states[0]
    for _ in range(data.draw(st.integers(1, 6))):
        states.append(data.draw(declaring(states[-1])).apply(states[-1]))
        if data.draw(st.booleans()):
            now = saved(on_disk, states[-1])
            on_disk = states[-1]
            assert_says_the_same(now, on_disk if now.settings.file is None or on_disk.settings.file else with_file(on_disk))
    saved(on_disk, states[0])
    now = load(folder / "jog.csv")
    assert_says_the_same(now, states[0])
    if form is not None:
        assert masked(raw(folder)) == masked(form)
        tomllib.loads(raw(folder).removeprefix("\ufeff"))


def with_file(table: Table) -> Table:
    return replace(table, settings=replace(table.settings, file="jog.csv"))


SECTIONS = [
    "",
    "# only a comment",
    "[project]\nname = 'x'\n\n[conditions.a]\ntype = 'int'\n# what follows\n\n"
    "[tables.t]\nfile = 't.csv'\n\n[blueprints.b]\nconditions = []\n",
    "[tables.t]\r\npolicy = 'first'\r\n\r\n[conditions.a] # here\r\ntype = 'int'",
    "conditions.a.type = 'int'\n[tables.t]\n",
    "[conditions]\na = { type = 'int' }\n",
]
NEW = {
    ("conditions", "b"): {"type": "enum", "values": ["x", "y z"]},
    ("conditions", "c.d"): {"type": "number", "min": 0.5},
    ("conditions", "e"): {"type": "text"},
}
BEHIND = [("tables", "t"), ("conditions", "a"), *NEW]


@pytest.mark.parametrize("text", SECTIONS)
@pytest.mark.parametrize("behind", [BEHIND, []], ids=["behind others", "at the end"])
def test_sections_written_in_one_go_stand_where_one_after_the_other_would(text: str, behind: list[tuple[str, str]]):
    one_by_one = text
    for part, keys in NEW.items():
        for key, value in keys.items():
            one_by_one = toml_edit.set_key(one_by_one, (*part, key), value, behind)
    assert toml_edit.add_sections(text, NEW, behind) == one_by_one
    tomllib.loads(one_by_one)


def test_a_section_is_absent_when_nothing_of_it_stands_in_any_form():
    text = "conditions.a.type = 'int'\n[conditions.b]\n[conditions.c.d]\nx = 1\n[other]\ne = { f = { g = 1 } }\n"
    paths = [("conditions", name) for name in "abcd"] + [("other", "e"), ("other", "e", "f"), ("other", "x")]
    assert toml_edit.absent(text, paths) == [("conditions", "d"), ("other", "x")]


def test_the_statements_that_are_looked_at_grow_with_the_new_conditions_and_not_with_their_square(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    walked = 0
    plain = toml_edit._statements

    def counted(text: str) -> Iterator[toml_edit.Statement]:
        nonlocal walked
        for one in plain(text):
            walked += 1
            yield one

    monkeypatch.setattr(toml_edit, "_statements", counted)
    counts = []
    for n in (20, 160):
        walked = 0
        declared = {f"c{i}": {"type": "number", "min": 0.5} for i in range(n)}
        table = Table.from_columns({"A": ["x"], **{name: ["1"] for name in declared}}, declared)
        assert schema_change(None, replace(table, path=tmp_path / "t.csv")) is not None
        counts.append(walked)
    assert counts[1] < 16 * counts[0]


def test_a_key_that_goes_from_a_table_without_rows_goes_from_the_file(tmp_path: Path):
    (tmp_path / "contextdb.toml").write_text('[tables.t]\nfallback = "idle"\npolicy = "first"\n')
    (tmp_path / "t.csv").write_text("Asset,speed\n")
    table = load(tmp_path / "t.csv")
    assert write_schema(table, edits.set_settings(table, fallback=None).apply(table))
    assert (tmp_path / "contextdb.toml").read_text() == '[tables.t]\npolicy = "first"\n'
