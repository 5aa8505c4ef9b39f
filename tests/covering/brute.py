"""Coverage in the plainest way: every context that cells can tell apart, each row read anew, measures summed as fractions."""

import itertools
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import oracles

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import Domain
from contextdb.covering.space import Space
from contextdb.schema.settings import EMPTY, TableSettings
from contextdb.tables.table import Table

DOMAINS = {
    "flag": Domain("bool"),
    "gait": Domain("enum", ("Walk", "Run", "Half Way")),
    "count": Domain("int", None, 0.0, 4.0),
    "speed": Domain("number", None, 0.0, 10.0),
    "heading": Domain("angle"),
    "word": Domain("text"),
    "state": Domain("tags", ("InAir", "Move", "Move.Run", "Move.Jump", "Other")),
    "Actor.flag": Domain("bool"),
}
CELLS = {
    "bool": ["True", "False", "Any", "not True", "not not Any"],
    "enum": ["Walk", 'Run "Half Way"', "not Run", "Any", "not not Any"],
    "int": ["0..2", "3", "<1", "not 2", "2..", "(1..3)", "0 | 4", "..9", "Any"],
    "number": ["..5)", "(5..", "..5", "5..", "2, 2.5", "5", "not 3..5", "0..2.5 | 7..9", "(2.5..10)", "-3..4", "Any"],
    "angle": ["170..-170", "0, 90", "(90..180)", "not 0", "-180..0", "90", "Any", "0, 180"],
    "text": ["A", "B C", "not A", "Any", "not C"],
    "tags": [
        "+Move",
        "-Move",
        "+Move.Run",
        "-Move.Run +Move",
        "+InAir",
        "not +InAir",
        "not +Move -InAir",
        "-InAir -Move.Jump",
        "Any",
    ],
}
EMPTY_CELLS = {"int": "5..3", "number": "7..6", "tags": "+Move.Run -Move"}
Box = Mapping[str, str]


@dataclass(frozen=True)
class Brute:
    """A table, gone through context by context; `impossible` are boxes of cell texts."""

    table: Table
    impossible: Sequence[Box] = ()

    @property
    def columns(self) -> list[tuple[str, Domain, list[str]]]:
        return list(oracles.columns(self.table))

    @cached_property
    def contexts(self) -> list[tuple[dict[str, object], Fraction]]:
        """Every possible context, and its measure; the measures sum to 1 unless all are 0."""
        names = [name for name, _, _ in self.columns]
        values = [atoms(domain, [*texts, *(b[name] for b in self.impossible if name in b)]) for name, domain, texts in self.columns]
        found = []
        for chosen in itertools.product(*values):
            context = {name: value for name, (value, _) in zip(names, chosen, strict=True)}
            measure = Fraction(1)
            for _, part in chosen:
                measure *= part
            if not any(self.is_in(context, box) for box in self.impossible):
                found.append((context, measure))
        total = sum(measure for _, measure in found)
        return [(context, measure / total if total else measure) for context, measure in found]

    @cached_property
    def valid(self) -> list[frozenset[int]]:
        """The valid rows of each context."""
        return [frozenset(oracles.rows(self.table, context)) for context, _ in self.contexts]

    def is_in(self, context: Mapping[str, object], box: Box) -> bool:
        return all(oracles.accepts(box[name], domain, context[name]) for name, domain, _ in self.columns if name in box)

    def share(self, flags: Sequence[bool]) -> float:
        return float(sum(measure for (_, measure), flag in zip(self.contexts, flags, strict=True) if flag))

    @property
    def covered(self) -> float:
        return self.share([bool(rows) for rows in self.valid])

    def inside(self, box: Box) -> list[bool]:
        return [self.is_in(context, box) for context, _ in self.contexts]


def atoms(domain: Domain, texts: Sequence[str]) -> list[tuple[object, Fraction]]:
    """One value of each part of a domain that texts tell apart, and the part's measure."""
    if domain.kind == "bool":
        return [(value, Fraction(1, 2)) for value in (False, True)]
    if domain.kind == "enum":
        return [(value, Fraction(1, len(domain.values))) for value in domain.values]
    if domain.kind == "int":
        numbers = range(int(domain.minimum), int(domain.maximum) + 1)
        return [(float(n), Fraction(1, len(numbers))) for n in numbers]
    if domain.kind == "text":
        named = sorted({"".join(word) for text in texts for word in oracles._words_in(text)})
        return [(word, Fraction(1, len(named) + 1)) for word in [*named, "another one"]]
    if domain.kind == "tags":
        subsets = [s for n in range(len(domain.values) + 1) for s in itertools.combinations(domain.values, n)]
        return [(frozenset(s), Fraction(1, len(subsets))) for s in subsets]
    return number_atoms(domain, texts)


def number_atoms(domain: Domain, texts: Sequence[str]) -> list[tuple[object, Fraction]]:
    """The points that texts name, of no measure, and the open intervals between them."""
    low, high = (-180.0, 180.0) if domain.kind == "angle" else (domain.minimum, domain.maximum)
    named = oracles.numbers_in(texts)
    ends = sorted({low, high, *(n for n in named if low <= n <= high), *(oracles.wrapped(n) for n in named if high == 180.0)})
    found: list[tuple[object, Fraction]] = [(end, Fraction(0)) for end in ends if not (domain.kind == "angle" and end == 180.0)]
    for left, right in itertools.pairwise(ends):
        found.append(((left + right) / 2, Fraction(right - left) / Fraction(high - low)))
    return found


def random_table(rng: random.Random, policy: str = "collect", most_rows: int = 8) -> Table:
    """A small table of any types, with soft cells, cells that accept nothing, and rows that are not enabled."""
    names = rng.sample(list(DOMAINS), rng.randint(0, 3))
    n_rows = rng.randint(0, most_rows)
    columns = {"Asset": [f"A{row}" for row in range(n_rows)]}
    for name in names:
        kind = DOMAINS[name].kind
        columns[name] = [random_cell(rng, kind) for _ in range(n_rows)]
    settings = TableSettings("table", policy=policy)
    if rng.random() < 0.3:
        columns["Enabled"] = [rng.choice(["True", "False", ""]) for _ in range(n_rows)]
        settings = replace(settings, enabled="Enabled")
    if policy == "priority" or (policy in ("specific", "cheapest") and rng.random() < 0.5):
        columns["Priority"] = [rng.choice(["", "1", "2", "3"]) for _ in range(n_rows)]
        settings = replace(settings, priority="Priority")
    conditions = {name: Condition(name, DOMAINS[name]) for name in names}
    return Table.from_columns(columns, replace(EMPTY, conditions=conditions), settings)


def random_cell(rng: random.Random, kind: str) -> str:
    if rng.random() < 0.35:
        return "Any"
    if kind in EMPTY_CELLS and rng.random() < 0.03:
        return EMPTY_CELLS[kind]
    return rng.choice(CELLS[kind]) + (" ~2.5" if rng.random() < 0.1 else "")


def random_boxes(rng: random.Random, table: Table) -> list[dict[str, str]]:
    """Up to two boxes of contexts that cannot happen."""
    names = [c.condition.name for c in table.conditions]
    if not names or rng.random() < 0.5:
        return []
    return [
        {name: rng.choice(CELLS[DOMAINS[name].kind]) for name in rng.sample(names, rng.randint(1, len(names)))}
        for _ in range(rng.randint(1, 2))
    ]


def nearest_row(space: Space, gap: Sequence[int]) -> tuple[int, list[int]]:
    """Of rows of assets that are equally alike the nearest to a gap, as a number of a box, and the conditions that have to change:
    the fewest, then those that grow least, then the lowest row."""

    def changes(row: Sequence[int]) -> tuple[int, float]:
        failing = failing_conditions(space, gap, row)
        more = [(space.factors[f].weights, gap[f] & ~row[f]) for at in failing for f in space.of_condition[at]]
        growth = sum(float(w) for weights, side in more for k, w in enumerate(weights) if side >> k & 1)
        return len(failing), round(growth, 9)

    i = min(range(len(space.boxes)), key=lambda i: changes(space.boxes[i]))
    return i, failing_conditions(space, gap, space.boxes[i])


def failing_conditions(space: Space, gap: Sequence[int], row: Sequence[int]) -> list[int]:
    return [at for at, own in enumerate(space.of_condition) if any(gap[f] & ~row[f] for f in own)]
