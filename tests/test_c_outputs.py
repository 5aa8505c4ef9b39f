"""The C header reads the outputs of rows, and watches a compiled file that is replaced while the game runs."""

from pathlib import Path

import pytest
from c_compilers import CXX, PROGRAMS, C, built, compiler_for, ran, sanitizers

from contextdb.compiled.c_header import c_header_of
from contextdb.compiled.table import CompiledTable
from contextdb.tables.project import Project

TOML = """
[conditions.speed]
type = "number"

[tables.moves]
fallback = { asset = "idle", outputs = { damage = 7 } }

[tables.moves.outputs]
loud = { type = "bool" }
damage = { type = "int", default = 3 }
blend = { type = "number" }
line = { type = "text" }
mood = { type = "enum", values = ["Calm", "Very Angry"] }
offset = { type = "numbers", size = 2 }
"""
HEADER = "Asset,speed,loud,damage,blend,line,mood,offset\n"
ROWS = ["walk,0..2,True,1,0.25,Größe,Very Angry,1 2.5", "run,2..9,False,,-0.5,,Calm,0 0", "jump,Any,False,-9,1e300,say,Calm,0 -1"]
STRICT = [C, CXX, ["-xc++", "-std=c++20", *CXX[2:]]]


def compiled_moves(folder: Path, rows: list[str], toml: str = TOML) -> CompiledTable:
    folder.mkdir(exist_ok=True)
    (folder / "contextdb.toml").write_text(toml, encoding="utf-8")
    (folder / "moves.csv").write_text(HEADER + "\n".join(rows) + "\n", encoding="utf-8")
    compiled = Project.load(folder)["moves"].compile()
    compiled.save(folder / "moves.safetensors")
    return compiled


@pytest.mark.parametrize("options", STRICT, ids=["C99", "C++11", "C++20"])
def test_outputs_are_read_by_row_and_a_replaced_file_is_swapped_in(tmp_path: Path, options: list[str]):
    compiled = compiled_moves(tmp_path / "one", ROWS)
    compiled_moves(tmp_path / "two", ROWS[:2])
    (tmp_path / "none").write_bytes(b"none")
    (tmp_path / "tables.h").write_text(c_header_of({"moves": compiled}), encoding="ascii")
    program = built(PROGRAMS / "watch.c", tmp_path / "watch.exe", options, *sanitizers(compiler_for(options)))
    files = [tmp_path / "one" / "moves.safetensors", tmp_path / "two" / "moves.safetensors", tmp_path / "none"]
    *told, jump, swapped, refused = ran(program, *files).splitlines()
    values = [compiled.outputs.fallback, *(compiled.outputs.of_row(row) for row in range(3))]
    assert [line.split(" ") for line in told] == [told_of(value) for value in values]
    assert (jump, swapped, refused) == ("jump is row 2", "2 rows after 3", "the file is too short for its header")


def told_of(outputs: dict[str, object]) -> list[str]:
    moods = ["Calm", "Very Angry"]
    mood, offset = outputs["mood"], outputs["offset"]
    number = moods.index(mood) if mood else -1  # type: ignore[arg-type]
    told = [int(bool(outputs["loud"])), outputs["damage"], f"{outputs['blend']:.17g}", outputs["line"], number, mood]
    return " ".join([*map(str, told), *(f"{n:.17g}" for n in offset)]).split(" ")  # type: ignore[attr-defined]


REFUSED = """
#define CDB_FILES
#include "tables.h"
int main(int argc, char **argv)
{
    cdb_fault fault;
    size_t size;
    cdb_moves moves;
    void *bytes = cdb_read_file(argv[argc - 1], &size, &fault);
    if (cdb_moves_open(&moves, bytes, size, &fault) == CDB_OK) cdb_moves_close(&moves);
    printf("%d %s", (int)fault.status, fault.name);
    CDB_FREE(bytes);
    return 0;
}
"""


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("loud = ", "again = ", "4 loud"),
        ('"int", default = 3', '"number", default = 3', "4 damage"),
        ("size = 2", "size = 3", "4 offset"),
        ('"Calm", "Very Angry"', '"Very Angry", "Calm"', "4 mood"),
        ('"Very Angry"]', '"Very Angry", "Glad"]', "0 "),
        ("line = ", 'more = { type = "int" }\nline = ', "0 "),
    ],
    ids=["gone", "type", "size", "order", "a value more", "one more"],
)
def test_outputs_that_the_header_cannot_read_are_refused_by_name(tmp_path: Path, old: str, new: str, found: str):
    header = c_header_of({"moves": compiled_moves(tmp_path / "one", ROWS)})
    rows = (
        [row.replace(",1 2.5", ",1 2.5 3").replace(",0 -1", ",0 -1 2").replace(",0 0", ",0 0 0") for row in ROWS]
        if "size = 3" in new
        else ROWS
    )
    assert TOML.replace(old, new) != TOML
    csv = HEADER.replace("loud", "again") if "again" in new else HEADER
    (tmp_path / "two").mkdir()
    (tmp_path / "two" / "contextdb.toml").write_text(TOML.replace(old, new), encoding="utf-8")
    if "more" in new:
        csv, rows = csv.replace("\n", ",more\n"), [row + ",1" for row in rows]
    (tmp_path / "two" / "moves.csv").write_text(csv + "\n".join(rows) + "\n", encoding="utf-8")
    Project.load(tmp_path / "two")["moves"].compile().save(tmp_path / "two.safetensors")
    (tmp_path / "tables.h").write_text(header, encoding="ascii")
    (tmp_path / "refused.c").write_text(REFUSED, encoding="ascii")
    program = built(tmp_path / "refused.c", tmp_path / "refused.exe", C, *sanitizers(compiler_for(C)))
    assert ran(program, tmp_path / "two.safetensors") == found
