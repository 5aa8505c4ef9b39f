"""The core in C, as Python has it: it compiles everywhere without a word, holds what it needs and no more, and refuses parts that
do not go together."""

import gc
import inspect
import json
import math
import os
import pickle
import random
import re
import subprocess
import sys
import sysconfig
import threading
import weakref
from pathlib import Path
from types import MappingProxyType
from typing import Any
from unittest import mock

import numpy as np
import pytest
from asking_c import CELLS, SCHEMA, UNKNOWN, artefact, random_moment, random_nest, random_table
from c_compilers import SANITIZED, STRICT, c_compiler, compiled, sanitizers, variants
from damaged_files import header_bytes, mutated, with_header
from safetensors.numpy import load
from strategies import IS_FULL
from test_c_rules import moments_of, ruled_table

from contextdb.cells.facts import cell
from contextdb.cells.kinds import KINDS
from contextdb.cells.output_types import OUTPUT_TYPES
from contextdb.compiled.core_table import TYPES, UNUSUAL
from contextdb.compiled.matches import Answering, Matches
from contextdb.compiled.table import CompiledTable, data_of
from contextdb.core import FLAT, VALUE, Answer, Shared, _core
from contextdb.core import Table as CoreTable
from contextdb.errors import ArtefactError, ContextError
from contextdb.files.tensors import digest_of
from contextdb.tables.table import Table

ROOT = Path(__file__).parent.parent
CORE = ROOT / "contextdb" / "core"
OPTIONS = ("-std=c99", "-ffp-contract=off", "-shared", "-fPIC")
N_DAMAGED = int(os.environ.get("DAMAGED", 60_000 if IS_FULL else 1_800)) // 3  # files of each of three kinds of tables
ASK = """
import importlib.util, json, random, sys
path, root, seed, n_tables = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
spec = importlib.util.spec_from_file_location("contextdb.core._core", path)
sys.modules["contextdb.core._core"] = own = importlib.util.module_from_spec(spec)
spec.loader.exec_module(own)
sys.path[:0] = [root, root + "/tests"]
import asking_c, test_c_rules
from contextdb import core
from contextdb.compiled.table import data_of
assert core.Table is own.Table and own.__file__ == path
rng = random.Random(seed)
for number in range(n_tables):
    if number % 3 == 0:
        compiled, moments = test_c_rules.ruled_table(rng, 70), test_c_rules.moments_of(rng, 40)
    else:
        compiled = asking_c.random_nest(rng, 30) if number % 3 == 1 else asking_c.random_table(rng, 1100)
        moments = [asking_c.random_moment(rng, asking_c.SCHEMA) for _ in range(40)]
    for unknown, facts in moments:
        answer = data_of(compiled).core.query(facts, asking_c.UNKNOWN.index(unknown))
        print(answer and (answer.indices.tolist(), hex(answer.bits)))
        if answer is not None and number < 9:
            assert answer == data_of(compiled).query_with_care(facts, unknown)
import contextdb, made_boxes
from contextdb.covering.points import Questions
report = contextdb.coverage(asking_c.random_table(rng, 90, list(asking_c.SCHEMA)[:6]), work=100_000, samples=2000, max_gaps=5)
print(report.to_json(), report.hits, report.work)
boxes, full, _ = made_boxes.made(150, 18, 0)
print(Questions(boxes, full).are_held(full, (1 << len(boxes)) - 1, 100_000), Questions(boxes, full).holders(len(boxes)))
"""


def compiled_core(folder: Path, name: str, *command: str) -> Path:
    """The extension, compiled with a compiler and options of its own."""
    return compiled([*command, *OPTIONS], CORE / "_core.c", folder / f"{name}.so", CORE)


def answers_of(extension: Path, seed: int, n_tables: int, **environment: str) -> str:
    """What an extension answers to random contexts of random tables, in a process of its own."""
    command = [sys.executable, "-c", ASK, str(extension), str(ROOT), str(seed), str(n_tables)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment)
    assert done.returncode == 0, done.stderr[-4000:]
    return done.stdout


needs_unix = pytest.mark.skipif(os.name == "nt", reason="the options are those of gcc and clang")
needs_stable_abi = pytest.mark.skipif(bool(sysconfig.get_config_var("Py_GIL_DISABLED")), reason="this Python has no stable ABI")


@needs_unix
@needs_stable_abi
def test_all_compilers_give_the_same_bits_at_all_levels_without_a_warning(tmp_path: Path):
    narrow = ("-O3" if IS_FULL else "-O0", "-DCDBP_NARROW")
    commands = variants(("-O0",), narrow, ("-O3",)) or pytest.skip("no C compiler was found")
    extensions = [compiled_core(tmp_path, f"core{number}", *command, *STRICT) for number, command in enumerate(commands)]
    answers = {answers_of(extension, 5, 30 if IS_FULL else 9) for extension in [*extensions, Path(_core.__file__)]}
    assert len(answers) == 1
    assert answers.pop().count("0x") > 100


@needs_unix
@needs_stable_abi
def test_the_names_declared_by_hand_are_those_of_python():
    if not Path(sysconfig.get_paths()["include"], "Python.h").is_file() or c_compiler() is None:
        pytest.skip("Python.h or a C compiler is missing")
    command = [str(c_compiler()), "-std=c99", "-fsyntax-only", "-DCDBP_HEADERS", f"-I{sysconfig.get_paths()['include']}"]
    for more in (["-DPy_LIMITED_API=0x030B0000"], []):
        done = subprocess.run([*command, *more, str(CORE / "_core.c")], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


@needs_unix
@needs_stable_abi
def test_sanitizers_find_nothing_in_what_random_contexts_do(tmp_path: Path):
    compiler = c_compiler()
    if compiler is None or not sanitizers(compiler):
        pytest.skip("no compiler with sanitizers was found")
    extension = compiled_core(tmp_path, "sanitized", compiler, *SANITIZED)
    library = subprocess.run([compiler, "-print-file-name=libasan.so"], capture_output=True, text=True).stdout.strip()
    environment = {"LD_PRELOAD": library, "ASAN_OPTIONS": "detect_leaks=0", "PYTHONMALLOC": "malloc"}
    assert answers_of(extension, 6, 120 if IS_FULL else 12, **environment).count("0x") > 100


@needs_unix
def test_masks_are_read_up_to_the_eight_among_which_no_row_of_a_block_is_left(tmp_path: Path):
    compiler = c_compiler()
    if compiler is None:
        pytest.skip("no C compiler was found")
    program = tmp_path / "touched"
    source = ROOT / "tests" / "c_programs" / "touched.c"
    subprocess.run([compiler, "-std=c99", f"-I{CORE}", str(source), "-o", str(program)], check=True)

    def touched(n_words: int, n_masks: int, *empty: int) -> tuple[int, int]:
        """The words of masks that are read, and the rows that are left, where some masks are empty."""
        said = subprocess.run([program, *map(str, (n_words, n_masks, *empty))], capture_output=True, text=True, check=True).stdout
        n_touched, n_rows = map(int, said.split())
        return n_touched, n_rows

    assert touched(157, 40) == (157 * 40, 157 * 64)
    assert touched(157, 40, 0) == touched(157, 40, 7) == touched(157, 40, 3, 30) == (157 * 8, 0)
    assert touched(157, 40, 8) == touched(157, 40, 15) == (157 * 16, 0)
    assert touched(16, 30, 23) == (16 * 24, 0)
    assert touched(16, 30, 24) == (16 * 25, 0)
    assert touched(0, 30) == (0, 0)
    assert touched(1, 0) == (0, 64)


# ---- what soft cells cost


@pytest.mark.parametrize("kind", ["flat", "nested", "ruled"])
def test_soft_cells_cost_what_reading_each_of_them_says(kind: str):
    rng = random.Random(12)
    soft = {
        name: [*cells, *(f"{c} ~{p}" for c in cells for p in ("0.1", "2.5", "1e300") if "~" not in c)]
        for name, cells in CELLS.items()
    }
    with mock.patch.dict(CELLS, soft):
        for _ in range(200 if IS_FULL else 25):
            n_rows = rng.choice((0, 1, 64, 90))
            compiled = (
                ruled_table(rng, max(n_rows, 1))
                if kind == "ruled"
                else (random_table if kind == "flat" else random_nest)(rng, n_rows)
            )
            data, n_answered = data_of(compiled), 0
            moments = moments_of(rng, 20) if kind == "ruled" else [random_moment(rng, SCHEMA) for _ in range(20)]
            for unknown, facts in moments:
                costs = np.zeros((data.n_depths, data.n_rows))
                try:
                    expected = data.layered_penalties(facts, unknown, lambda fact, condition: fact)  # type: ignore[arg-type]
                except ContextError:
                    assert not data.core.penalties(facts, UNKNOWN.index(unknown), costs)
                    continue
                is_answered = data.core.penalties(facts, UNKNOWN.index(unknown), costs)
                assert costs.tobytes() == (expected if is_answered else np.zeros_like(costs)).tobytes()
                assert data.layered_penalties(facts, unknown).tobytes() == expected.tobytes()  # type: ignore[arg-type]
                n_answered += is_answered
            assert n_answered or not data.is_soft or kind == "ruled" or n_rows == 0


# ---- joined columns


def table_of_few_classes(rng: random.Random, n_columns: int, n_rows: int) -> tuple[Table, dict[str, list[object]]]:
    """A table of bools, enums and a few numbers, and facts that each condition can have."""
    schema: dict[str, dict[str, object]] = {}
    cells: dict[str, list[str]] = {"Asset Name": [f"asset {row}" for row in range(n_rows)]}
    facts: dict[str, list[object]] = {}
    for number in range(n_columns):
        name, n_values = f"fact {number}", rng.choice((0, 1, 2, 2, 2, 3, 12, 70))
        values = [f"value {each}" for each in range(n_values)]
        if n_values == 0:
            schema[name], texts, facts[name] = {"type": "number"}, ["0..5", ">2", "not 3", "-1"], [-0.0, 0.0, 2, 3.0, 5.5, -1.0]
        elif n_values == 2:
            schema[name], texts, facts[name] = {"type": "bool"}, ["True", "False"], [True, False]
        else:
            schema[name], texts, facts[name] = {"type": "enum", "values": values}, [f'"{v}"' for v in values], list(values)
        cells[name] = [rng.choice(["Any", "Any", rng.choice(texts)]) for _ in range(n_rows)]
    return Table.from_columns(cells, schema=schema), facts


def test_columns_of_few_classes_are_answered_together_as_each_by_itself():
    rng = random.Random(7)
    for n_columns, n_rows in ((1, 1), (5, 70), (12, 64), (30, 1000), (40, 129), (75, 300), (90, 40), (9, 0)):
        table, facts = table_of_few_classes(rng, n_columns, n_rows)
        data = data_of(table.compile())
        for _ in range(40):
            moment = {name: rng.choice(values) for name, values in facts.items()}
            answer = data.core.query(moment)
            assert answer is not None
            assert answer == data.query_with_care(moment)


def test_a_live_context_answers_as_a_query_whichever_facts_are_set_or_missing():
    rng = random.Random(8)
    for n_columns, n_rows, unknown in ((12, 200, "any"), (12, 70, "never"), (30, 300, "never"), (8, 100, "error"), (80, 90, "any")):
        table, facts = table_of_few_classes(rng, n_columns, n_rows)
        compiled = table.compile()
        now = {name: rng.choice(values) for name, values in facts.items()}
        live = compiled.live(now, unknown=unknown)  # type: ignore[arg-type]
        for _ in range(150):
            name = rng.choice(list(facts))
            if rng.random() < 0.2:
                live[name] = now[name] = None
            else:
                live[name] = now[name] = rng.choice(facts[name])
            if unknown != "error" or None not in now.values():
                assert live.matches().indices.tolist() == compiled.query(now, unknown=unknown).indices.tolist()  # type: ignore[arg-type]


def test_names_and_values_that_are_equal_to_those_of_the_table_need_not_be_the_same_objects():
    table, facts = table_of_few_classes(random.Random(9), 30, 500)
    data, rng = data_of(table.compile()), random.Random(10)
    for _ in range(60):
        moment = {name: rng.choice(values) for name, values in facts.items()}
        expected = data.query_with_care(moment)
        shuffled = rng.sample(list(moment.items()), len(moment))
        for again in (moment, json.loads(json.dumps(moment)), json.loads(json.dumps(moment)), dict(shuffled)):
            assert data.core.query(again) == expected
        odd = rng.choice(list(facts))
        assert data.core.query(moment | {odd: "nothing" + str(rng.random())}) is None


def test_row_numbers_stay_as_they_are_while_other_answers_are_made():
    shared, rng = Answering(["a"] * 3000), random.Random(11)
    kept = []
    for _ in range(600):
        rows = sorted(rng.sample(range(3000), rng.choice((0, 1, 2, 3, 20, 64, 65, 300))))
        kept.append((rows, Matches(sum(1 << row for row in rows), shared).indices))
    for rows, numbers in kept:
        assert numbers.tolist() == rows
        assert (numbers.dtype, numbers.flags.writeable, numbers.flags.aligned) == (np.int64, False, True)


def test_row_numbers_are_right_where_others_are_made_while_they_are():
    """As another thread does that has its turn while numpy is called."""
    within: list[list[int]] = []

    def as_rows(octets: bytes) -> np.ndarray:
        if (number := len(within)) < 5:
            within.append([])
            within[number] = Answer(0b11 << number, shared).indices.tolist()
        return np.frombuffer(octets, np.int64)

    shared = Shared(np.arange(300), as_rows)
    assert Answer(0b101, shared).indices.tolist() == [0, 2]
    assert within == [[n, n + 1] for n in range(5)]
    kept = [(n, Answer(0b1001 << n, shared).indices) for n in range(250)]
    assert all(numbers.tolist() == [n, n + 3] for n, numbers in kept)


# ---- references


def moments_of_every_kind(rng: random.Random) -> list[dict[str, object]]:
    facts = [dict(random_moment(rng, SCHEMA, 0.0)[1]) for _ in range(40)]
    odd: list[object] = [None, [], {"x"}, "x", 10**400, 2**60, float("nan"), object(), cell("Any"), np.float32(2), ["Move"], b"x"]
    return facts + [each | {name: value} for each in facts[:4] for name in SCHEMA for value in odd]


def test_a_hundred_thousand_questions_leave_no_reference_and_no_memory_behind():
    rng = random.Random(1)
    core = data_of(random_table(rng, 130)).core
    moments = moments_of_every_kind(rng)
    values = [value for facts in moments for value in facts.values() if isinstance(value, (set, frozenset, list, float))]

    def ask() -> None:
        for unknown in (0, 1, 2):
            for facts in moments:
                answer = core.query(facts, unknown)
                if answer is not None:
                    assert len(answer) == len(answer.indices) == answer.bits.bit_count()
                    answer.bits = answer.bits

    ask()  # views of single rows are made once
    gc.collect()
    counts = [sys.getrefcount(value) for value in values]
    before = sys.getallocatedblocks()
    for _ in range(30 if IS_FULL else 10):
        ask()
    gc.collect()
    assert sys.getallocatedblocks() - before < len(moments)  # each was asked 30 times and more
    assert [sys.getrefcount(value) for value in values] == counts


def test_a_table_and_its_answers_are_given_back():
    def made_and_asked() -> None:
        table = random_table(random.Random(2), 70, ["speed", "word", "tags", "state"])
        facts = {"speed": 1.0, "word": "a", "tags": {"x"}, "state": "A"}
        for answer in (table.query(facts), table.live(facts).matches()):
            assert answer.indices is answer.indices

    def alive() -> int:
        gc.collect()
        return sum(isinstance(each, (CoreTable, Answer, Shared)) for each in gc.get_objects())

    made_and_asked()
    before = alive()
    for _ in range(20):
        made_and_asked()
    assert alive() == before


def test_eight_threads_ask_one_table_as_one_does():
    rng = random.Random(3)
    table = random_table(rng, 600)
    moments = [random_moment(rng, SCHEMA) for _ in range(300)]

    def answered(table: CompiledTable) -> list[object]:
        found: list[object] = []
        for unknown, facts in moments:
            try:
                answer = table.query(facts, unknown=unknown)  # type: ignore[arg-type]
                found.append((answer.indices.tolist(), answer.bits))
            except ContextError as error:
                found.append(str(error))
        return found

    expected = answered(table)
    results: list[list[object]] = []
    threads = [threading.Thread(target=lambda: results.append(answered(table))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [expected] * 8


def test_eight_threads_ask_while_a_table_is_exchanged(tmp_path: Path):
    """Each asks the version that it has, and brings in another one, as a hot reload does; no answer is of two versions."""
    rng = random.Random(4)
    versions = [random_table(rng, n_rows, ["speed", "word", "tags", "state"]) for n_rows in (1, 70, 600)]
    moments = [dict(random_moment(rng, ["speed", "word", "tags", "state"], 0.0)[1]) for _ in range(40)]
    files = [tmp_path / f"{number}.safetensors" for number in range(3)]
    for version, file in zip(versions, files, strict=True):
        version.save(file)
    expected = [[version.query(facts, unknown="never").indices.tolist() for facts in moments] for version in versions]
    current = [(0, versions[0])]
    wrong: list[object] = []

    def ask_and_exchange(seed: int) -> None:
        own = random.Random(seed)
        try:
            for _ in range(300 if IS_FULL else 20):
                for at, facts in enumerate(moments):
                    number, table = current[0]
                    answer = table.query(facts, unknown="never")
                    if answer.indices.tolist() != expected[number][at] or answer.n_rows != table.n_rows:
                        wrong.append((number, facts))
                number = own.randrange(3)
                current[0] = number, CompiledTable.open(files[number])
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=ask_and_exchange, args=(seed,)) for seed in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


# ---- parts that do not go together


def test_an_answer_needs_what_the_answers_of_its_table_share():
    for parts in ((1,), (1, object()), ("x", Answering(["a"])), (1, 2, 3)):
        with pytest.raises(TypeError):
            Matches(*parts)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="was not made"):
        _ = object.__new__(Matches).bits
    with pytest.raises(ValueError, match="no such row"):
        _ = Matches(1 << 70, Answering(["a"])).indices
    with pytest.raises(TypeError):
        Matches(1, Answering(["a"])).bits = "x"  # type: ignore[assignment]


def test_rows_are_the_same_as_numbers_and_as_bits():
    table = Answering(["a"] * 200)
    for rows in ([], [0], [199], [0, 199], [63, 64, 65], list(range(200)), [5, 9, 150]):
        answer = Matches(sum(1 << row for row in rows), table)
        assert (answer.indices.tolist(), len(answer), bool(answer)) == (rows, len(rows), bool(rows))
        assert not answer.indices.flags.writeable
        answer.bits ^= 1
        assert (0 in answer.indices) != (0 in rows)


def parts_of_a_table() -> dict[str, Any]:
    """What a table of two rows is made of."""
    masks = np.zeros((4, 1), np.uint64)
    bounds = np.array([1.0, 2.0])
    values = np.ones((3, 1), np.uint64)
    speed = ("speed", TYPES["number"], None, (), None, float, (FLAT, 0, (bounds, masks), (), ()), None)
    ok = ("ok", TYPES["bool"], None, (), {False: 0, True: 1}, None, (VALUE, 0, (values,), (), ()), None)
    shared = Answering(["a", "b"])
    return {"answers": Matches, "shared": shared, "unusual": UNUSUAL, "n_rows": 2, "enabled": np.array([3], np.uint64),
            "conditions": (speed, ok), "programs": None}  # fmt: skip


def with_soft(soft: object) -> dict[str, Any]:
    speed, ok = parts_of_a_table()["conditions"]
    return parts_of_a_table() | {"conditions": ((*speed[:-1], soft), ok)}


def with_column(at: int, column: object) -> dict[str, Any]:
    parts = parts_of_a_table()
    conditions = list(parts["conditions"])
    conditions[at] = (*conditions[at][:-2], column, None)
    return parts | {"conditions": tuple(conditions)}


def test_parts_that_do_not_go_together_are_refused():
    masks, bounds = np.zeros((4, 1), np.uint64), np.array([1.0, 2.0])
    assert CoreTable(*parts_of_a_table().values()).query({"speed": 1.0, "ok": True}).indices.tolist() == []
    wrong = [
        parts_of_a_table() | {"n_rows": 200},
        parts_of_a_table() | {"n_rows": -1},
        parts_of_a_table() | {"enabled": np.array([4], np.uint64)},
        parts_of_a_table() | {"enabled": np.array([3], np.uint32)},
        parts_of_a_table() | {"shared": Shared},
        parts_of_a_table() | {"answers": Answering},
        parts_of_a_table() | {"answers": 5},
        parts_of_a_table() | {"conditions": (("x",),)},
        parts_of_a_table() | {"conditions": [1]},
        parts_of_a_table() | {"programs": ((),) * 8},
        with_column(0, (VALUE, 0, (masks,), (), ())),
        with_column(0, (FLAT, 0, (bounds,), (), ())),
        with_column(0, (FLAT, 0, (bounds[::-1], masks), (), ())),
        with_column(0, (FLAT, 0, (np.array([2.0, 1.0]), masks), (), ())),
        with_column(0, (FLAT, 0, (np.array([np.nan, 1.0]), masks), (), ())),
        with_column(0, (FLAT, 0, (bounds, masks[:3]), (), ())),
        with_column(0, (FLAT, 0, (bounds, masks.ravel()), (), ())),
        with_column(0, (FLAT, 0, (bounds, np.zeros((4, 2), np.uint64)), (), ())),
        with_column(0, (3, 99, (bounds, masks, masks, masks), (), ())),
        with_column(0, (3, 2, (bounds, masks[None], masks[None], masks[0]), (), ())),
        with_column(1, (VALUE, 0, (masks,), (), ())),
        with_column(1, 7),
    ]
    for parts in wrong:
        with pytest.raises((TypeError, ValueError)):
            CoreTable(*parts.values())
    soft = ((FLAT, 0, (bounds, masks), (), ()), np.ones(2))
    table, costs = CoreTable(*with_soft(soft).values()), np.zeros((1, 2))
    assert table.penalties({"speed": 1.0, "ok": True}, 0, costs)
    assert costs.tolist() == [[1.0, 1.0]]
    for given in (
        costs[0],
        costs[:, :1],
        np.zeros((2, 2)),
        np.zeros((1, 2), np.float32),
        np.zeros((1, 2), np.int64),
        bytes(16),
        None,
    ):
        with pytest.raises((TypeError, ValueError, BufferError)):
            table.penalties({"speed": 1.0, "ok": True}, 0, given)  # type: ignore[arg-type]
    for damaged in (7, (soft[0],), (soft[0], np.ones(3)), (soft[0], np.ones(0)), (soft[0], np.ones(2, np.int32)), (7, soft[1])):
        with pytest.raises((TypeError, ValueError)):
            CoreTable(*with_soft(damaged).values())


@pytest.mark.parametrize("make", [random_table, random_nest])
def test_arrays_of_another_shape_are_refused_or_answer_without_a_fault(make: Any):
    rng = random.Random(4)
    data = data_of(make(rng, 70))
    whole = (data.core, [random_moment(rng, SCHEMA)[1] for _ in range(20)])
    assert whole[0] is not None
    from contextdb.compiled import core_table as made

    columns = [made._condition(c, False, m, s) for c, m, s in zip(data.conditions, data.masks, data.soft, strict=True)]
    assert sum(soft is not None for *_, soft in columns) >= 2
    n_refused = 0
    for _ in range(3000 if IS_FULL else 400):
        at = rng.randrange(len(columns))
        *head, column, soft = columns[at]
        is_soft = soft is not None and rng.random() < 0.5
        kind, shift, arrays, texts, negated = soft[0] if is_soft else column  # type: ignore[index, misc]
        number = rng.randrange(len(arrays))
        array = arrays[number]
        cut = rng.choice([array[:-1], array[1:], array[..., :-1], array.ravel(), array[None], array.view(np.uint8), array[::-1]])
        changed = list(columns)
        kind = rng.choice([kind, kind, rng.randrange(6)])
        parts = tuple(cut if i == number else a for i, a in enumerate(arrays))
        other = (kind, rng.choice([shift, shift, rng.randrange(40)]), parts, texts, negated)
        changed[at] = (*head, column, (other, soft[1][rng.randrange(2) :])) if is_soft else (*head, other, soft)  # type: ignore[index]
        try:
            core = CoreTable(Matches, data.answering, UNUSUAL, data.n_rows, data.enabled, tuple(changed), None)
        except (ValueError, TypeError):
            n_refused += 1
            continue
        for facts in whole[1]:
            core.query(facts, 2)
            core.penalties(facts, 2, np.zeros((data.n_depths, data.n_rows)))
    assert n_refused > 50


def test_an_answer_is_one_of_the_core():
    table = Table.from_columns({"Asset": ["a"], "ok": ["True"]}, {"ok": {"type": "bool"}}).compile()
    assert isinstance(table.query({"ok": True}), Answer)
    with pytest.raises(TypeError):
        data_of(table).core.query()
    with pytest.raises(TypeError):
        data_of(table).core.query({}, 3)


def test_the_function_that_answers_plain_questions_passes_all_others_on():
    columns = {"Asset": ["a", "b"], "state": ["up", "Any"], "ok": ["True", "Any"]}
    schema = {"state": {"type": "enum", "values": ["up", "down"]}, "ok": {"type": "bool"}}
    core = data_of(Table.from_columns(columns, schema).compile()).core
    passed_on: list[object] = []
    query = core.query_or(lambda *given, **named: passed_on.append((given, named)))
    plain = {"state": "up", "ok": True}
    assert query(plain).indices.tolist() == [0, 1]
    assert query({"state": "".join("down"), "ok": True}).indices.tolist() == [1]
    assert passed_on == []
    odd = [
        {},
        {"state": "up"},
        plain | {"ok": None},
        plain | {"state": "sideways"},
        plain | {"state": []},
        7,
        MappingProxyType(plain),
    ]
    others = [((facts,), {}) for facts in odd] + [((), {}), ((plain, 1), {}), ((plain,), {"unknown": "any"})]
    for given, named in others:
        assert query(*given, **named) is None
    core.is_watched = True
    assert query(plain) is None
    core.is_watched = False
    assert query(plain)
    assert passed_on == [*others, ((plain,), {})]
    with pytest.raises(ZeroDivisionError):
        core.query_or(lambda: 1 / 0)()


def test_a_table_answers_by_that_function_from_its_second_question_on():
    columns = {"Asset": ["a", "b"], "speed": ["1..3", "Any"]}
    table = Table.from_columns(columns, {"speed": {"type": "number"}}).compile()
    known = weakref.ref(table)
    copied = pickle.dumps(table)
    assert table.query({"speed": 2.0}) == table.query({"speed": 2.0})
    assert "query" in vars(table)
    assert inspect.signature(table.query).parameters.keys() >= {"context", "unknown", "actors", "prefer"}
    assert table.query({}, unknown="never").indices.tolist() == [1]
    with pytest.raises(ContextError, match="missing"):
        table.query({})
    assert pickle.dumps(table) == copied
    del table
    gc.collect()
    assert known() is None


def test_a_text_that_c_cannot_hold_is_answered_all_the_same():
    table = Table.from_columns({"Asset": ["a", "b"], "word": ['"x\ud800"', "Any"]}, {"word": {"type": "text"}}).compile()
    assert data_of(table).core.query({"word": "x"}) is None
    assert table.live({"word": "x\ud800"}).matches().indices.tolist() == [0, 1]
    assert table.query({"word": "x\ud800"}).indices.tolist() == [0, 1]
    assert table.query({"word": "y"}).indices.tolist() == [1]
    plain = Table.from_columns({"Asset": ["a"], "word": ["not x"]}, {"word": {"type": "text"}}).compile()
    assert plain.query({"word": "x\0"}).indices.tolist() == plain.query({"word": "\udc80"}).indices.tolist() == [0]


def test_rows_of_a_column_with_many_bounds_are_those_whose_cell_holds_the_number():
    cells = [f"{k / 10}..{(k + 7) / 10}" for k in range(100)]
    columns = {"Asset Name": [f"asset_{k}" for k in range(100)], "number": cells}
    compiled = Table.from_columns(columns, schema={"number": {"type": "number"}}).compile()
    bounds = [math.nextafter(k / 10, to) for k in range(-3, 110) for to in (-math.inf, k / 10, math.inf)]
    for fact in [*bounds, -1e300, 1e300, math.inf, -math.inf, 5, True]:
        expected = [k for k in range(100) if k / 10 <= fact <= (k + 7) / 10]
        assert compiled.query({"number": fact}).indices.tolist() == expected


def resealed(whole: bytes) -> bytes | None:
    """A damaged file with the digest of what it holds now, as one has that is made to harm; None where it has no contents."""
    size = header_bytes(whole)
    try:
        header = json.loads(whole[8 : 8 + size])
        metadata = header["__metadata__"]
        metadata["digest"] = digest_of(load(whole), metadata["about"], metadata["contextdb"])
        return with_header(whole, json.dumps(header).encode())
    except Exception:
        return None


@pytest.mark.parametrize("make", [random_table, random_nest, ruled_table])
def test_a_damaged_file_with_a_right_digest_is_refused_or_answers_and_nothing_else(tmp_path: Path, make: Any):
    rng = random.Random(13)
    compiled: CompiledTable = make(rng, 70)
    whole, file = artefact(compiled, tmp_path), tmp_path / "damaged.safetensors"
    n_refused = n_opened = 0
    for _ in range(N_DAMAGED):
        damaged = resealed(mutated(rng, whole))
        if damaged is None:
            continue
        file.write_bytes(damaged)
        try:
            table = CompiledTable.open(file)
        except ArtefactError:
            n_refused += 1
            continue
        n_opened += 1
        for unknown, facts in (random_moment(rng, SCHEMA) for _ in range(3)):
            try:
                _ = table.query(facts, unknown=unknown).indices  # type: ignore[arg-type]
            except ContextError:
                continue
    assert n_refused > 30
    assert n_opened > 30


def test_the_types_of_conditions_have_one_order_in_python_and_in_c():
    text = (ROOT / "contextdb" / "core" / "types.h").read_text(encoding="utf-8")
    enum = re.search(r"typedef enum cdb_type \{ (.*?) \}", text)
    names, of_outputs = re.findall(r"names\[\] = \{(.*?)\};", text)
    assert enum is not None
    assert enum[1].split(", ") == [f"CDB_{name.upper()}" for name in KINDS]
    assert names.split(", ") == [f'"{name}"' for name in KINDS]
    assert of_outputs.split(", ") == [f'"{name}"' for name in OUTPUT_TYPES]
