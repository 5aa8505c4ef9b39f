"""The core gives the same bits whatever compiled it: answers, costs, picks, and shares of coverage, by all compilers that are
there, with little and much optimisation, with and without wide registers, and as WebAssembly."""

import os
import platform
import random
import subprocess
from pathlib import Path
from shutil import which

import pytest
from asking_c import SCHEMA, all_asked, artefact, random_moment, random_nest, random_table
from c_compilers import PROGRAMS, all_compilers, compiled, ran, variants
from made_boxes import bytes_of, made
from strategies import IS_FULL
from test_c_rules import moments_of, ruled_table

from contextdb.compiled.c_header import c_header_of
from contextdb.compiled.table import CompiledTable

pytestmark = pytest.mark.skipif(os.name == "nt", reason="the options are those of gcc and clang")

CORE = Path(__file__).parent.parent / "contextdb" / "core"
EXACT = ("-std=c99", "-ffp-contract=off")
RUN_WASM = """
import { readFileSync } from 'node:fs'
import { WASI } from 'node:wasi'
const [program, folder] = process.argv.slice(2)
const wasi = new WASI({ version: 'preview1', args: ['program', '/in', '/out'], preopens: { '/': folder }, returnOnExit: true })
const { instance } = await WebAssembly.instantiate(readFileSync(program), { wasi_snapshot_preview1: wasi.wasiImport })
process.exit(wasi.start(instance))
"""


@pytest.fixture(scope="module")
def questions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files `in` of some tables, and `header/tables.h`."""
    folder = tmp_path_factory.mktemp("questions")
    (folder / "header").mkdir()
    (folder / "header" / "tables.h").write_text(c_header_of({}), encoding="ascii")
    first = next(iter(all_compilers()), None)
    if first is None:
        pytest.skip("no C compiler was found")
    program = program_of(folder, "first", *first, "-O1")
    rng = random.Random(8)
    for number in range(30 if IS_FULL else 6):
        table, moments = table_and_moments(rng, number)
        within = folder / str(number)
        within.mkdir()
        all_asked(program, within, table.conditions, [artefact(table, within)], moments, memory=2)
    return folder


def table_and_moments(rng: random.Random, number: int) -> tuple[CompiledTable, list[tuple[str, object]]]:
    if number % 3 == 0:
        return ruled_table(rng, 70), moments_of(rng, 40)
    table = random_nest(rng, 30) if number % 3 == 1 else random_table(rng, 1100)
    return table, [random_moment(rng, SCHEMA) for _ in range(40)]


@pytest.fixture(scope="module")
def counts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files `in` of boxes to count, and what the first compiler makes of them in `out`."""
    folder = tmp_path_factory.mktemp("counts")
    first = next(iter(all_compilers()), None)
    if first is None:
        pytest.skip("no C compiler was found")
    program = program_of(folder, "first", *first, "-O1", source="count.c")
    for n_boxes, n_factors in [(6, 9), (40, 16), (150, 24), (400, 12)]:
        for seed in range(10 if IS_FULL else 2):
            within = folder / f"{n_boxes}_{seed}"
            within.mkdir()
            (within / "in").write_bytes(bytes_of(made(n_boxes, n_factors, seed, 40), 200_000))
            ran(program, within / "in", within / "out")
    return folder


def program_of(folder: Path, name: str, *command: str, source: str = "ask.c") -> Path:
    return compiled([*command, *EXACT], PROGRAMS / source, folder / name, folder / "header" if source == "ask.c" else CORE)


@pytest.mark.parametrize(("asked", "source"), [("questions", "ask.c"), ("counts", "count.c")])
def test_all_compilers_give_the_same_bits_with_and_without_wide_registers(asked: str, source: str, request: pytest.FixtureRequest):
    questions: Path = request.getfixturevalue(asked)
    wide = [("-O3", "-mavx2")] if platform.machine() in ("x86_64", "AMD64") and has_avx2() else []
    folders = folders_of(questions)
    assert len(folders) >= 6
    for number, command in enumerate(variants(("-O0",), ("-O3",), *wide)):
        program = program_of(questions, f"program{number}", *command, source=source)
        for within in folders:
            ran(program, within / "in", within / "other")
            assert (within / "other").read_bytes() == (within / "out").read_bytes(), command


@pytest.mark.parametrize(("asked", "source"), [("questions", "ask.c"), ("counts", "count.c")])
def test_web_assembly_gives_the_same_bits(asked: str, source: str, request: pytest.FixtureRequest):
    questions: Path = request.getfixturevalue(asked)
    zig = [command for command in all_compilers() if command[-1] == "cc"]
    node = which("node")
    if not zig or node is None:
        pytest.skip("zig or node is missing")
    program = program_of(questions, "program.wasm", *zig[0], "-target", "wasm32-wasi", "-Os", source=source)
    (questions / "run.mjs").write_text(RUN_WASM, encoding="ascii")
    for within in folders_of(questions):
        expected = (within / "out").read_bytes()
        (within / "out").unlink()
        line = [node, "--no-warnings", str(questions / "run.mjs"), str(program), str(within)]
        done = subprocess.run(line, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
        assert (within / "out").read_bytes() == expected


def folders_of(questions: Path) -> list[Path]:
    return sorted(path.parent for path in questions.glob("*/in"))


def has_avx2() -> bool:
    try:
        return " avx2 " in Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False
