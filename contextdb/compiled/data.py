"""Compile a table into bitmasks, and look contexts up in them.

Each condition's domain is cut into the fewest classes its column distinguishes; each class keeps one bit a row. A query finds the
class of every fact and ANDs the masks, so its cost grows with conditions x rows / 64 and not with how the cells are written.

W = ceil(n_rows / 64). Bit r % 64 of word r // 64 is row r; bits past the last row are 0, always. A compiled table is never
changed and may be asked from several threads. Nothing here reads a file, prints, or looks at the clock.

Source: Lakshman and Stiliadis, "High-speed policy-based packet forwarding using efficient multi-dimensional range matching",
SIGCOMM 1998.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words, read_only
from contextdb.cells.arguments import require_row
from contextdb.cells.conditions import Condition
from contextdb.cells.facts import Context, Fact, Unknown, check_mode, missing_error, misspelt, read_fact, require_context
from contextdb.cells.grammar import parse_cell, reads
from contextdb.cells.mirroring import changed_in_mirror, frozen_facts, in_mirror, mirrored_facts, widened_fact, with_hysteresis
from contextdb.cells.notebook import one_line
from contextdb.cells.sets import ANY, Cell
from contextdb.columns import TextColumn
from contextdb.compiled.classes import ColumnMasks, NumberCells, NumberMasks, WideMasks, number_cells
from contextdb.compiled.codes import CodeSlots
from contextdb.compiled.core_table import UNKNOWN, core_table
from contextdb.compiled.layers import SoftMasks, bits_of, nbytes
from contextdb.compiled.matches import Answering, Matches, with_mirrored, with_penalties, with_widened
from contextdb.compiled.memory import Memory
from contextdb.compiled.outputs import NO_OUTPUTS, Outputs
from contextdb.compiled.pick_columns import NOTHING, PickColumns
from contextdb.compiled.unchanging import Unchanging
from contextdb.compiled.versions import said_by, version_of
from contextdb.compiled.watcher import Watcher
from contextdb.compiled.ways import Step, Ways
from contextdb.core import Table
from contextdb.errors import ContextError, Fault, Place, in_quotes, plural
from contextdb.schema.policies import Policy, ranks_of

if TYPE_CHECKING:
    from contextdb.expressions import Derivation
    from contextdb.expressions.rules import WhenRules

Made = TypeVar("Made")
Change = Callable[[Fact, Condition], Fact]
StraightAsk = Callable[[Context], Matches | None]
"""Answers a context; None where the careful way must decide."""


def as_given(fact: Fact, condition: Condition) -> Fact:
    return fact


@dataclass(frozen=True, eq=False, repr=False)
class CompiledData(Unchanging):
    """A table as masks: what every way to ask it needs. `CompiledTable` holds it and has the ways.

    It can be pickled at any time. The copy gives the same answers; only the memory of `pick` is not pickled.
    """

    name: str
    assets: Sequence[str]
    conditions: tuple[Condition, ...]
    masks: tuple[ColumnMasks, ...]
    """One for each condition."""
    enabled: Words
    """The rows that may match at all."""
    soft: tuple[SoftMasks | None, ...]
    """For each condition with soft cells: what its rows cost; None for the others."""
    priorities: NDArray[np.int64]
    row_weights: NDArray[np.float64]
    texts: tuple[TextColumn, ...]
    """The cells of each condition as they are written, for explanations."""
    policy: Policy = "collect"
    fallback: str | None = None
    derivation: Derivation | None = None
    """How the conditions that are derived are computed; None where none is."""
    slots: tuple[TextColumn, ...] | None = None
    """The outputs that say which roles a row fills, as far as the table has them; None where that is not known."""
    when: WhenRules | None = None
    """The rows' own rules; None where no row has one."""
    ways: Ways | None = None
    """The way of each row through tables inside tables; None for a table without."""
    declared: frozenset[str] = frozenset()
    """Conditions the project declares. A fact with one of these names belongs to another table; it is not a typo."""
    outputs: Outputs = NO_OUTPUTS
    """What the rows give the game besides their assets; one without columns where the table has none."""
    picking: PickColumns = NOTHING
    """How specific the rows are, and how long they rest; nothing for a table with tables inside, whose `ways` say it."""
    _ask: StraightAsk = field(init=False, repr=False)
    _watcher: Watcher | None = field(init=False, repr=False)
    """Learns of the questions that a game asks, and of its picks: set by the link that watches the table."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "_ask", self._build_and_ask)  # a plain attribute: the way of every query
        object.__setattr__(self, "_watcher", None)
        read_only(self.priorities)
        read_only(self.row_weights)

    @property
    def n_rows(self) -> int:
        return len(self.assets)

    def __repr__(self) -> str:
        return self.described(type(self).__name__)

    def described(self, kind: str) -> str:
        """What it is, in one line: as what, its name, and its size."""
        size = f"{plural(self.n_rows, 'row')} x {plural(len(self.conditions), 'condition')}, {plural(self.nbytes, 'byte')}"
        return one_line(kind, self.name, size)

    @property
    def leaves(self) -> Sequence[str]:
        """The asset of each row, without the path that it has in a table inside the table."""
        return self.assets if self.ways is None else self.ways.leaves

    def way(self, row: int) -> tuple[Step, ...]:
        """The rows of tables that a row comes from, outermost first, each with its file and line; for a table without tables inside
        one step, the row itself. Raises NoSuchPlace for a row that there is not."""
        row = require_row(row, self.n_rows)
        if self.ways is not None:
            return self.ways.steps(row)
        return (Step(self.name, row, self.assets[row], Place(row=row)),)

    @cached_property
    def asked(self) -> dict[str, Condition]:
        """The conditions whose facts a caller gives: those of the table and of its rules, and for derived ones those that they are
        computed from."""
        derived, inputs = (self.derivation.names, self.derivation.inputs) if self.derivation else ((), ())
        return {c.name: c for c in (*self.conditions, *inputs, *self.ruled) if c.name not in derived}

    @cached_property
    def ruled(self) -> tuple[Condition, ...]:
        """The conditions that rules name and that are not columns of the table."""
        return tuple(c for c in self.when.conditions if c.name not in self.places) if self.when else ()

    @cached_property
    def enabled_bits(self) -> int:
        """The rows that may match at all, as an integer."""
        return bitmask.to_int(self.enabled)

    def query(self, context: Context, unknown: Unknown = "error") -> Matches:
        """Find the rows whose every cell accepts its fact; see `CompiledTable.query`, which casts actors too."""
        if unknown != "error":
            check_mode(unknown)
        try:
            answer = self._ask(context)
            if answer is None and unknown != "error":
                answer = self.core.query(context, UNKNOWN[unknown])
                return self.bound(answer, context, unknown) if answer is not None else self.query_with_care(context, unknown)
        except Exception:  # no mapping, which can raise anything, or a fault of ours
            require_context(context)
            raise
        if answer is None:
            return self.query_with_care(context, unknown)
        return answer if unknown == "error" or not self.keeps_facts else self.with_others(answer, context, unknown)

    def query_with_care(self, context: Context, unknown: Unknown = "error") -> Matches:
        """What is unusual in a context read once more, slowly: this answers it or says what is wrong."""
        answer = self.matches(*self._bits_carefully(context, unknown))
        return self.bound(answer, frozen_facts(context), unknown) if self.is_bound else answer

    @cached_property
    def ranks(self) -> NDArray[np.float64]:
        """What the policy ranks rows by before chance, apart from costs, higher first: float64 [n_rows]; for a table without tables
        inside."""
        return read_only(ranks_of(self.policy, self.priorities, self.picking.specificities))

    @property
    def policies(self) -> frozenset[str]:
        return frozenset((self.policy,) if self.ways is None else (table.policy for table in self.ways.tables))

    def plain_penalties(self, context: Context, unknown: Unknown = "error") -> NDArray[np.float64]:
        """What each row's soft cells cost without actors: float64 [n_rows], the sum of the penalties of those that do not match.

        A soft cell whose fact is missing costs nothing with unknown="any", its penalty with "never". A set-valued fact costs
        nothing where some value of the set matches. Raises what `query` raises.
        """
        costs: NDArray[np.float64] = self.layered_penalties(context, unknown).sum(axis=0)
        return costs

    def layered_penalties(self, context: Context, unknown: Unknown = "error", change: Change = as_given) -> NDArray[np.float64]:
        """The same for the cells of each depth: float64 [D, n_rows]; D is 1 for a table without tables inside. `change` is what
        becomes of each fact before it is looked up."""
        costs = np.zeros((self.n_depths, self.n_rows))
        if not self.is_soft:
            return costs
        check_mode(unknown)
        if change is as_given and self.core.penalties(context, UNKNOWN[unknown], costs):
            return costs
        facts = self.read_context(context, unknown)
        for at, condition in enumerate(self.conditions):
            if self.soft[at] is not None:
                costs += self.column_penalties(at, change(facts[condition.name], condition), unknown)
        return costs

    @property
    def n_depths(self) -> int:
        """How many tables are in each other: D, 1 for a table without tables inside."""
        return 1 if self.ways is None else len(self.ways.rows)

    def column_penalties(self, at: int, fact: Fact, unknown: Unknown) -> NDArray[np.float64]:
        """What the soft cells of one condition cost with a fact in canonical form: float64 [D, n_rows]."""
        soft = self.soft[at]
        if soft is None or (fact is None and unknown == "any"):
            return np.zeros((self.n_depths, self.n_rows))
        return soft.costs(fact).reshape(self.n_depths, self.n_rows)

    @cached_property
    def mirroring(self) -> dict[str, Condition]:
        """The conditions of `asked` whose facts change in a mirror."""
        return changed_in_mirror(self.asked.values())

    @cached_property
    def widening(self) -> dict[str, Condition]:
        """The columns whose cells are widened for what plays already."""
        return with_hysteresis(self.conditions)

    def query_widened(self, context: Context, unknown: Unknown = "error") -> Matches:
        """The answer to a context with its facts widened, see `contextdb.cells.mirroring`. What is derived is computed from the
        facts themselves and then widened; rules see no widened facts."""
        bits, always = self._bits_widened(context, unknown) or self._bits_carefully(context, unknown, widened_fact)
        answer = self.matches(bits, always)
        if self.mirroring:
            with_mirrored(answer, lambda: self.query_widened(mirrored_facts(context, self.mirroring), unknown))
        return with_penalties(answer, partial(self.layered_penalties, context, unknown, widened_fact)) if self.is_soft else answer

    def _bits_widened(self, context: Context, unknown: Unknown) -> tuple[int, int] | None:
        """Rows that may and that always match with facts widened, where all facts are plain and none is computed; else None."""
        rest: Matches | None = None if self.when or self.derivation else self._core_without_widened.query(context, UNKNOWN[unknown])
        if rest is None:
            return None
        some = every = rest.bits
        for name, condition in self.widening.items():
            fact = read_fact(context.get(name), condition)
            if fact is None and unknown == "error":
                return None
            one, all_ = self.condition_bits(self.places[name], widened_fact(fact, condition), unknown)
            some &= one
            every &= all_
        return some, every

    @cached_property
    def _core_without_widened(self) -> Table:
        """The table as the core has it, with none of the columns whose cells are widened."""
        columns = [(c, m) for c, m in zip(self.conditions, self.masks, strict=True) if c.name not in self.widening]
        return core_table(columns, self.enabled, self.answering, None, None)

    def query_mirrored(self, context: Context, unknown: Unknown = "error") -> Matches:
        """The answer to a context as a mirror shows it. What is derived is computed from mirrored facts."""
        try:
            return self.query(mirrored_facts(context, self.mirroring), unknown=unknown)
        except ContextError as error:
            raise in_mirror(error) from None

    def bound(self, matches: Matches, context: Context, unknown: Unknown = "error") -> Matches:
        """An answer that knows what else hangs on the facts of its moment: what soft cells cost, and the answer in a mirror."""
        if self.keeps_facts:
            self.with_others(matches, context, unknown)
        return with_penalties(matches, partial(self.layered_penalties, self.keep(context), unknown)) if self.is_soft else matches

    def with_others(self, matches: Matches, context: Context, unknown: Unknown) -> Matches:
        """An answer that knows what its context answers in a mirror, and with widened facts."""
        if self.mirroring:
            with_mirrored(matches, self.keeping(unknown)(context))
        return with_widened(matches, partial(self.query_widened, self.keep(context), unknown)) if self.widening else matches

    def keeping(self, unknown: Unknown) -> Callable[[Context], dict[str, object] | Callable[[], Matches]]:
        """What makes of a context that an answer was asked with what `with_mirrored` takes."""
        return self.keep if unknown == "error" else lambda context: partial(self.query_mirrored, self.keep(context), unknown)

    @cached_property
    def keep(self) -> Callable[[Context], dict[str, object]]:
        """What copies a context, so that it stays as it is now."""
        return frozen_facts if any(c.domain.type.is_tags for c in self.asked.values()) else dict

    @cached_property
    def is_soft(self) -> bool:
        return any(self.soft)

    @cached_property
    def keeps_facts(self) -> bool:
        """Whether other questions hang on the facts of an answer: those in a mirror, and with widened facts."""
        return bool(self.mirroring) or bool(self.widening)

    @cached_property
    def is_bound(self) -> bool:
        """Whether answers must keep the facts that they were asked with."""
        return self.is_soft or self.keeps_facts

    def cells(self, at: int) -> tuple[Cell, ...]:
        """What the distinct texts of condition number `at` mean, read once; Any for one that cannot be read, which no row holds."""
        if at not in self._cells_read:
            domain = self.conditions[at].domain
            layers = None if self.ways is None else self.ways.layers[at]
            if layers is not None:
                self._cells_read[at] = layers.cells(domain)
                return self._cells_read[at]
            self._cells_read[at] = tuple(parse_cell(t, domain) if reads(t, domain) else ANY for t in self.texts[at].texts)
        return self._cells_read[at]

    @cached_property
    def _cells_read(self) -> dict[int, tuple[Cell, ...]]:
        return {}

    def read_context(self, context: Context, unknown: Unknown = "error", names: Sequence[str] | None = None) -> dict[str, Fact]:
        """The fact of every condition, or of those named, in canonical form, None where it is missing; raises ContextError as
        `query` does."""
        check_mode(unknown)
        require_context(context)
        facts: dict[str, Fact] = {}
        faults: list[Fault] = []
        derived: Mapping[str, object] = {}
        derivation = None if self.derivation is None else self.derivation if names is None else self.derivation.only(names)
        try:
            if derivation is not None:
                derived = derivation.compute(context)
        except ContextError as error:
            faults += error.faults
        for condition in (*self.conditions, *self.ruled) if names is None else (self._condition_named(n) for n in names):
            name = condition.name
            try:
                facts[name] = read_fact(derived.get(name) if name in derived else context.get(name), condition)
            except ContextError as error:
                faults += [fault for fault in error.faults if fault not in faults]
        if faults:
            raise ContextError(*faults)
        missing = [name for name, fact in facts.items() if fact is None]
        if derivation is not None:
            missing += [name for name in derivation.missing(context) if name not in missing]
        if missing:
            self.refuse_missing(missing, context, unknown)
        return facts

    def refuse_missing(self, missing: Sequence[str], context: Context, unknown: Unknown) -> None:
        """Raise ContextError for missing facts of conditions and of what is computed, unless they are treated in another way; a
        misspelt one always."""
        derivation = self.derivation
        plain = [name for name in missing if derivation is None or name not in derivation.names]
        extra = [name for name in context if name not in self.asked]
        if slip := misspelt(plain, [name for name in extra if name not in self.declared]):
            raise slip
        if unknown == "error" and derivation is not None and not plain:
            raise derivation.no_value(missing[0], context)
        if unknown == "error":
            raise missing_error(plain, extra)

    def accepting(self, facts: Mapping[str, Fact], unknown: Unknown) -> Words:
        """The rows whose cell of a condition accepts some value of its fact: uint64 [conditions, W]. Facts are in canonical form,
        computed ones too."""
        words = np.empty((len(self.conditions), bitmask.n_words(self.n_rows)), np.uint64)
        given = {name: facts[name] for name in self.asked if facts.get(name) is not None}
        if self.derivation is not None or not self.core.accepting(given, UNKNOWN[unknown], words):
            for at, condition in enumerate(self.conditions):
                words[at] = bitmask.from_int(self.condition_bits(at, facts[condition.name], unknown)[0], self.n_rows)
        return words

    def condition_bits(self, at: int, fact: Fact, unknown: Unknown = "error") -> tuple[int, int]:
        """Rows whose cell accepts some, and rows whose cell accepts every, value of a fact in canonical form."""
        return self._all_bits if fact is None and unknown == "any" else bits_of(self.masks[at], fact)

    def matches(self, bits: int, always: int | None = None) -> Matches:
        """An answer of this table from its rows as an integer."""
        return self.answering.answer(bits, bits if always is None else always)

    @cached_property
    def places(self) -> dict[str, int]:
        return {c.name: at for at, c in enumerate(self.conditions)}

    @cached_property
    def codes(self) -> CodeSlots:
        return CodeSlots(self.masks, self.enabled, self.n_rows)

    @cached_property
    def number_cells(self) -> tuple[NumberCells | None, ...]:
        """For each column of numbers what finds the classes of many; None for others, and where bounds lie too near each other."""
        return tuple(number_cells(m.bounds) if isinstance(m, (NumberMasks, WideMasks)) else None for m in self.masks)

    @property
    def nbytes(self) -> int:
        return sum(nbytes(m) for m in self.masks)

    def once(self, make: Callable[[Self], Made]) -> Made:
        """What a function makes of this table, made when it is first asked for."""
        made = self._made
        if make not in made:
            made[make] = make(self)
        known: Made = made[make]
        return known

    @cached_property
    def _made(self) -> dict[Callable[[Self], Any], Any]:
        return {}

    @cached_property
    def memory(self) -> Memory:
        """Which asset each random generator picked last."""
        memory: Memory = self.__dict__.setdefault("memory", Memory())  # one, whichever thread comes first
        return memory

    def remember_as(self, older: CompiledData) -> None:
        """Go on with what an older version of this table remembers of picks: no asset is repeated for a reload."""
        self.__dict__["memory"] = older.memory

    @property
    def version(self) -> str:
        """A digest of the table's contents: the same for two tables with the same contents, wherever they were compiled."""
        return self.answering.version

    @cached_property
    def answering(self) -> Answering:
        """What the answers of this table share."""
        ask_mirrored = self.query_mirrored if self.mirroring else None
        version = partial(version_of, said_by(self))
        own = Answering(self.assets, self.leaves, self.name, version, ask_mirrored, outputs=self.outputs, asked_of=self)
        answering: Answering = self.__dict__.setdefault("answering", own)  # one, whichever thread comes first
        return answering

    @cached_property
    def _all_bits(self) -> tuple[int, int]:
        everything = (1 << self.n_rows) - 1
        return everything, everything

    @cached_property
    def core(self) -> Table:
        columns = list(zip(self.conditions, self.masks, strict=True))
        core = core_table(columns, self.enabled, self.answering, self.derivation, self.when, self.soft)
        core.is_watched = self._watcher is not None
        return core

    def watch(self, watcher: Watcher | None) -> None:
        """Let a watcher learn of all questions and picks from now on; None for nobody."""
        object.__setattr__(self, "_watcher", watcher)
        if "core" in self.__dict__:
            self.core.is_watched = watcher is not None

    def _build_and_ask(self, context: Context) -> Matches | None:
        """The first question makes what answers all others."""
        ask: StraightAsk = self._binding(self.core.query) if self.is_bound else self.core.query
        object.__setattr__(self, "_ask", ask)
        return ask(context)

    def _binding(self, ask: StraightAsk) -> StraightAsk:
        is_only_mirrored, keep = bool(self.mirroring) and not self.widening and not self.is_soft, self.keep

        def bound(context: Context) -> Matches | None:
            answer = ask(context)
            if answer is None:
                return None
            return with_mirrored(answer, keep(context)) if is_only_mirrored else self.bound(answer, context)

        return bound

    def _bits_carefully(self, context: Context, unknown: Unknown, change: Change = as_given) -> tuple[int, int]:
        facts = self.read_context(context, unknown)
        some_bits = every = self.enabled_bits
        for at, condition in enumerate(self.conditions):
            one, all_ = self.condition_bits(at, change(facts[condition.name], condition), unknown)
            some_bits &= one
            every &= all_
        return (some_bits, every) if self.when is None else self.when.left_with_care(some_bits, every, facts, unknown)

    def _condition_named(self, name: str) -> Condition:
        if name in self.places:
            return self.conditions[self.places[name]]
        derived = self.derivation.conditions if self.derivation else ()
        return next(c for c in (*self.ruled, *derived) if c.name == name)

    def refuse_rules(self, why: str) -> None:
        """Raise ContextError for a table with rules."""
        if self.when is not None:
            raise ContextError(Fault(f"the table {in_quotes(self.name)} has rules: {why}.", "query, query_many or live"))
