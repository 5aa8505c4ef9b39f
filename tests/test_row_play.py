"""Outputs with a reserved name say how a row plays: read from cells, out of a compiled file, and in C."""

import math
from pathlib import Path

import numpy as np
import pytest
from c_compilers import C, built, compiler_for, ran, sanitizers

import contextdb as cdb
from contextdb.cells.outputs import Output
from contextdb.cells.row_play import ACCEPTED, N_PLAY, RowPlay
from contextdb.compiled.c_header import c_header_of
from contextdb.errors import CellError, SchemaError
from contextdb.schema.settings import read_schema

NAMES = list(ACCEPTED)
ROWS = [
    (",".join(["a", "0..5", "0.3", "1", "0.9..1.1", "As asked", "yes", "mixed", "natural"]), [0.3, 1, 0.9, 1.1, 0, 1, 2, 0]),
    (",".join(["b", "Any", "", "", "1.2", "always", "no", "path", "any"]), [math.nan, math.nan, 1.2, 1.2, 1, 0, 3, 1]),
    (",".join(["c", "1", "0", "", "", "", "", "", ""]), [0.0] + [math.nan] * 7),
]


def compiled_moves(folder: Path, outputs: str = str(NAMES)) -> cdb.CompiledTable:
    toml = f'[conditions.speed]\ntype = "number"\n[tables.moves]\noutputs = {outputs}\n'
    (folder / "contextdb.toml").write_text(toml, encoding="utf-8")
    text = "\n".join([",".join(["Asset", "speed", *NAMES]), *(row for row, _ in ROWS), ""])
    (folder / "moves.csv").write_text(text, encoding="utf-8")
    return cdb.Project.load(folder)["moves"].compile()


def test_what_cells_say_is_known_by_row_and_last_without_a_row(tmp_path: Path):
    compiled = compiled_moves(tmp_path)
    assert compiled.outputs.plays is not None
    np.testing.assert_array_equal(compiled.outputs.plays, [*(numbers for _, numbers in ROWS), [math.nan] * N_PLAY])
    compiled.save(tmp_path / "moves.safetensors")
    opened = cdb.CompiledTable.open(tmp_path / "moves.safetensors")
    np.testing.assert_array_equal(opened.outputs.plays, compiled.outputs.plays)
    assert compiled.query({"speed": 1}).outputs("mirror").tolist() == ["As asked", "always", ""]


def test_typed_outputs_say_the_same_as_texts(tmp_path: Path):
    typed = '{blend_s = {type = "number", default = 0.5}, loop = {type = "bool", default = true}, start_s = {type = "text"}'
    typed += ', play_rate = {type = "text"}, mirror = {type = "text"}, root = {type = "text"}, until = {type = "text"}}'
    plays = compiled_moves(tmp_path, typed).outputs.plays
    assert plays is not None
    assert plays[:, 0].tolist() == [0.3, 0.5, 0.0, 0.5]
    assert plays[:, 5].tolist() == [1.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize("numbers", [numbers for _, numbers in ROWS])
def test_numbers_and_names_say_the_same(numbers: list[float]):
    play = RowPlay.of(numbers)
    assert play is not None
    np.testing.assert_array_equal(play.numbers, numbers)
    assert RowPlay.of([math.nan] * N_PLAY) is None


@pytest.mark.parametrize(
    ("name", "text", "mend"),
    [("blend_s", "-1", ""), ("play_rate", "2..1", ""), ("mirror", "alway", "always"), ("root", "codee", "code"),
     ("until", "end", ""), ("loop", "maybe", ""), ("start_s", "nan", ""), ("play_rate", "0", ""), ("play_rate", "1..", "")],
)  # fmt: skip
def test_what_cannot_be_read_says_what_is_accepted(name: str, text: str, mend: str):
    with pytest.raises(CellError) as caught:
        Output(name).read(text)
    assert caught.value.faults[0].accepted == ACCEPTED[name]
    assert caught.value.faults[0].rule == "unreadable-output"
    assert mend in caught.value.faults[0].mend


def test_a_reserved_output_of_a_type_that_cannot_say_it_is_refused():
    with pytest.raises(SchemaError, match='output "root" says how a row plays, and is of type "number"'):
        read_schema('[tables.moves.outputs]\nroot = {type = "number"}\n', "contextdb.toml")


PROGRAM = """
#define CDB_FILES
#include "tables.h"
int main(int argc, char **argv)
{
    cdb_fault fault;
    size_t size;
    cdb_moves moves;
    int row;
    void *bytes = cdb_read_file(argv[argc - 1], &size, &fault);
    if (cdb_moves_open(&moves, bytes, size, &fault) != CDB_OK) return printf("%s %s", fault.reason, fault.name), 1;
    for (row = -1; row < 3; row++) {
        const cdb_row_play *play = cdb_play_of(&moves.table, row);
        printf("%g %g %g %g %g %g %g %g\\n", play->blend_s, play->start_s, play->min_rate, play->max_rate, play->mirror, play->loop,
            play->root, play->until);
    }
    cdb_moves_close(&moves);
    CDB_FREE(bytes);
    return 0;
}
"""


def test_c_reads_how_rows_play(tmp_path: Path):
    compiled = compiled_moves(tmp_path)
    compiled.save(tmp_path / "moves.safetensors")
    (tmp_path / "tables.h").write_text(c_header_of({"moves": compiled}), encoding="ascii")
    (tmp_path / "play.c").write_text(PROGRAM, encoding="ascii")
    program = built(tmp_path / "play.c", tmp_path / "play.exe", C, *sanitizers(compiler_for(C)))
    lines = [[abs(float(word)) for word in line.split()] for line in ran(program, tmp_path / "moves.safetensors").splitlines()]
    np.testing.assert_array_equal(lines, [[math.nan] * N_PLAY, *(numbers for _, numbers in ROWS)])
