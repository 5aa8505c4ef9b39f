"""JSON documents and JSON lines, of ours and of others, as rows."""

import json

import pytest

from contextdb.errors import TableError
from contextdb.exchange.formats import FORMATS, ReadOptions, read, write
from contextdb.exchange.reading import Reading
from contextdb.tables.table import Table


def texts(reading: Reading) -> dict[str, list[str]]:
    return {column.name: column.to_list() for column in reading.columns}


def refused(text: str, name: str = "x.json") -> str:
    with pytest.raises(TableError) as caught:
        read(text.encode(), name)
    return str(caught.value)


def test_values_of_json_become_cells():
    rows = [{"Asset": "jog", "on": True, "speed": 2.5, "n": 5, "pos": ["CB", "Half Back"], "none": None}]
    expected = {"Asset": ["jog"], "on": ["True"], "speed": ["2.5"], "n": ["5"], "pos": ['CB "Half Back"'], "none": [""]}
    assert texts(read(json.dumps(rows).encode(), "x.json")) == expected


def test_lines_documents_and_a_named_list_are_told_apart_whatever_the_suffix():
    rows = [{"a": "x"}, {"a": "y"}]
    lines = "\n".join(map(json.dumps, rows))
    for text in (json.dumps(rows), lines, lines + "\n\n", json.dumps({"rows": rows}), json.dumps({"rows": rows}, indent=1)):
        assert texts(read(text.encode(), "x.json")) == {"a": ["x", "y"]}
        assert texts(read(text.encode(), "x.jsonl")) == {"a": ["x", "y"]}


def test_keys_that_rows_leave_out_are_empty_and_told():
    reading = read(b'[{"a": "x", "b": "1"}, {"c": "2", "a": "y"}]', "x.json")
    assert texts(reading) == {"a": ["x", "y"], "b": ["1", ""], "c": ["", "2"]}
    assert 'some rows have no "b", "c"; those cells are empty.' in str(reading.remarks[0])


def test_an_object_in_an_object_becomes_columns_of_a_role():
    assert texts(read(b'[{"a": "x", "Defender": {"pos": "CB", "at": {"y": 1}}}]', "x.json")) == {
        "a": ["x"],
        "Defender.pos": ["CB"],
        "Defender.at.y": ["1"],
    }


CELLS = {"Asset": ["jog", "run"], "speed": ["1.5", "2"], "on": ["True", "False"]}
BY_COLUMNS = {"Asset": {"0": "jog", "3": "run"}, "speed": {"0": 1.5, "3": 2}, "on": {"0": True, "3": False}}
BY_ROWS = {str(at): {name: column[at] for name, column in BY_COLUMNS.items()} for at in "03"}
SPLIT = {"columns": [*CELLS], "index": [0, 3], "data": [[*row.values()] for row in BY_ROWS.values()]}
LISTS = {name: [*column.values()] for name, column in BY_COLUMNS.items()}


@pytest.mark.parametrize("document", [BY_COLUMNS, BY_ROWS, SPLIT, LISTS])
@pytest.mark.parametrize("indent", [None, 1])
def test_a_document_in_another_orientation_is_the_same_table(document: object, indent: int | None):
    assert texts(read(json.dumps(document, indent=indent).encode(), "x.json")) == CELLS


@pytest.mark.parametrize("has_list", [True, False])
def test_a_data_table_as_fmodel_exports_it_is_its_rows(has_list: bool):
    rows = {"jog": {"Speed": 1.5, "At": {"X": 1}}, "run": {"Speed": 2.0, "At": {"X": 3}}}
    one = {"Type": "DataTable", "Name": "DT_Moves", "Properties": {"RowStruct": {"ObjectName": "S"}}, "Rows": rows}
    raw = json.dumps([one] if has_list else one).encode()
    assert texts(read(raw, "x.json")) == {"Name": ["jog", "run"], "Speed": ["1.5", "2"], "At.X": ["1", "3"]}
    assert texts(read(raw, "x.json", ReadOptions("unreal-json")))["Asset Name"] == ["jog", "run"]


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ({"jog": {"speed": 1}, "run": {"speed": 2}}, "an object of objects, which may be its rows or its columns"),
        ({"speed": {"0": 1, "1": 2}, "on": {"0": True}}, "an object of objects, which may be its rows or its columns"),
        ({"Asset": ["jog", "run"], "speed": [1]}, 'the document is lists of several lengths: "Asset" 2, "speed" 1.'),
        ({"columns": ["a", "b"], "data": [[1]]}, '"columns" and "data" do not fit together'),
        ({"Rows": {"jog": {"Name": "x"}}}, 'rows of the DataTable have a "Name" beside their names'),
    ],
)
def test_a_document_that_may_be_several_tables_is_refused_with_what_is_accepted(document: object, said: str):
    told = refused(json.dumps(document))
    assert said in told
    assert "Accepted: a list of objects, one for each row." in told
    assert 'orient="records"' in told or said.startswith(("rows", "the document is lists"))


def test_a_key_that_appears_twice_is_refused_in_every_orientation():
    assert 'the key "0" appears twice' in refused('{"a": {"0": 1, "0": 2}}')
    assert 'the key "a" appears twice' in refused('{"a": [1], "a": [2]}')


def test_nan_is_empty_and_infinity_is_a_number():
    assert texts(read(b'[{"a": "x", "b": NaN, "c": -Infinity}]', "x.json")) == {"a": ["x"], "b": [""], "c": ["-inf"]}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty"),
        ("[1, 2]", "row 1 is a number, no object."),
        ('[{"a": 1},\n {"a": }]', "line 2: this is not JSON: Expecting value at character 8."),
        ('{"a": 1}\n{"a": \n', "line 2: this is not JSON"),
        ('[{"a": 1, "a": 2}]', 'the key "a" appears twice in one object'),
        ('[{"a": {"b": 1}, "a.b": 2}]', 'the key "a.b" appears twice in one row'),
        ('[{"a": [[1]]}]', '"a" holds a list with lists or objects in it'),
        ("[" * 100_000, "too deep"),
        ('"text"', "the document is text without one list of rows"),
        ("[]", "there is no row"),
        ('[{"": 1}]', "column names is empty"),
    ],
)
def test_what_is_no_list_of_rows_is_refused_in_words(text: str, said: str):
    assert said in refused(text)


def test_every_cell_is_written_as_text_and_an_empty_table_says_what_is_lost():
    table = Table.from_columns({"Asset": ["jog"], "speed": ["5"]})
    assert json.loads(write(table, FORMATS["json"])[0]) == [{"Asset": "jog", "speed": "5"}]
    raw, remarks = write(table.with_rows_taken([]), FORMATS["json"])
    assert (json.loads(raw), remarks[0].is_loss) == ([], True)


def test_an_unreal_table_keeps_structs_as_text_and_says_so():
    raw = b'---,speed,tags,where\njog,"5","(""A"",""B"")","(X=1,Y=2)"\n'
    reading = read(raw, "x.csv")
    assert texts(reading) == {"Asset Name": ["jog"], "speed": ["5"], "tags": ["A B"], "where": ["(X=1,Y=2)"]}
    assert 'column "where": "(X=1,Y=2)" is a struct; it is kept as text.' in "\n".join(map(str, reading.remarks))
    rows = [{"Name": "jog", "speed": 5, "on": True}]
    assert texts(read(json.dumps(rows).encode(), "x.json", ReadOptions("unreal-json")))["on"] == ["True"]


def test_tags_of_unreal_are_names_in_json_and_in_structs():
    tags = [{"TagName": "Tool.Pan"}, {"TagName": "Tool.Lid"}]
    rows = [{"Name": "cut", "on": {"GameplayTags": tags}}, {"Name": "chop", "on": {"GameplayTags": []}}]
    for form in ("json", "unreal-json"):
        reading = read(json.dumps(rows).encode(), "x.json", ReadOptions(form))
        assert texts(reading)["on.GameplayTags"] == ["Tool.Pan Tool.Lid", ""]
    structs = [
        '(GameplayTags=((TagName="Tool.Pan"),(TagName="Tool.Lid")))',
        '(TagName="Tool.Pan")',
        "(GameplayTags=())",
        "(GameplayTags=)",
    ]
    rows = [{"Name": f"r{at}", "on": text} for at, text in enumerate(structs)]
    reading = read(json.dumps(rows).encode(), "x.json", ReadOptions("unreal-json"))
    assert texts(reading)["on"] == ["Tool.Pan Tool.Lid", "Tool.Pan", "", ""]
    assert reading.sets["on"].all()
    assert not any("struct" in str(remark) for remark in reading.remarks)


def test_unreal_wants_each_asset_once():
    table = Table.from_columns({"Asset": ["jog", "jog"], "speed": ["5", "6"]})
    with pytest.raises(TableError, match='row 2, column "Asset": the asset "jog" is also in row 1'):
        write(table, FORMATS["unreal-csv"])


def test_names_that_unreal_does_not_take_are_changed_and_told():
    table = Table.from_columns({"Asset": ["jog"], "Defender.pos 2": ["A"]})
    raw, remarks = write(table, FORMATS["unreal-json"])
    assert json.loads(raw) == [{"Name": "jog", "Defender__pos_2": "A"}]
    assert 'is called "Defender__pos_2" in Unreal.' in str(remarks[0])
