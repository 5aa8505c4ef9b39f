"""`contextdb motion coverage` on made clips: its formats tell the same numbers, its bars hold, wrong use is refused."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from made_once import make_clip
from motion_project import work_in_copy, write_project
from running import Result, run

import contextdb as cdb
from contextdb.files.reports import sealed, with_marks
from contextdb.motion import write_bvh
from contextdb.motion.made.game import make_joint_clip
from contextdb.motion.measuring.moves import MAPS
from contextdb.report.render_json import as_json

TOML = """
[tables.moves]
policy = "collect"
[conditions.gait]
type = "enum"
values = ["Idle", "Walk", "Run"]
[conditions.speed]
type = "number"
min = 0.0
max = 4.0
unit = "m/s"
[features.loco]
rate = 30.0
mirror = [["Left*", "Right*"]]
channels = [
  { type = "position", bone = "LeftFoot" },
  { type = "velocity", bone = "Hips" },
  { type = "trajectory", what = "position", at = [0.33, 1.0] },
]
[databases.all]
table = "moves"
clips = "clips/*.bvh"
features = "loco"
mirror = true
markup = "clips/marks.csv"
[databases.free]
clips = "clips/jog*.bvh"
features = "loco"
"""
TABLE = """Asset,gait,speed
idle,Idle,0..0.3
walk,Walk,0.3..2
walk_turn_left_45,Walk,0.3..2
jog,Run,1..3
jog_turn_left_60,Run,1..2
swim,Idle,3..4
stand_to_walk,not Idle Walk Run,Any
"""
MARKS = "asset,tag,from,to,value\nidle,Looping,,,\njog,DoNotChoose,0,0.5,\n"
CLIPS = {
    "idle": "idle",
    "walk": "walk",
    "walk_turn_left_45": "walk_turn_left_45",
    "jog": "jog",
    "jog_turn_left_60": "jog_turn_left_60",
    "stand_to_walk": "start_walk",
    "unlisted_<b>": "run",
}


def resealed(document: object) -> str:
    """The text of a report with the digest that belongs to it."""
    return sealed(as_json(with_marks(document)))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project in game/, with its features computed."""
    folder = tmp_path_factory.mktemp("made")
    write_project(folder / "game", TOML, TABLE, MARKS, CLIPS)
    result = run("motion", "coverage", folder / "game", "--json", "-o", folder / "before.json")
    assert result.code == 0, result.err
    return folder


@pytest.fixture(autouse=True)
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a copy of it all."""
    return work_in_copy(made, tmp_path, monkeypatch, 80)


def covered(*arguments: str, code: int = 0) -> Result:
    result = run("motion", "coverage", "game", *arguments)
    assert result.code == code, result.err
    return result


def refused(*arguments: str) -> str:
    result = covered(*arguments, code=2)
    assert result.out == ""
    return result.err


def before() -> dict[str, object]:
    return json.loads(Path("before.json").read_text(encoding="utf-8"))


def drop(*names: str) -> None:
    """Take clips out of the project."""
    for name in names:
        Path("game", "clips", f"{name}.bvh").unlink()


def test_the_json_document_tells_each_table_and_the_databases_without_one():
    document = covered("--json").json
    assert document["format"] == 1
    moves, free = document["tables"]
    assert (moves["table"], moves["databases"], free["table"], free["databases"]) == ("moves", ["all"], None, ["free"])
    assert moves["clips"] == 6
    assert moves["mirrored"]
    assert moves["contexts"]["method"] == "exact"
    assert moves["contexts"]["asked_by"] == {"speed": "speed"}
    assert document["bins"]["turn"]["columns"][4] == {"name": "straight", "from": -15.0, "to": 15.0}
    assert 0.0 < moves["covered"] < 1.0


def test_what_never_plays_is_told():
    moves = before()["tables"][0]
    assert moves["never_valid"] == ["stand_to_walk"]
    assert moves["rows_without_clip"] == ["swim"]
    assert before()["clips_without_row"] == ["unlisted_<b>"]
    assert [each["asset"] for each in moves["dead_frames"]] == ["jog"]
    assert moves["transitions"]["missing"] == [{"from": "walk", "to": "stand", "clip": "walk_to_stand"}]


def test_each_context_has_its_frames_and_its_cells():
    items = before()["tables"][0]["contexts"]["items"]
    walk = next(each for each in items if each["assets"] == ["walk", "walk_turn_left_45"])
    assert walk["mirrored"] == ["walk", "walk_turn_left_45"]
    assert walk["cells"] == {"gait": "Walk", "speed": "0.3..2"}
    assert walk["share"] == pytest.approx(1.7 / 4 / 3)
    left, right = (walk["maps"]["turn"]["frames"][3][column] for column in (2, 6))
    assert left == right > 50


class Squares(HTMLParser):
    """The numbers of the squares of each map of a page, and whatever is no tag of ours."""

    def __init__(self) -> None:
        super().__init__()
        self.maps: list[list[str]] = []
        self.in_square = False
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        names = (dict(attrs).get("class") or "").split()
        if tag == "table" and "motion" in names:
            self.maps.append([])
        self.in_square = tag == "span" and "square" in names and bool(self.maps) and len(attrs) == 2

    def handle_data(self, data: str) -> None:
        if self.in_square:
            self.maps[-1].append(data)
            self.in_square = False


def numbers(texts: list[str]) -> list[int]:
    """The frames of squares that are not empty."""
    return [int(digits) for text in texts if (digits := re.sub(r"[^0-9]", "", text))]


def test_the_page_tells_the_numbers_of_the_json():
    covered("--format", "html", "-o", "page.html")
    text = Path("page.html").read_text(encoding="utf-8")
    maps = before()["tables"][0]["maps"]
    page = Squares()
    page.feed(text.partition("<h3>Contexts that miss")[0])
    (shown,) = page.maps
    flat = [n for row in maps["turn"]["frames"] for n in row]
    assert [n for n in numbers(shown) if n] == [n for n in flat if n]
    assert sum("!" in square for square in shown) == sum(share > 0.0 for row in maps["turn"]["holes"] for share in row)
    assert "Every clip moves straight ahead" in text
    assert {c for row in maps["direction"]["frames"] for c, n in enumerate(row) if n} == {MAPS["direction"].centre}
    page.feed(text)
    assert "b" not in page.tags
    assert "unlisted_&lt;b&gt;" in text
    assert not re.search(r"https?://|src=|@import", text)


def test_the_terminal_tells_the_numbers_of_the_json_in_80_columns():
    result = covered()
    assert max(map(len, result.lines)) <= 80
    tables = before()["tables"]
    text = result.out.split("\n\n")
    for name, of in MAPS.items():
        told = of.caption.capitalize()
        shown = [block for block in text if block.startswith(told)]
        for block, table in zip(shown, tables, strict=True):
            lines = {line.split()[0]: re.findall(r"(\d+)!?(?=\s|$)", line[7:]) for line in block.splitlines()[3:]}
            rows = {row.name: [n for n in table["maps"][name]["frames"][i] if n] for i, row in enumerate(of.rows)}
            assert {row: [int(n) for n in squares if int(n)] for row, squares in lines.items()} == {row: rows[row] for row in lines}
            assert sum(map(sum, rows.values())) == sum(sum(rows[row]) for row in lines) or "Every clip moves" in block
    assert "Capture next" in result.out
    percent = f"{100 * tables[0]['covered']:.1f} %"
    assert result.lines[0] == f"moves: {percent} of the wanted movements have a valid clip"


def test_one_set_of_contexts_is_shown_alone():
    items = before()["tables"][0]["contexts"]["items"]
    shown = covered("--context", items[0]["id"]).out
    assert items[0]["id"] in shown
    assert "1-1.5" in shown
    assert "no contexts" in refused("--context", "nope")
    assert "--context" in refused("--context", items[0]["id"], "--json")


def test_a_bar_that_is_missed_fails_and_one_that_is_kept_does_not():
    assert "FAILED  fail-under" in covered("--fail-under", "99", code=1).out
    assert "passed  fail-under" in covered("--fail-under", "10").out
    assert "is not a percentage" in refused("--fail-under", "x")


def test_against_a_baseline_nothing_is_lost_where_nothing_changed():
    assert "no movement was lost" in covered("--baseline", "before.json").out


def test_a_removed_clip_loses_exactly_its_bins():
    drop("jog_turn_left_60")
    document = covered("--baseline", "before.json", "--json", code=1).json
    moves = document["tables"][0]
    old, new = before()["tables"][0]["maps"], moves["maps"]
    expected = {
        (name, row, column)
        for name, of in MAPS.items()
        for row in range(of.shape[0])
        for column in range(of.shape[1])
        if new[name]["filled"][row][column] < old[name]["filled"][row][column] - 1e-9 and (name == "turn" or column != of.centre)
    }
    assert {(each["map"], each["row"], each["column"]) for each in moves["baseline"]["lost"]} == expected
    assert ("turn", 5, 2) in expected
    assert ("turn", 5, 6) in expected
    assert not document["passed"]


def test_a_table_that_has_no_clips_any_more_fails():
    toml = Path("game", "contextdb.toml")
    toml.write_text(toml.read_text(encoding="utf-8").partition("[databases.free]")[0], encoding="utf-8")
    result = covered("--baseline", "before.json", code=1)
    assert 'the table "free" of the baseline no longer exists' in " ".join(result.out.split())
    accepted = covered("--baseline", "before.json", "--gone", "free")
    assert "as --gone accepts" in " ".join(accepted.out.split())
    assert "accepts nothing" in refused("--baseline", "before.json", "--gone", "fre")


def test_a_table_that_the_baseline_does_not_have_fails_unless_it_is_named():
    document = before()
    Path("before.json").write_text(resealed({**document, "tables": document["tables"][:1]}), encoding="utf-8")
    assert 'the table "free" is not in the baseline' in " ".join(covered("--baseline", "before.json", code=1).out.split())
    covered("--baseline", "before.json", "--new", "free")
    Path("before.json").write_text(resealed({**document, "tables": []}), encoding="utf-8")
    assert "it has no tables" in refused("--baseline", "before.json")


def test_shares_of_other_contexts_are_not_compared_unless_that_is_accepted():
    toml = Path("game", "contextdb.toml")
    text = toml.read_text(encoding="utf-8").replace('policy = "collect"', 'policy = "collect"\nassume = ["speed < 2"]')
    toml.write_text(text, encoding="utf-8")
    result = covered("--baseline", "before.json", "--json", code=1)
    (gate,) = result.json["tables"][0]["gates"]
    assert (gate["name"], 'assume now has "speed < 2"' in gate["message"]) == ("redefined", True)
    covered("--baseline", "before.json", "--redefined", "moves")
    assert "wanted by" in covered("--baseline", "before.json", "--axis", "turn=speed", code=1).out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "cannot be read"),
        ("[]", "neither the writer nor the digest"),
        (resealed({"format": 2}), 'no "format": 1'),
        (resealed({"format": 1, "bins": {}, "tables": []}), "its bins are others"),
        (resealed({"format": 1}), "is missing"),
        ("\udcff", "cannot be read"),
    ],
)
def test_a_file_that_is_no_report_is_refused(text: str, said: str):
    Path("bad.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    error = refused("--baseline", "bad.json")
    assert said in error or "is not text" in error
    assert "bad.json" in error


def test_shares_of_a_baseline_that_are_none_are_refused():
    document = before()
    document["tables"][0]["maps"]["turn"]["filled"][0][0] = 7
    Path("bad.json").write_text(json.dumps(document), encoding="utf-8")
    assert "its contents do not match its digest" in refused("--baseline", "bad.json")
    Path("bad.json").write_text(resealed(document), encoding="utf-8")
    assert "no shares from 0 to 1" in refused("--baseline", "bad.json")


def test_an_axis_is_a_condition_of_numbers():
    document = covered("--axis", "turn=speed", "--json").json
    assert document["tables"][0]["contexts"]["asked_by"] == {"speed": "speed", "turn": "speed"}
    assert 'no table with clips has a condition "gait" of numbers' in refused("--axis", "speed=gait")
    assert "names no condition" in refused("--axis", "speed")
    assert 'nothing is measured that is called "sped"' in refused("--axis", "sped=speed")


def test_the_project_says_how_transitions_are_named_unless_the_command_does():
    toml = Path("game", "contextdb.toml")
    toml.write_text('[project]\ntransitions = "{from}_turn_{to}"\n' + toml.read_text(encoding="utf-8"), encoding="utf-8")
    told = [covered(*more, "--json").json["tables"][0]["transitions"] for more in ((), ("--transitions", "{from}_to_{to}"))]
    assert [each["pattern"] for each in told] == ["{from}_turn_{to}", "{from}_to_{to}"]
    assert told[0]["present"] == [["jog", "left_60"], ["walk", "left_45"]]


def test_other_names_of_transitions_and_other_costs_can_be_given():
    assert covered("--transitions", "{from}_turn_{to}", "--json").json["tables"][0]["transitions"]["states"]
    assert "not a pattern of transitions" in refused("--transitions", "x")
    assert len(covered("--near", "5", "--json").json["tables"][0]["near"]) == 6
    assert "is not a cost" in refused("--near", "-1")


def test_junit_has_a_case_for_each_bar_and_markdown_the_maps():
    suites = ET.fromstring(covered("--fail-under", "99", "--format", "junit", code=1).out)
    assert suites.get("failures") == "2"
    assert [suite.get("name") for suite in suites] == ["moves", "free"]
    markdown = covered("--format", "markdown").out
    assert "```text" in markdown
    assert "Capture next" in markdown


def test_a_folder_without_databases_is_refused():
    toml = Path("game", "contextdb.toml")
    toml.write_text(toml.read_text(encoding="utf-8").partition("[databases.all]")[0], encoding="utf-8")
    assert "no motion database is declared" in refused()


def test_where_no_context_has_a_valid_clip_nothing_is_covered():
    Path("game", "moves.csv").write_text("Asset,gait,speed\nswim,Any,Any\n", encoding="utf-8")
    result = covered("--json", "--fail-under", "1", code=1)
    assert next((table["table"], table["covered"]) for table in result.json["tables"]) == ("moves", 0.0)


def test_python_gives_what_the_command_prints():
    found = cdb.motion_coverage(cdb.Project.load("game"))
    assert [each.to_json() for each in found.tables] == [
        {key: value for key, value in table.items() if key not in ("space", "baseline", "gates")} for table in before()["tables"]
    ]
    assert found.unlisted == ("unlisted_<b>",)


def test_joint_clips_are_left_out_and_told(tmp_path: Path):
    (tmp_path / "clips").mkdir()
    for role, clip in make_joint_clip("greet_walk").items():
        write_bvh(clip, tmp_path / "clips" / f"greet_walk.{role}.bvh")
    (tmp_path / "greetings.csv").write_text("Asset\ngreet_walk\n")
    joint = '[databases.greetings]\nroles = ["Host", "Guest"]\ntable = "greetings"\nclips = "clips/greet*.bvh"\nfeatures = "loco"\n'
    loco = TOML[TOML.index("[features") : TOML.index("[databases")]
    (tmp_path / "contextdb.toml").write_text(loco + joint)
    result = run("motion", "coverage", tmp_path)
    assert result.code == 2
    assert "all databases hold joint clips, which follow no stick." in result.err
    write_bvh(make_clip("jog").clip, tmp_path / "clips" / "jog.bvh")
    free = TOML[TOML.index("[databases.free") :]
    (tmp_path / "contextdb.toml").write_text(loco + joint + free)
    result = run("motion", "coverage", tmp_path)
    assert result.code == 0
    assert 'contextdb: left out: the joint clips of "greetings": they follow no stick.' in result.err
    assert "greet" not in result.out
