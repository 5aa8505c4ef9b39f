"""A hostile file of a few kilobytes costs no more than its size: the work on it grows with its length, not with the square."""

import contextlib
import io
import time
import zipfile
from collections.abc import Callable
from xml.sax.saxutils import escape

import pytest
from strategies import for_each

from contextdb.cells.domains import Domain
from contextdb.cells.grammar import parse_cell
from contextdb.errors import ContextDBError, SchemaError, TableError
from contextdb.exchange import xlsx_scan
from contextdb.exchange.feel import cell_of, strings_of
from contextdb.exchange.formats import FORMATS, ReadOptions, read, write
from contextdb.exchange.grid import MOST_LOOKED_AT, blocks_of
from contextdb.schema.toml_lines import read_toml
from contextdb.tables.table import Table

SMALL, FACTOR = 4_000, 8
MOST_GROWTH = 30
"""Linear work grows by FACTOR, quadratic by its square, 64."""
LEAST_S = 0.002
"""Less than this is lost in what every file costs."""

DEFINITIONS = '<definitions xmlns="https://www.omg.org/spec/DMN/20191111/MODEL/">'


def cost_s(work: Callable[[], object]) -> float:
    """The least CPU time of three tries, whether the work is refused or not."""
    times = []
    for _ in range(3):
        start = time.process_time()
        with contextlib.suppress(ContextDBError):
            work()
        times.append(time.process_time() - start)
    return min(times)


def workbook(sheet: bytes) -> bytes:
    """A workbook of ours with other bytes at the start of its rows."""
    whole, out = io.BytesIO(write(Table.from_columns({"Asset": ["x"], "b": ["1"]}), FORMATS["xlsx"])[0]), io.BytesIO()
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data.replace(b"<sheetData>", b"<sheetData>" + sheet) if name.endswith("sheet1.xml") else data)
    return out.getvalue()


def decision(test: str, allowed: str = "") -> bytes:
    entries = f"<rule><inputEntry><text>{escape(test)}</text></inputEntry><outputEntry><text>1</text></outputEntry></rule>"
    values = f"<inputValues><text>{escape(allowed)}</text></inputValues>"
    table = f'<input><inputExpression typeRef="string"><text>a</text></inputExpression>{values}</input><output name="o"/>{entries}'
    return f"{DEFINITIONS}<decision><decisionTable>{table}</decisionTable></decision></definitions>".encode()


def nested(tag: str, n: int, inside: str = "") -> bytes:
    return "".join([DEFINITIONS, f'<{tag} name="abc">' * n, inside, f"</{tag}>" * n, "</definitions>"]).encode()


TABLE = "<decision><decisionTable><output/></decisionTable></decision>"
FILES: dict[str, Callable[[int], tuple[bytes, str]]] = {
    "tags of cells that never end": lambda n: (workbook(b"<c " * n), "x.xlsx"),
    "a cell of very many attributes": lambda n: (workbook(b"<c" + b' r="A1"' * n), "x.xlsx"),
    "formulas that never end": lambda n: (workbook(b'<c r="A1"><f>' * n), "x.xlsx"),
    "a string that never ends": lambda n: (decision('"' + '\\"' * n), "x.dmn"),
    "allowed values that never end": lambda n: (decision('"a"', '"' + '\\"' * n), "x.dmn"),
    "very many strings": lambda n: (decision('"a",' * (n // 8) + '"a"'), "x.dmn"),
    "negations in each other": lambda n: (decision("not(" * n + '"a"' + ")" * n), "x.dmn"),
    "decisions in each other": lambda n: (nested("decision", n // 4), "x.dmn"),
    "types in each other": lambda n: (nested("itemDefinition", 1, f"{'<itemComponent>' * n}{'</itemComponent>' * n}"), "x.dmn"),
    "marks of conflicts in JSON": lambda n: (b"[\n" + b"=======\n" * n, "x.json"),
    "marks of conflicts in a CSV": lambda n: (b"a,b\n" + b"<<<<<<< a,1\n" * n, "x.csv"),
    "ends of conflicts in a CSV": lambda n: (b"a,b\n" + b">>>>>>> a,1\n" * n, "x.csv"),
    "a number of very many digits": lambda n: (b"a;b\n" + b"1" * min(n, 65_000) + b";2,5\n", "x.csv"),
    "texts of Unreal that never end": lambda n: (b'---,a\nx,"NSLOCTEXT(""' + b'\\""' * min(n, 20_000) + b'"\n', "x.csv"),
}


@pytest.mark.parametrize("name", FILES)
def test_the_work_on_a_hostile_file_grows_with_its_length(name: str):
    small, large = (FILES[name](n) for n in (SMALL, SMALL * FACTOR))
    least = max(cost_s(lambda: read(*small)), LEAST_S)
    assert cost_s(lambda: read(*large)) < MOST_GROWTH * least


TEXTS = {
    "digits": lambda n: "1" * n,
    "numbers": lambda n: "1." * n,
    "pairs": lambda n: "1," * n,
    "exponents": lambda n: "1e" * n,
    "parts": lambda n: "1|" * n,
    "spaces": lambda n: "1" + " " * n + "x",
    "quotes": lambda n: '"' * n,
    "words in quotes": lambda n: '"a' * n,
    "negations": lambda n: "not " * n,
    "tags": lambda n: "+a " * n,
    "penalties": lambda n: "~" * n,
    "dots": lambda n: ".." * n,
}


@for_each(["bool", "number", "angle", "text", "tags"], TEXTS)
def test_the_work_on_a_hostile_cell_grows_with_its_length(kind: str, name: str):
    small, large = (TEXTS[name](n) for n in (SMALL // 4, SMALL * FACTOR // 4))
    least = max(cost_s(lambda: parse_cell(small, Domain(kind))), LEAST_S)
    assert cost_s(lambda: parse_cell(large, Domain(kind))) < MOST_GROWTH * least


@pytest.mark.parametrize(
    "text",
    [".".join("a" * 20_000) + " = 1", f"[{'.'.join('a' * 20_000)}]", "x = {" + " . ".join(['"a"'] * 20_000) + " = 1}"],
    ids=["key", "section", "inline table"],
)
def test_a_key_of_very_many_parts_is_refused_with_its_line(text: str):
    with pytest.raises(SchemaError, match=r"x, line 2: a key has 20,000 parts. Accepted: at most 256") as caught:
        read_toml(f"# {'.' * 300}\n{text}\n", "x")
    assert len(str(caught.value)) < 200


def test_dots_in_strings_comments_and_lists_make_no_key():
    dots = "." * 300
    text = f'a = "{dots}" # {dots}\nb = \'{dots}\'\nc = """\n{dots}\n"""\nd = [{"1.5, " * 300}]\n'
    assert read_toml(text, "x")["a"] == dots


def test_a_line_of_toml_that_cannot_be_read_is_mended_soon():
    work = cost_s(lambda: read_toml(f'[a.{" " * 20_000}x"', "x"))
    assert work < 0.5


def test_attributes_of_a_sheet_are_found_in_one_pass():
    assert xlsx_scan._attributes(' name="a" r:id="b"') == {"name": "a", "r:id": "b"}
    least = max(cost_s(lambda: xlsx_scan._attributes("a" * SMALL)), LEAST_S)
    assert cost_s(lambda: xlsx_scan._attributes("a" * SMALL * FACTOR)) < MOST_GROWTH * least


@pytest.mark.parametrize(("n", "cell"), [(1, 'not "a"'), (8, "not " * 8 + '"a"'), (9, None), (2_000, None), (100_000, None)])
def test_negations_in_each_other_have_a_bound(n: int, cell: str | None):
    assert cell_of("not(" * n + '"a b"' + ")" * n) == (cell and cell.replace('"a"', '"a b"'))


def test_strings_are_found_between_what_is_none():
    assert strings_of('"a", x "b\\"c", "open') == ["a", 'b"c']
    assert strings_of('"a\\') == []


def test_a_decision_in_another_is_one_table():
    reading = read(nested("decision", 3, TABLE), "x.dmn")
    assert reading.names == ["decision"]


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        (b'[{"\\ud800": 1, "a": 2}]', "field 1 of the column names has half a surrogate pair."),
        (b'[{"a": "\\udfff"}]', '"a" has half a surrogate pair.'),
        (b'[{"a": ["x", "\\ud800"]}]', '"a" has half a surrogate pair.'),
        (b'[{"a": %s1%s}]' % (b'{"a":' * 500, b"}" * 500), "objects are nested too deeply."),
    ],
)
def test_json_that_no_table_can_hold_is_refused_in_words(raw: bytes, said: str):
    with pytest.raises(TableError) as caught:
        read(raw, "x.json")
    assert said in str(caught.value)
    str(caught.value).encode()


def test_a_character_of_two_surrogates_is_one_character():
    assert read(b'[{"a": "\\ud83d\\ude00"}]', "x.json").columns[0][0] == "\U0001f600"


def test_a_sheet_of_scattered_cells_is_refused_and_not_compared_pair_by_pair():
    grid = [["x" if row % 2 == column % 2 == 0 else "" for column in range(70)] for row in range(70)]
    with pytest.raises(TableError, match=f"more than {MOST_LOOKED_AT:,} blocks of cells"):
        blocks_of(grid)


def test_merged_areas_over_each_other_are_refused():
    merged = b"</sheetData><mergeCells>%s</mergeCells>" % (b'<mergeCell ref="A1:B2"/>' * 3)
    whole, out = io.BytesIO(workbook(b"")), io.BytesIO()
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b"</sheetData>", merged) if name.endswith("sheet1.xml") else old.read(name))
    with pytest.raises(TableError, match="merged areas overlap"):
        read(out.getvalue(), "x.xlsx", ReadOptions(sheet="table"))


def test_a_small_workbook_with_one_cell_far_off_is_refused():
    with pytest.raises(TableError, match=r"reaches to cell Z99999, 2,599,974 cells in all. Accepted: at most 1,000,\d+, as so few"):
        read(workbook(b'<row r="99999"><c r="Z99999"><v>1</v></c></row>'), "x.xlsx")
