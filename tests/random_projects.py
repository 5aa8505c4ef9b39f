"""Random projects for property tests, and everything that is true of them, found by trying every context.

A project is drawn from a `random.Random`: conditions of every type, soft cells, `not`, unions, facts that are computed, rules of
rows, a table inside the table, rows that are not enabled, policies, and contexts that are assumed not to happen. It is written into
a folder, so that a test asks it only in the ways that users have.

What is true is worked out here from the texts of the cells (by `oracles`) and from expressions that are drawn together with a plain
Python function of the same meaning. A context is one value of each condition; numbers that are not whole are tried at every end
that a text names and between each two, and only compared with constants, so that the contexts stand for all others.
"""

import csv
import datetime
import io
import itertools
import json
import math
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import oracles
from covering.brute import CELLS as BRUTE_CELLS
from covering.brute import DOMAINS as BRUTE_DOMAINS
from covering.brute import EMPTY_CELLS, atoms

from contextdb.cells.domains import Domain

Value = bool | float | str | frozenset[str] | None
Facts = Mapping[str, Value]
Row = tuple[tuple[str, int], ...]
"""A row of a table as names of tables and numbers of rows: the row, or the row that names an inner table and the row there."""

FIRST_DAY = 20454.0  # 2026-01-01
DOMAINS = BRUTE_DOMAINS | {
    "day": Domain("date", None, FIRST_DAY, FIRST_DAY + 4.0),
    "level": Domain("int"),
    "fast": Domain("bool"),
    "total": Domain("int"),
    "score": Domain("number", None, -2.0, 12.0),
    "ratio": Domain("number"),
    "pace": Domain("enum", ("Walk", "Run", "Half Way")),
}
CELLS = BRUTE_CELLS | {
    "date": ["2026-01-02", "..2026-01-03", "2026-01-02..2026-01-04", "(2026-01-02..", "not 2026-01-05", "Any"],
}
DERIVED = ("fast", "total", "score", "ratio", "pace")
HALF_TURNS = (float("-180"), 180.0)
"""Half a turn where it must be one of the two throughout: the first is known by its identity."""
MOST_CONTEXTS = 3000
LEVELS = range(-60, 61)
SIGNS = ("==", "!=", "<", "<=", ">", ">=")
POLICIES = ("collect", "first", "unique", "priority", "specific", "cheapest")


# ---- expressions, as a text and as a function


@dataclass(frozen=True)
class Term:
    """An expression. None is a missing value."""

    text: str
    value: Callable[[Facts], Value]
    names: frozenset[str] = frozenset()
    ends: frozenset[tuple[str, str]] = frozenset()
    """Cells to which a condition is compared: there its values must be told apart."""


def _joined(terms: Sequence[Term], text: str, value: Callable[[Facts], Value]) -> Term:
    return Term(text, value, frozenset().union(*(t.names for t in terms)), frozenset().union(*(t.ends for t in terms)))


def _compares(a: float, sign: str, b: float) -> bool:
    return {"==": a == b, "!=": a != b, "<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b}[sign]


def _angle_compares(a: float, sign: str, b: float) -> bool:
    """An order holds for half a turn if it does for -180 or for 180, unless the fact is one of `HALF_TURNS`; equality wraps."""
    if sign in ("==", "!="):
        return _compares(oracles.wrapped(a), sign, oracles.wrapped(b))
    return _compares(a, sign, b) or (a == -180.0 and a is not HALF_TURNS[0] and _compares(180.0, sign, b))


def _and(values: Sequence[Value]) -> Value:
    return False if False in values else None if None in values else True


class Expressions:
    """Draws expressions over some conditions."""

    def __init__(self, rng: random.Random, names: Sequence[str]) -> None:
        self.rng = rng
        self.names = names

    def of(self, *kinds: str) -> list[str]:
        return [name for name in self.names if DOMAINS[name].kind in kinds]

    def number(self, depth: int) -> Term:
        """A whole number."""
        rng, names = self.rng, [n for n in self.of("int") if n != "ratio"]
        form = rng.randrange(6) if depth else rng.randrange(2)
        if form == 0 or not names:
            number = float(rng.randint(-3, 6))
            return Term(str(int(number)), lambda facts: number)
        if form == 1:
            return self._fact(rng.choice(names))
        if form == 2:
            return self.choice(self.truth(depth - 1), self.number(depth - 1), self.number(depth - 1))
        a, b = self.number(depth - 1), self.number(depth - 1)
        sign = rng.choice("+-*")
        of = {"+": lambda x, y: x + y, "-": lambda x, y: x - y, "*": lambda x, y: x * y}[sign]

        def value(facts: Facts) -> Value:
            x, y = a.value(facts), b.value(facts)
            return None if x is None or y is None else of(x, y)

        return _joined((a, b), f"({a.text} {sign} {b.text})", value)

    def name(self, depth: int) -> Term:
        """A value of the enums."""
        values = DOMAINS["gait"].values
        if depth <= 0 or self.rng.random() < 0.4:
            names = self.of("enum")
            if names and self.rng.random() < 0.5:
                return self._fact(self.rng.choice(names))
            text = self.rng.choice(values)
            return Term(json.dumps(text), lambda facts: text)
        return self.choice(self.truth(depth - 1), self.name(depth - 1), self.name(depth - 1))

    def truth(self, depth: int) -> Term:
        """True or False."""
        rng = self.rng
        form = rng.randrange(10) if depth > 0 else 0
        if form <= 4:
            return self._plain_truth()
        if form == 5:
            part = self.truth(depth - 1)
            return _joined((part,), f"(not {part.text})", lambda facts: None if (v := part.value(facts)) is None else not v)
        if form == 6:
            return self.choice(self.truth(depth - 1), self.truth(depth - 1), self.truth(depth - 1))
        if form == 7:
            a, b, sign = self.number(depth - 1), self.number(depth - 1), rng.choice(SIGNS)

            def compared(facts: Facts) -> Value:
                x, y = a.value(facts), b.value(facts)
                return None if x is None or y is None else _compares(x, sign, y)

            return _joined((a, b), f"({a.text} {sign} {b.text})", compared)
        parts, word = [self.truth(depth - 1) for _ in range(rng.randint(2, 3))], rng.choice(("and", "or"))

        def value(facts: Facts) -> Value:
            values = [part.value(facts) for part in parts]
            if word == "and":
                return _and(values)
            opposite = _and([None if v is None else not v for v in values])
            return None if opposite is None else not opposite

        return _joined(parts, "(" + f" {word} ".join(p.text for p in parts) + ")", value)

    def choice(self, condition: Term, then: Term, otherwise: Term) -> Term:
        def value(facts: Facts) -> Value:
            chosen = condition.value(facts)
            return None if chosen is None else (then if chosen else otherwise).value(facts)

        return _joined((condition, then, otherwise), f"({then.text} if {condition.text} else {otherwise.text})", value)

    def _fact(self, name: str) -> Term:
        return Term(name, lambda facts: facts[name], frozenset((name,)))

    def _plain_truth(self) -> Term:
        """One condition, and constants."""
        rng, name = self.rng, self.rng.choice(self.names)
        domain = DOMAINS[name]
        texts = [text for text in CELLS[domain.kind] if text != "Any"]
        form = rng.randrange(3)
        if domain.kind == "bool" and form:
            return self._fact(name)
        if domain.kind == "enum" and form:
            values = rng.sample(domain.values, 2)
            return self._asked(name, f"{name} in {json.dumps(values)}", lambda v: v in values)
        if domain.kind == "text" and form:
            return self._asked(name, f'{name} != "A"', lambda v: v != "A", "A")
        if domain.kind == "tags" and form:
            tag = rng.choice(domain.values)
            return self._asked(name, f'"{tag}" in {name}', lambda v: oracles.has(tag, v))
        if domain.kind in ("int", "number", "angle") and form:
            sign = rng.choice(SIGNS)
            low, high = (-180, 180) if domain.kind == "angle" else (-1, 11)
            number = float(rng.choice([low, high, rng.randint(low, high)]))
            if sign[0] in "<>" or domain.kind != "angle":
                compares = _angle_compares if domain.kind == "angle" else _compares
                return self._asked(name, f"{name} {sign} {number:g}", lambda v: compares(v, sign, number), f"{number:g}")
        if domain.kind == "date" and form:
            number, sign = FIRST_DAY + rng.randint(0, 5), rng.choice(SIGNS)
            return self._asked(name, f'{name} {sign} date("{date_text(number)}")', lambda v: _compares(v, sign, number))
        text = rng.choice(texts)
        return self._asked(name, f"{name} in '{text}'", lambda v: oracles.accepts(text, domain, v), text)

    def _asked(self, name: str, text: str, asks: Callable[[Value], bool], cell: str | None = None) -> Term:
        ends = frozenset() if cell is None else frozenset(((name, cell),))
        return Term(f"({text})", lambda facts: None if facts[name] is None else asks(facts[name]), frozenset((name,)), ends)


def date_text(days: float) -> str:
    """A date of so many days since 1970-01-01."""
    return (oracles.EPOCH + datetime.timedelta(days=days)).isoformat()


# ---- projects


@dataclass(frozen=True)
class RandomTable:
    """A table as texts: its columns by name, and the keys of [tables.NAME]."""

    name: str
    columns: Mapping[str, Sequence[str]]
    settings: Mapping[str, object]
    rules: Sequence[Term | None] = ()
    """The rule of each row, where the table has rules."""

    @property
    def n_rows(self) -> int:
        return len(self.columns["Asset"])

    @property
    def conditions(self) -> list[str]:
        return [name for name in self.columns if name in DOMAINS]

    @property
    def csv(self) -> str:
        """The file."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(zip(*self.columns.values(), strict=True))
        return out.getvalue()


@dataclass(frozen=True)
class RandomProject:
    """A project of one table, "outer", with perhaps another inside, and what is true of it."""

    tables: Mapping[str, RandomTable]
    derived: Mapping[str, Term]
    """The facts that are computed, in an order in which each names only earlier ones."""
    assume: Sequence[Term] = ()

    @property
    def outer(self) -> RandomTable:
        return self.tables["outer"]

    # -- files

    def write(self, folder: Path) -> Path:
        """Write the project; the folder."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "contextdb.toml").write_text(self.toml, "utf-8")
        for table in self.tables.values():
            (folder / f"{table.name}.csv").write_text(table.csv, "utf-8")
        return folder

    @property
    def toml(self) -> str:
        lines: list[str] = []
        for name in sorted(DOMAINS, key=lambda n: n in DERIVED):
            if name not in DERIVED or name in self.derived:
                lines += [f"[conditions.{json.dumps(name)}]", *_declared(DOMAINS[name])]
            if name in self.derived:
                lines.append(f"expr = {json.dumps(self.derived[name].text)}")
        for table in self.tables.values():
            lines += [f"[tables.{table.name}]", f'file = "{table.name}.csv"']
            lines += [f"{key} = {json.dumps(value)}" for key, value in table.settings.items()]
        return "\n".join(lines) + "\n"

    # -- rows

    @cached_property
    def rows(self) -> list[Row]:
        """Every row, in order; that of an inner table once for each row that names it."""
        found: list[Row] = []
        for row, asset in enumerate(self.outer.columns["Asset"]):
            inner = range(self.tables[asset[1:]].n_rows) if asset.startswith("@") else None
            found += [(("outer", row),)] if inner is None else [(("outer", row), (asset[1:], r)) for r in inner]
        return found

    def asset(self, row: Row) -> str:
        table, at = row[-1]
        return self.tables[table].columns["Asset"][at]

    @cached_property
    def used(self) -> list[RandomTable]:
        """The outer table, and the inner one where a row names it."""
        return [table for table in self.tables.values() if table.name == "outer" or f"@{table.name}" in self.outer.columns["Asset"]]

    @cached_property
    def conditions(self) -> list[str]:
        """The conditions that are columns of a table that is used."""
        return list(dict.fromkeys(name for table in self.used for name in table.conditions))

    def is_valid(self, row: Row, facts: Facts) -> bool:
        return all(self._is_valid(self.tables[table], at, facts) for table, at in row)

    def _is_valid(self, table: RandomTable, at: int, facts: Facts) -> bool:
        if table.columns.get("Enabled", ["True"] * table.n_rows)[at].lower() == "false":
            return False
        if not all(oracles.passes(table.columns[name][at], DOMAINS[name], facts[name]) for name in table.conditions):
            return False
        rule = table.rules[at] if table.rules else None
        return rule is None or rule.value(facts) is True

    # -- contexts

    @cached_property
    def named(self) -> list[str]:
        """The conditions of which a value decides something, those given first."""
        names = set(self.conditions).union(*(t.names for t in self._terms))
        for name in reversed(self.derived):
            names |= self.derived[name].names if name in names else set()
        return [name for name in DOMAINS if name in names and name not in self.derived]

    @property
    def _terms(self) -> list[Term]:
        return [*self.assume, *(rule for table in self.used for rule in table.rules if rule is not None)]

    def _texts(self, name: str) -> list[str]:
        """The cells that tell values of a condition apart."""
        ends = {cell for term in (*self._terms, *self.derived.values()) for n, cell in term.ends if n == name}
        return sorted({text for table in self.used for text in table.columns.get(name, ())} | ends)

    @cached_property
    def values(self) -> dict[str, list[tuple[Value, Fraction]]]:
        """The values to be tried of each condition that is given, and which share each stands for."""
        return {name: _values(DOMAINS[name], self._texts(name)) for name in self.named}

    @property
    def n_contexts(self) -> int:
        return math.prod(map(len, self.values.values()))

    @property
    def is_measurable(self) -> bool:
        """Whether shares can be worked out here: how much the values count of a condition that is not declared is the engine's."""
        return "level" not in self.named and not any("word" in term.names for term in (*self._terms, *self.derived.values()))

    @cached_property
    def contexts(self) -> list[tuple[dict[str, Value], Fraction]]:
        """Every context, facts that are computed included, with the share it stands for; those that cannot happen are not here."""
        found = []
        for chosen in itertools.product(*self.values.values()):
            facts = self.complete({name: value for name, (value, _) in zip(self.values, chosen, strict=True)})
            if self.can_happen(facts):
                found.append((facts, Fraction(math.prod(share for _, share in chosen))))
        return found

    def complete(self, given: Facts) -> dict[str, Value]:
        facts = dict(given)
        for name, term in self.derived.items():
            if term.names <= facts.keys():
                facts[name] = term.value(facts)
        return facts

    def can_happen(self, facts: Facts) -> bool:
        """Whether the assumptions hold or are open, an angle at half a turn being -180 or 180 throughout, and each computed fact of
        a column has a value in its domain."""
        computed = [name for name in self.conditions if name in self.derived]
        known = all(facts[name] is not None and oracles.is_in_domain(facts[name], DOMAINS[name]) for name in computed)
        turned = [name for name in self.named if DOMAINS[name].kind == "angle" and facts[name] == -180.0]
        ways = (dict.fromkeys(turned, half_turn) for half_turn in HALF_TURNS)
        return known and any(all(term.value({**facts, **way}) is not False for term in self.assume) for way in ways)

    @cached_property
    def valid(self) -> list[frozenset[int]]:
        """The numbers of the valid rows of each context."""
        return [frozenset(i for i, row in enumerate(self.rows) if self.is_valid(row, facts)) for facts, _ in self.contexts]

    def share(self, flags: Sequence[bool]) -> float:
        """The share of the contexts that can happen."""
        total = sum(share for _, share in self.contexts)
        return float(sum(share for (_, share), flag in zip(self.contexts, flags, strict=True) if flag) / total)

    def given(self, facts: Facts) -> dict[str, Value]:
        """What a game gives of a context."""
        return {name: facts[name] for name in self.named}


def is_inside(facts: Facts, cells: Mapping[str, str]) -> bool:
    """Whether a context lies in a box of cells."""
    return all(oracles.accepts(text, DOMAINS[name], facts[name]) for name, text in cells.items())


def _declared(domain: Domain) -> Iterator[str]:
    yield f'type = "{domain.kind}"'
    if domain.values:
        yield f"values = {json.dumps(list(domain.values))}"
    for key, end in (("min", domain.minimum), ("max", domain.maximum)):
        if domain.kind in ("int", "number", "date") and math.isfinite(end):
            yield f"{key} = {date_text(end) if domain.kind == 'date' else end:{'' if domain.kind == 'date' else 'g'}}"


def _values(domain: Domain, texts: Sequence[str]) -> list[tuple[Value, Fraction]]:
    if domain.kind == "date" or (domain.kind == "int" and math.isfinite(domain.minimum)):
        days = range(int(domain.minimum), int(domain.maximum) + 1)
        return [(float(day), Fraction(1, len(days))) for day in days]
    if domain.kind == "int":
        return [(float(level), Fraction(1, len(LEVELS))) for level in LEVELS]
    return atoms(domain, texts)


# ---- drawing


@dataclass
class Drawing:
    """What is drawn with."""

    rng: random.Random
    names: list[str] = field(default_factory=list)
    derived: dict[str, Term] = field(default_factory=dict)

    def chance(self, share: float) -> bool:
        return self.rng.random() < share

    def truth(self, names: Sequence[str]) -> Term:
        return Expressions(self.rng, [n for n in names if n != "ratio"]).truth(self.rng.randint(0, 2))

    def derive(self) -> None:
        """Some facts that are computed."""
        for name in DERIVED:
            if self.chance(0.25):
                expressions = Expressions(self.rng, [n for n in (*self.names, *self.derived) if n != "ratio"])
                depth = self.rng.randint(1, 2)
                kind = DOMAINS[name].kind
                term = (expressions.truth if kind == "bool" else expressions.name if kind == "enum" else expressions.number)(depth)
                if name == "ratio" and term.names:
                    part = term
                    term = _joined((part,), f"6 / {part.text}", lambda facts, p=part: 6.0 / v if (v := p.value(facts)) else None)
                if term.names:
                    self.derived[name] = term

    def table(self, name: str, most_rows: int, inner: Sequence[str] = ()) -> RandomTable:
        rng = self.rng
        n_rows = rng.randint(0, most_rows)
        assets = ["A", "B", "C", *(f"@{table}" for table in inner), *(f"@{table}" for table in inner)]
        columns = {"Asset": [rng.choice(assets) if self.chance(0.5) else f"{name}_{row}" for row in range(n_rows)]}
        for condition in (*self.names, *self.derived):
            if self.chance(0.8):
                columns[condition] = [self.cell(DOMAINS[condition].kind) for _ in range(n_rows)]
        settings: dict[str, object] = {"asset": "Asset", "policy": rng.choice(POLICIES)}
        if self.chance(0.3):
            columns["Enabled"] = [rng.choice(["True", "False", ""]) for _ in range(n_rows)]
            settings["enabled"] = "Enabled"
        if settings["policy"] == "priority" or self.chance(0.2):
            columns["Priority"] = [rng.choice(["", "1", "2"]) for _ in range(n_rows)]
            settings["priority"] = "Priority"
        rules: list[Term | None] = []
        named = [n for n in (*self.names, *self.derived) if n != "ratio"]
        if named and self.chance(0.3):
            rules = [self.truth(named) if self.chance(0.5) else None for _ in range(n_rows)]
            columns["When"] = ["" if rule is None else rule.text for rule in rules]
            settings["when"] = "When"
        return RandomTable(name, columns, settings, rules)

    def cell(self, kind: str) -> str:
        rng = self.rng
        if self.chance(0.35):
            return "Any"
        if kind in EMPTY_CELLS and self.chance(0.02):
            return EMPTY_CELLS[kind]
        return rng.choice(CELLS[kind]) + (" ~2.5" if self.chance(0.1) else "")


def random_project(rng: random.Random) -> RandomProject:
    """A project with few enough contexts that all of them can be tried."""
    while True:
        given = [name for name in DOMAINS if name not in DERIVED]
        drawing = Drawing(rng, rng.sample(given, rng.randint(1, 3)))
        drawing.derive()
        tables = [drawing.table("inner", 4)] if drawing.chance(0.3) else []
        tables.append(drawing.table("outer", 6, [table.name for table in tables]))
        names = [*drawing.names, *drawing.derived]
        drawn = [drawing.truth(names) for _ in range(rng.choice([0, 0, 1, 2]))]
        assume = list({term.text: term for term in drawn}.values())
        outer = tables[-1]
        if assume:
            outer = RandomTable("outer", outer.columns, {**outer.settings, "assume": [t.text for t in assume]}, outer.rules)
        project = RandomProject({**{t.name: t for t in tables}, "outer": outer}, drawing.derived, assume)
        if project.n_contexts <= MOST_CONTEXTS:
            return project


def changed_project(rng: random.Random, project: RandomProject) -> RandomProject:
    """The project with some cells, rows or switches of its outer table changed."""
    outer, drawing = project.outer, Drawing(rng)
    columns = {name: list(texts) for name, texts in outer.columns.items()}
    rules = list(outer.rules)
    for _ in range(rng.randint(0, 4)):
        n_rows = len(columns["Asset"])
        form = rng.randrange(5)
        if form == 0 and n_rows:
            row = rng.randrange(n_rows)
            for texts in (*columns.values(), *([rules] if rules else [])):
                del texts[row]
        elif form == 1:
            row = rng.randint(0, n_rows)
            for name, texts in columns.items():
                new = (
                    f"new_{rng.randrange(100)}" if name == "Asset" else drawing.cell(DOMAINS[name].kind) if name in DOMAINS else ""
                )
                texts.insert(row, new)
            if outer.rules:
                rules.insert(row, None)
        elif n_rows and (names := [name for name in columns if name in DOMAINS or name == "Enabled"]):
            name = rng.choice(names)
            columns[name][rng.randrange(n_rows)] = "False" if name == "Enabled" else drawing.cell(DOMAINS[name].kind)
    new = RandomTable("outer", columns, outer.settings, rules)
    return RandomProject({**project.tables, "outer": new}, project.derived, project.assume)
