"""What the sheet says is what the game does: marks, F12, saved contexts and `contextdb query` agree, row by row."""

import json
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from nested_tables import flat_rows
from running import run
from terminal import press, screen_text, with_editor
from warm_start import python

import contextdb as cdb
from contextdb.checks.cases import exactly, read_expected
from tui.model.context_list import ContextList
from tui.model.sheet import Sheet
from tui.model.why import why_row
from tui.model.window import Window

TOML = """
[conditions.speed]
type = "number"
min = 0.0
max = 9.0
[conditions.target]
type = "number"
min = 0.0
max = 9.0
[conditions.closing]
type = "number"
expr = "speed - target"
[conditions.fast]
type = "bool"
expr = "closing > 1 and not hurt"
[conditions.hurt]
type = "bool"
[conditions.gait]
type = "enum"
values = ["Walk", "Run"]
weight = 2.5
[conditions."Defender.near"]
type = "bool"
[conditions."Defender.gap"]
type = "number"
expr = "target * 2"
"""
CELLS = {
    "speed": ["Any", "0..4", "3..8", "2", "0..4 ~2", "3..8 ~1"],
    "closing": ["Any", ">1", "..0", "not 0..3", ">1 ~1.5"],
    "fast": ["Any", "True", "False", "True ~2"],
    "gait": ["Any", "Walk", "not Walk"],
    "Defender.near": ["Any", "True", "False"],
    "Defender.gap": ["Any", ">3"],
}
RULES = ["", "", "target > 1", "fast", "hurt or gait == 'Run'", "closing < speed", "not `Defender.near`", "1 / target > 0.3"]
FACTS = {
    "speed": ["", "0", "3", "7", "2..4", "3..8"],
    "target": ["", "0", "1", "5", "0..2"],
    "hurt": ["", "True", "False", "not True"],
    "gait": ["", "Walk", "Run", "Walk Run"],
    "Defender.near": ["", "True", "False"],
}
JOBS = {
    **{"enabled": ["True", "True", "False"], "priority": ["0", "1", "5"], "weight": ["1", "3", "0"]},
    **{"once": ["True", ""], "cooldown_s": ["2.5", "0"], "cooldown_turns": ["1", ""]},
}
POLICIES = ["collect", "first", "unique", "priority", "specific", "specific", "cheapest", "cheapest"]


@dataclass(frozen=True)
class Folder:
    """The files of a project, and a question to its outer table."""

    files: Mapping[str, str]
    facts: Mapping[str, str]
    actors: Sequence[Mapping[str, object]]

    def write(self, folder: Path) -> None:
        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8", newline="")

    @property
    def arguments(self) -> list[str]:
        """The question as `contextdb query` takes it."""
        given = [f"{name}={text}" for name, text in self.facts.items() if text]
        told = [f"Defender[{i}].{name}={value}" for i, actor in enumerate(self.actors) for name, value in actor.items()]
        return [*given, *told, "--unknown", "any"]


@st.composite
def folders(draw: st.DrawFn) -> Folder:
    """A table, and one that may stand in it, with derived facts, rules, roles, policies, priorities and weights."""
    toml, files = TOML, {}
    has_inner = draw(st.booleans())
    for name in ("inner", "outer"):
        n_rows = draw(st.integers(1, 4))
        inside = ["@inner"] if name == "outer" and has_inner else []
        columns = {"Asset": [draw(st.sampled_from([f"{name}_{row}", f"{name}_{row}", *inside])) for row in range(n_rows)]}
        settings = [f'policy = "{draw(st.sampled_from(POLICIES))}"', 'asset = "Asset"']
        for condition in draw(st.lists(st.sampled_from(sorted(CELLS)), max_size=3, unique=True)):
            columns[condition] = [draw(st.sampled_from(CELLS[condition])) for _ in range(n_rows)]
        for job, texts in JOBS.items():
            if draw(st.booleans()):
                settings.append(f'{job} = "{job.title()}"')
                columns[job.title()] = [draw(st.sampled_from(texts)) for _ in range(n_rows)]
        if draw(st.booleans()):
            settings.append('when = "Rule"')
            columns["Rule"] = [draw(st.sampled_from(RULES)) for _ in range(n_rows)]
        lines = [list(columns), *zip(*columns.values(), strict=True)]
        files[f"{name}.csv"] = "".join(",".join(f'"{text}"' for text in line) + "\n" for line in lines)
        toml += "\n".join([f"[tables.{name}]", *settings, ""])
    facts = {name: draw(st.sampled_from(texts)) for name, texts in FACTS.items()}
    actors = draw(st.just(()) | st.lists(st.booleans().map(lambda near: {"near": near}), min_size=1, max_size=2))
    return Folder({"contextdb.toml": toml, **files}, {} if not any(facts.values()) else facts, actors)


def marks_of(sheet: Sheet) -> str:
    """The marks beside the rows, as the grid paints them."""
    window = Window(sheet, 0, max(len(sheet.view), 1))
    return "".join(row.mark for row in window.rows)


def expected_marks(table: cdb.Table, answer: Sequence[Mapping[str, object]]) -> str:
    """The marks that the JSON answer of `contextdb query` calls for."""
    by_row = {int(str(m["row"])): m for m in answer}
    found = ""
    for row, own in enumerate(flat_rows(table, table.flat())):
        valid = [by_row[r] for r in own.tolist() if r in by_row]
        is_picked = any(float(str(m.get("chance", 1.0))) > 0.0 for m in valid)
        is_decided = any(not m.get("undecided") for m in valid)
        no_mark = " " if table.enabled[row] else "–"
        found += no_mark if not valid else "◐" if not is_decided else "◉" if is_picked else "●"
    return found


def agrees(project: Folder, folder: Path, ask=run) -> None:
    """Hold the sheet of the outer table against what the command prints."""
    table = cdb.load(folder / "outer.csv", strict=False)
    sheet = Sheet(table)
    sheet.query.load(project.facts)
    asked = {name for name, text in project.facts.items() if text and name in sheet.query.wanted.given}
    has_role = any(name.startswith("Defender.") for name in sheet.query.wanted.given)
    actors = project.actors if has_role else ()
    question = Folder(project.files, {n: t for n, t in project.facts.items() if n in asked}, actors)
    if actors:
        sheet.query.offer({"Defender": list(actors)})
        question = Folder(project.files, {n: t for n, t in question.facts.items() if not n.startswith("Defender.")}, actors)
    if sheet.query.is_empty:
        assert marks_of(sheet).strip(" –") == ""
        return
    result = ask("query", str(folder / "outer.csv"), *question.arguments, "--json")
    assert result.code in (0, 1), result.err
    answer = json.loads(result.out)["matches"]

    assert marks_of(sheet) == expected_marks(table, answer)
    assert set(sheet.query.wanted.given) == set(table.compile().asked)
    own = flat_rows(table, table.flat())
    for row in range(table.n_rows):
        why, by_row = why_row(sheet.query, table, row), {m["row"]: m for m in answer}
        valid = [by_row[r] for r in own[row].tolist() if r in by_row]
        assert why.is_valid == bool(valid)
        assert bool(why.doubt) == (bool(valid) and all(m.get("undecided") for m in valid))
        told = [m["not_picked"] for m in valid if "not_picked" in m]
        if valid and len(told) == len(valid):
            assert why.standing in told
        elif valid:
            chance = sum(float(m.get("chance", 1.0 / len(answer))) for m in valid)
            assert why.standing == "picked" if chance > 1.0 - 1e-9 else why.standing.startswith("picked, chance")
        fails = sheet.query.failing(np.array([row]))[0].any() or sheet.query.excluded_by_rule([row])[0]
        assert not (valid and fails)
    if not actors:
        assets = [m["asset"] for m in answer]
        kept = exactly(ContextList.empty(table).valid_assets(sheet.query.texts))
        assert read_expected(kept) == read_expected(exactly(assets))


@given(folders())
def test_the_sheet_says_what_query_prints_row_by_row(project):
    with tempfile.TemporaryDirectory() as name:
        project.write(Path(name))
        agrees(project, Path(name))


SAMPLE = Folder(
    {
        "contextdb.toml": TOML + '[tables.outer]\npolicy = "priority"\npriority = "P"\nwhen = "Rule"\n'
        '[tables.inner]\npolicy = "first"\n',
        "outer.csv": "Asset,closing,Rule,P\nA,>1,,1\nB,<2,,5\n@inner,Any,hurt,0\nD,Any,,5\n",
        "inner.csv": "Asset,gait\nwalk,Walk\nrun,Run\n",
    },
    {"speed": "3", "target": "0.5"},
    (),
)


def in_a_process(*arguments: str):
    """The command as the shell runs it."""
    done = subprocess.run(python("-m", "contextdb", *arguments), capture_output=True, text=True, encoding="utf-8")
    done.code, done.out, done.err = done.returncode, done.stdout, done.stderr
    return done


@pytest.mark.parametrize("facts", [{"speed": "3", "target": "0.5"}, {"speed": "0..9", "hurt": "True", "gait": "Run"}])
def test_the_sheet_says_what_the_command_prints_in_the_shell(tmp_path, facts):
    project = Folder(SAMPLE.files, facts, ())
    project.write(tmp_path)
    agrees(project, tmp_path, in_a_process)


def marks_on(screen: str) -> list[str]:
    """The marks in the gutter of a screen."""
    return [line[2:4].strip() for line in screen.splitlines() if line[:1].isdigit()]


def test_the_screen_marks_what_is_picked_outranked_undecided_and_excluded_by_a_computed_fact(tmp_path):
    SAMPLE.write(tmp_path)

    async def script(app, pilot):
        app.main.session.sheet.query.load(SAMPLE.facts)
        app.main.show()
        first = screen_text(app)
        await press(pilot, "shift+f12")
        why = screen_text(app)
        await press(pilot, "escape", "down", "shift+f12", "tab")
        return first, why, screen_text(app)

    first, why, second = with_editor(tmp_path / "outer.csv", script, (140, 24))
    assert marks_on(first) == ["●", "×1", "◐", "◉"]
    assert "=2.5" in first
    assert "● Row 1, A: valid; outranked by D (priority 5)" in why
    assert "closing is 2.5" in second or "2.5" in second


def test_a_computed_fact_that_lacks_a_fact_says_which(tmp_path):
    SAMPLE.write(tmp_path)
    sheet = Sheet(cdb.load(tmp_path / "outer.csv"))
    sheet.query.load({"speed": "3"})
    [cell] = [cell for cell in why_row(sheet.query, sheet.table, 0).cells if cell.column == "closing"]
    assert (cell.state, cell.fact) == ("not given", 'needs "target"')


def test_a_saved_context_keeps_the_facts_of_rules_and_what_query_says(tmp_path):
    SAMPLE.write(tmp_path)
    table = cdb.load(tmp_path / "outer.csv")
    facts = {"speed": "3", "target": "0.5", "hurt": "True", "gait": "Run", "closing": "9"}
    contexts = ContextList.beside(table)
    assert exactly(contexts.valid_assets(facts)) == "A outer/inner/run D"
    contexts.keep("one", facts, exactly(contexts.valid_assets(facts)))
    assert contexts.verdict(0).holds
    assert contexts.facts(0) == {name: text for name, text in facts.items() if name != "closing"}


def test_a_table_whose_inner_table_cannot_be_used_cannot_tell_what_is_valid(tmp_path):
    SAMPLE.write(tmp_path)
    (tmp_path / "inner.csv").write_text("Asset,gait\nwalk,Crawl\n")
    contexts = ContextList.beside(cdb.load(tmp_path / "outer.csv", strict=False))
    with pytest.raises(cdb.ContextDBError):
        contexts.valid_assets({"speed": "3"})
