"""Picks, one row at a time and in the plainest way: what `Picker`, `pick` and `Outcome` are held to.

Tables are lists of rows with the meaning of their cells written out here; nothing of how contextdb reads, compiles, ranks or keeps
is used, nor its chance.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

from hypothesis import strategies as st

from contextdb.schema.settings import TableSettings
from contextdb.tables.table import Table

CHANCE = ("collect", "priority", "specific", "cheapest")
CELLS: dict[str, dict[str, Callable[[object], bool]]] = {
    "flag": {"Any": lambda f: True, "True": lambda f: f is True, "False ~3": lambda f: f is False, "": lambda f: True},
    "gait": {"Any": lambda f: True, "Walk": lambda f: f == "Walk", "not Walk": lambda f: f != "Walk"},
    "speed": {"Any": lambda f: True, "0..5": lambda f: 0 <= f <= 5, ">2 ~1.5": lambda f: f > 2, "<=1 ~1.5": lambda f: f <= 1},
}
RULES = {"": lambda facts: True, "speed > 1": lambda facts: facts["speed"] > 1}
CONDITIONS = {
    "flag": {"type": "bool"},
    "gait": {"type": "enum", "values": ["Walk", "Run"], "weight": 2.5},
    "speed": {"type": "number", "weight": 0.5},
}
ANY = ("Any", "")
Facts = Mapping[str, object]
Path = tuple[tuple[str, int], ...]
"""The rows of a way: the name of each table, and the row."""


def uniform(seed: int, who: int, turn: int, depth: int) -> float:
    """A number in [0, 1) by the mixing step of SplitMix64: the same for the same seed, character, turn and depth."""
    z, all_bits = seed, 2**64 - 1
    for part in (who, turn, depth):
        z = (z + (part + 1) * 0x9E3779B97F4A7C15) & all_bits
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & all_bits
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & all_bits
        z ^= z >> 31
    return (z >> 11) * 2.0**-53


@dataclass(frozen=True)
class Row:
    asset: str
    cells: Mapping[str, str]
    rule: str = ""
    priority: int = 0
    weight: float = 1.0
    once: bool = False
    cooldown_s: float = 0.0
    cooldown_turns: int = 0

    def holds(self, facts: Facts) -> bool:
        hard = all("~" in text or CELLS[name][text](facts[name]) for name, text in self.cells.items())
        return hard and RULES[self.rule](facts)

    def cost(self, facts: Facts) -> float:
        soft = [(name, text) for name, text in self.cells.items() if "~" in text]
        return sum(float(text.split("~")[1]) for name, text in soft if not CELLS[name][text](facts[name]))

    @property
    def is_limited(self) -> bool:
        return self.once or self.cooldown_s > 0 or self.cooldown_turns > 0

    @property
    def specificity(self) -> Fraction:
        said = [name for name, text in self.cells.items() if text not in ANY and "~" not in text]
        return sum((Fraction(repr(CONDITIONS[name].get("weight", 1.0))) for name in said), Fraction(bool(self.rule)))


@dataclass(frozen=True)
class Rows:
    """A table."""

    name: str
    policy: str
    rows: tuple[Row, ...]
    fallback: str | None = None

    def table(self) -> Table:
        columns = {"Asset": [row.asset for row in self.rows]}
        columns |= {name: [row.cells[name] for row in self.rows] for name in CELLS}
        columns |= {
            "Rule": [row.rule for row in self.rows],
            "P": [str(row.priority) for row in self.rows],
            "W": [str(row.weight) for row in self.rows],
            "Once": ["True" if row.once else "" for row in self.rows],
            "Seconds": [str(row.cooldown_s) for row in self.rows],
            "Turns": [str(row.cooldown_turns) if row.cooldown_turns else "" for row in self.rows],
        }
        jobs = {"priority": "P", "weight": "W", "once": "Once", "cooldown_s": "Seconds", "cooldown_turns": "Turns", "when": "Rule"}
        settings = TableSettings(self.name, policy=self.policy, fallback=self.fallback, **jobs)  # type: ignore[arg-type]
        return Table.from_columns(columns, CONDITIONS, settings, self.name)

    def key(self, row: int) -> tuple[str, str, int]:
        """A row by what stays: the table, the asset, and how many rows of that asset are above."""
        asset = self.rows[row].asset
        return self.name, asset, sum(one.asset == asset for one in self.rows[:row])


@dataclass(frozen=True)
class Tables:
    """A table, and one that may stand in it."""

    outer: Rows
    inner: Rows

    def compile(self):
        return self.outer.table().compile({"inner": self.inner.table()})

    @property
    def needs_time(self) -> bool:
        used = (self.outer, self.inner) if any(row.asset == "@inner" for row in self.outer.rows) else (self.outer,)
        return any(row.cooldown_s > 0 for table in used for row in table.rows)


class NotUnique(Exception):
    pass


@dataclass
class Character:
    """What one character has picked."""

    seed: int
    who: int
    memory: int
    turn: int = 0
    recent: list[str] = field(default_factory=list)
    picked: dict[tuple[str, str, int], tuple[int, float]] = field(default_factory=dict)

    def rests(self, table: Rows, row: int, time_s: float) -> bool:
        one = table.rows[row]
        if table.key(row) not in self.picked:
            return False
        turn, time = self.picked[table.key(row)]
        return one.once or self.turn <= turn + one.cooldown_turns or (one.cooldown_s > 0 and time_s < time + one.cooldown_s)

    def is_over(self, tables: Tables, key: tuple[str, str, int], time_s: float) -> bool:
        """Whether a row of these tables does not rest any more; it is forgotten then."""
        rows = [(table, row) for table in used(tables) for row in range(len(table.rows)) if table.key(row) == key]
        return any(table.rows[row].is_limited and not self.rests(table, row, time_s) for table, row in rows)

    def pick(self, tables: Tables, facts: Facts, time_s: float) -> Path | None:
        """What the character picks, and remembers."""
        ways = possible(tables, facts, lambda table, row: self.rests(table, row, time_s))
        if any(table.policy in CHANCE for table in used(tables)):
            ages = [self.recent.index(name_of(tables, way)) if name_of(tables, way) in self.recent else self.memory for way in ways]
            ways = [way for way, age in zip(ways, ages, strict=True) if age == max(ages)]
        depth = 0
        while len(ways) > 1:
            rows = list(dict.fromkeys(way[depth] for way in ways))
            chance = uniform(self.seed, self.who, self.turn, depth)
            weights = [weight_of(tables, *row) for row in rows]
            sums = [sum(w / max(weights) for w in weights[: i + 1]) for i in range(len(weights))]
            hit = next((row for row, total in zip(rows, sums, strict=True) if chance * sums[-1] < total), rows[-1])
            ways = [way for way in ways if way[depth] == hit]
            depth += 1
        self.picked = {key: at for key, at in self.picked.items() if not self.is_over(tables, key, time_s)}
        if ways:
            self.recent = [name_of(tables, ways[0]), *self.recent][: self.memory]
            for name, row in ways[0]:
                table = tables.outer if name == "outer" else tables.inner
                if table.rows[row].is_limited:
                    self.picked[table.key(row)] = self.turn, time_s
        self.turn += 1
        return ways[0] if ways else None


def used(tables: Tables) -> list[Rows]:
    inside = any(row.asset == "@inner" for row in tables.outer.rows)
    return [tables.outer, tables.inner] if inside else [tables.outer]


def weight_of(tables: Tables, name: str, row: int) -> float:
    table = tables.outer if name == "outer" else tables.inner
    return table.rows[row].weight if table.policy in CHANCE else 1.0


def name_of(tables: Tables, way: Path) -> str:
    """An asset with its path, as a table with tables inside names it."""
    name, row = way[-1]
    asset = (tables.outer if name == "outer" else tables.inner).rows[row].asset
    return asset if len(way) == 1 else "/".join([*(name for name, _ in way), asset])


def possible(tables: Tables, facts: Facts, rests: Callable[[Rows, int], bool] = lambda table, row: False) -> list[Path]:
    """The ways that the policies may pick, in the order of the files."""

    def able(table: Rows) -> dict[int, dict | None]:
        """The rows that have a row to give, each with those behind it."""
        found: dict[int, dict | None] = {}
        for number, row in enumerate(table.rows):
            if not row.holds(facts) or rests(table, number) or (table.policy in CHANCE and row.weight == 0):
                continue
            behind = able(tables.inner) if row.asset == "@inner" else None
            if behind != {}:
                found[number] = behind
        return found

    def preferred(table: Rows, options: Mapping[int, dict | None]) -> list[Path]:
        if not options:
            return []
        if table.policy == "unique" and len(options) > 1:
            raise NotUnique
        rank = {
            "first": lambda n: -n,
            "specific": lambda n: (table.rows[n].priority, table.rows[n].specificity),
            "cheapest": lambda n: (table.rows[n].priority, -table.rows[n].cost(facts)),
        }.get(table.policy, lambda n: table.rows[n].priority)
        best = max(map(rank, options))
        ways: list[Path] = []
        for number, behind in options.items():
            if rank(number) == best:
                rest = [()] if behind is None else preferred(tables.inner, behind)
                ways += [((table.name, number), *way) for way in rest]
        return ways

    return preferred(tables.outer, able(tables.outer))


# ---- examples

FACTS = st.fixed_dictionaries(
    {"flag": st.booleans(), "gait": st.sampled_from(["Walk", "Run"]), "speed": st.sampled_from([0.0, 1.0, 1.5, 3.0, 5.0, 7.0])}
)


@st.composite
def row_lists(draw: st.DrawFn, assets: Sequence[str], most: int) -> tuple[Row, ...]:
    limits = draw(st.booleans())
    found = []
    for _ in range(draw(st.integers(1, most))):
        cells = {name: draw(st.sampled_from([*texts, "Any", "Any"])) for name, texts in CELLS.items()}
        row = Row(
            draw(st.sampled_from(assets)),
            cells,
            draw(st.sampled_from(["", "", "speed > 1"])),
            draw(st.sampled_from([0, 0, 0, 1, -2])),
            draw(st.sampled_from([1.0, 1.0, 2.5, 0.1, 0.0])),
        )
        if limits:
            row = replace(
                row,
                once=draw(st.sampled_from([False, False, True])),
                cooldown_s=draw(st.sampled_from([0.0, 0.0, 1.5])),
                cooldown_turns=draw(st.sampled_from([0, 0, 1, 3])),
            )
        found.append(row)
    return tuple(found)


POLICIES = st.sampled_from(["first", "unique", "collect", "priority", "specific", "specific", "cheapest", "cheapest"])


@st.composite
def tables(draw: st.DrawFn) -> Tables:
    """Two tables; the outer one may have the other in it, more than once."""
    inside = ["@inner"] if draw(st.booleans()) else []
    outer = draw(row_lists(["a", "b", "c", "d", "e", *inside], 7))
    fallback = draw(st.sampled_from([None, "idle"]))
    inner = Rows("inner", draw(POLICIES), draw(row_lists(["a", "f", "g"], 4)))
    return Tables(Rows("outer", draw(POLICIES), outer, fallback), inner)


def edited(draw: st.DrawFn, before: Tables) -> Tables:
    """A newer version: rows in another order, some gone, some new."""
    rows = draw(st.permutations(before.outer.rows))
    rows = (*rows[: draw(st.integers(1, len(rows)))], *draw(row_lists(["a", "x", "y"], 2)))
    return replace(before, outer=replace(before.outer, rows=tuple(rows)))
