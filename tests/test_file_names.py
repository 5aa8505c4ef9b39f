"""Files whose names differ in Unicode form or capitals alone, and names that Windows keeps for itself."""

import json
import os
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from running import ROOT, run
from strategies import some

from contextdb.files.file_names import alike, composed, confusable, spelled, why_unportable
from contextdb.schema.settings import read_schema
from contextdb.tables.project import Project, load, settings_of, table_files
from tui.model.new_table import name_fault

NAME = "mövès"
FORMS = {form: unicodedata.normalize(form, NAME) for form in ("NFC", "NFD")}
RAW = b"Asset,speed,on\nwalk,0..5,True\n"


def toml(file: str, section: str = "moves") -> str:
    return f'[conditions.speed]\ntype = "angle"\n\n[tables."{section}"]\nfile = "{file}"\nenabled = "on"\n'


def put(folder: Path, disk: str, declared: str | None = None) -> Path:
    """A table whose file has one form, and whose contextdb.toml has another."""
    (folder / f"{disk}.csv").write_bytes(RAW)
    if declared is not None:
        (folder / "contextdb.toml").write_text(toml(f"{declared}.csv"), encoding="utf-8")
    return folder / f"{disk}.csv"


@pytest.fixture
def tells_capitals(tmp_path: Path) -> bool:
    """Whether the disk takes two names that differ in capitals for two files."""
    (tmp_path / "probe").touch()
    found = not (tmp_path / "PROBE").exists()
    (tmp_path / "probe").unlink()
    return found


@pytest.mark.parametrize("declared", FORMS)
@pytest.mark.parametrize("disk", FORMS)
def test_a_declared_table_is_the_file_in_either_unicode_form(tmp_path, monkeypatch, disk, declared):
    file = put(tmp_path, FORMS[disk], FORMS[declared])
    project = Project.load(tmp_path)
    assert list(project.tables) == ["moves"]
    assert load(file).settings.enabled == "on"
    assert load(tmp_path / f"{FORMS[disk]}.csv").condition("speed").condition.domain.kind == "angle"
    monkeypatch.chdir(tmp_path)
    assert run("check", ".").code == 0
    assert run("query", "moves", "speed=1").code == 0


@pytest.mark.parametrize("disk", FORMS)
@pytest.mark.parametrize("asked", FORMS)
def test_an_undeclared_table_has_its_name_in_one_form_and_is_found_by_either(tmp_path, monkeypatch, disk, asked):
    put(tmp_path, FORMS[disk])
    (tmp_path / "contextdb.toml").write_text("", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert list(Project.load(tmp_path).tables) == [NAME]
    assert run("query", FORMS[asked], "speed=1", "on=true").code == 0


@pytest.mark.parametrize("declared", FORMS)
@pytest.mark.parametrize("disk", FORMS)
def test_an_edit_of_the_settings_stays_in_the_section_of_the_file(tmp_path, disk, declared):
    from edit_strategies import write_schema

    from contextdb.edits.edits import set_settings

    table = load(put(tmp_path, FORMS[disk], FORMS[declared]))
    write_schema(table, set_settings(table, policy="first").apply(table))
    text = (tmp_path / "contextdb.toml").read_text(encoding="utf-8")
    assert text == toml(f"{FORMS[declared]}.csv") + 'policy = "first"\n'


def test_two_files_of_one_name_in_two_forms_are_refused(tmp_path):
    for form in FORMS.values():
        put(tmp_path, form)
    if len(list(tmp_path.iterdir())) < 2:
        pytest.skip("this disk has one of them only")
    checked = run("check", tmp_path, "--json")
    assert checked.code == 1
    assert "are one file on disks that ignore the Unicode form of names." in checked.out
    said = run("coverage", tmp_path).err
    assert 'is also defined in "' in said
    assert said.count("o\\u0308v") == 1  # the second of the two alone


def test_two_names_that_look_alike_are_shown_apart(tmp_path, monkeypatch):
    put(tmp_path, "walk", "walk")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walk.csv").write_text(f"Asset,{FORMS['NFC']},on\nwalk,0..5,True\n", encoding="utf-8")
    said = run("query", "walk.csv", f"{FORMS['NFD']}=1", "on=true").err
    assert r'there is no condition "mo\u0308ve\u0300s". Accepted: "mövès"' in said
    assert r'Did you mean "mövès"?' in said


# ---- capitals


def findings(folder: Path) -> list[str]:
    found = json.loads(run("check", folder, "--json").out)["findings"]
    return [one["message"] for one in found if one["rule"] == "unportable-name"]


def test_two_tables_that_differ_in_capitals_alone_are_told(tmp_path, tells_capitals):
    if not tells_capitals:
        pytest.skip("this disk has one of them only")
    for name in ("Walk", "walk"):
        put(tmp_path, name)
    (said,) = findings(tmp_path)
    assert "are one file on disks that ignore case" in said
    assert len(Project.load(tmp_path).tables) == 2


def test_a_table_declared_in_other_capitals_is_the_file_where_the_disk_says_so(tmp_path, tells_capitals, monkeypatch):
    file = put(tmp_path, "walk", "Walk")
    if tells_capitals:  # as a disk that does not would answer
        real = Path.is_file
        monkeypatch.setattr(Path, "is_file", lambda path: real(path) or (path.name == "Walk.csv" and real(file)))
        samefile = os.path.samefile
        monkeypatch.setattr(
            os.path, "samefile", lambda a, b: samefile(*(file if Path(p).name == "Walk.csv" else p for p in (a, b)))
        )
    schema = read_schema(toml("Walk.csv"), "contextdb.toml")
    assert list(table_files(tmp_path, schema)) == [("moves", file)]
    assert settings_of(file, tmp_path, schema).name == "moves"
    assert load(file).settings.enabled == "on"
    assert findings(tmp_path) == ['contextdb.toml calls it "Walk.csv": there is no such file on disks that distinguish case.']


def test_a_table_declared_in_other_capitals_is_another_one_where_the_disk_tells_them(tmp_path, tells_capitals):
    if not tells_capitals:
        pytest.skip("this disk does not")
    put(tmp_path, "walk", "Walk")
    result = run("coverage", tmp_path)
    assert result.code == 2
    assert "walk.csv" in result.err


# ---- names that Windows keeps


SIGNS = ["walk:run", "walk?", "a*b", "a|b", "a<b>", 'a"b"', "a\\b", "a\tb"]
DEVICES = ["con", "CON", "Nul", "aux", "prn", "com1", "COM9", "lpt1", "com¹", "nul.walk", "con "]


@pytest.mark.parametrize("name", [*DEVICES, *some(SIGNS, 3), "walk.", "walk ."])
def test_a_table_is_made_under_no_name_that_windows_keeps(tmp_path, name):
    (tmp_path / "f.csv").write_bytes(RAW)
    result = run("import", tmp_path / "f.csv", tmp_path / f"{name}.csv")
    assert result.code == 2
    assert "Windows" in result.err
    assert name.strip() == name == "con" or name_fault(tmp_path, name, ())
    assert sorted(os.listdir(tmp_path)) == ["f.csv"]


@pytest.mark.parametrize("name", ["moves.notes", "moves.CASES", ".moves"])
def test_a_table_is_made_under_no_name_that_tables_do_not_have(tmp_path, name):
    (tmp_path / "f.csv").write_bytes(RAW)
    result = run("import", tmp_path / "f.csv", tmp_path / f"{name}.csv")
    assert (result.code, "saved contexts or notes" in result.err) == (2, True)
    assert name_fault(tmp_path, name, ())
    assert os.listdir(tmp_path) == ["f.csv"]


@pytest.mark.parametrize("name", ["walk", "console", "com", "com10", "lpt", "null", "a.con", "mövès", "walk run", ".con"])
def test_other_names_are_as_good_as_ever(tmp_path, name):
    assert why_unportable(f"{name}.csv") == ""


@pytest.mark.parametrize("name", SIGNS)
def test_a_name_with_a_sign_that_windows_does_not_have_is_told(name):
    assert "Windows has no " in why_unportable(f"{name}.csv")


def test_a_table_that_is_there_under_such_a_name_is_told(tmp_path):
    if os.name == "nt":
        pytest.skip("Windows has none")
    put(tmp_path, "aux")
    assert findings(tmp_path) == ["Windows keeps the name aux for a device."]


def test_the_editor_makes_no_table_that_is_another_one_but_for_capitals_or_form(tmp_path):
    assert name_fault(tmp_path, "WALK", ["walk"])
    assert name_fault(tmp_path, FORMS["NFD"], [FORMS["NFC"]])
    assert not name_fault(tmp_path, "run", ["walk"])


# ---- the names themselves


@given(st.lists(st.text("aAéÉe\u0301sSß.", max_size=4), max_size=6))
def test_confusable_names_are_those_that_are_alike(names):
    found = list(confusable(names))
    assert all(alike(a) == alike(b) and a != b for a, b in found)
    assert len(set(names)) - len({alike(name) for name in names}) <= len(found)


@given(st.text("aée\u0301E", max_size=4), st.lists(st.text("aée\u0301E", max_size=4), max_size=5))
def test_a_name_is_spelled_as_it_stands_there(wanted, present):
    found = spelled(wanted, present)
    assert (found in present and composed(found) == composed(wanted)) if found is not None else wanted not in present
    assert found == wanted or wanted not in present


in_ascii = pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="files are named in UTF-8 whatever the environment says")
ASCII = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONPATH": str(ROOT)}


def run_in_ascii(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], cwd=folder, env=ASCII, capture_output=True, encoding="utf-8")


@in_ascii
@pytest.mark.parametrize("flags", [(), ("-I",)])
def test_names_are_shown_and_mean_the_same_where_the_environment_has_ascii_alone(tmp_path: Path, flags: tuple[str, ...]):
    (tmp_path / "züge").mkdir()
    (tmp_path / "züge/möve.csv").write_text("Asset,größe\nläuft,0..5\n", encoding="utf-8")
    toml = '[conditions."größe"]\ntype = "number"\nmin = 0\nmax = 10\n[tables."möve"]\npolicy = "first"\n'
    (tmp_path / "züge/contextdb.toml").write_text(toml, encoding="utf-8")
    start = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from contextdb.cli import main; sys.exit(main())"
    done = run_in_ascii(tmp_path, *flags, "-c", start, "query", "züge/möve.csv", "größe=3", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["table"] == "möve"
    missing = run_in_ascii(tmp_path, *flags, "-c", start, "check", "züge/mörve.csv")
    assert missing.stderr.startswith("contextdb: züge/mörve.csv: ")
    assert missing.stderr.endswith('Did you mean "züge/möve.csv"?\n')


@in_ascii
@pytest.mark.parametrize("file", ["züge/trains.csv", "züge.csv"])
def test_a_name_that_the_environment_cannot_write_is_an_error_and_no_traceback(tmp_path: Path, file: str):
    (tmp_path / "contextdb.toml").write_text(f'[tables.trains]\nfile = "{file}"\n', encoding="utf-8")
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_bytes(RAW)
    load = "contextdb.Project.load('.')\nexcept contextdb.ContextDBError as error:\n    sys.exit(ascii(str(error)))"
    done = run_in_ascii(tmp_path, "-c", f"import sys, contextdb\ntry:\n    {load}")
    assert done.returncode == 1
    assert 'files are named in ascii here, which has no "\\xfc". Accepted: an environment in UTF-8.' in done.stderr
    assert done.stderr.endswith("Try to set PYTHONUTF8=1.'\n")
