"""What everything of a project is called in C. All names are found at once: none hangs on the order of tables or columns."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from unicodedata import normalize

from contextdb.cells.conditions import Condition
from contextdb.cells.outputs import Output
from contextdb.compiled.core_table import values_of
from contextdb.compiled.data import CompiledData
from contextdb.compiled.programs import named_conditions
from contextdb.errors import ContextDBError, Fault, safe_text

TABLE_ENDINGS = (
    *("", "_facts", "_condition", "_conditions", "_schema", "_missing", "_given", "_open", "_open_with", "_close"),
    *("_query", "_pick", "_penalties", "_why_not", "_watch", "_watch_file", "_watch_poll", "_watch_release", "_watch_close"),
)


@dataclass(frozen=True)
class Choices:
    """A condition's declared values in C: the type, the array of their names, and an enumerator for each."""

    type: str
    values: tuple[str, ...]
    enumerators: tuple[str, ...]
    missing: str

    @property
    def n_words(self) -> int:
        """Words of a set of tags; bit 0 says that the set is known."""
        return (len(self.values) + 1 + 63) // 64


@dataclass(frozen=True)
class OutputNames:
    """An output in C: what reads it, and its values where it is an enum."""

    name: str
    none: str
    enumerators: tuple[str, ...]


@dataclass(frozen=True)
class TableFace:
    """A table in C: what its names begin with, and the field of each condition."""

    table: str
    base: str
    fields: tuple[str, ...]
    """"" for a derived condition, which no field gives."""
    enumerators: tuple[str, ...]
    n_conditions: str
    """The enumerator behind the last."""
    outputs: tuple[OutputNames, ...]


@dataclass(frozen=True)
class Names:
    """All names of a header."""

    choices: Mapping[Condition, Choices]
    tables: Mapping[str, TableFace]
    guard: str

    @classmethod
    def of(cls, tables: Mapping[str, CompiledData], guard: str, taken: Collection[str]) -> Names:
        """Names for some tables, of which those that are taken are none."""
        declared = list(dict.fromkeys(c for table in tables.values() for c in conditions_of(table) if c.domain.values))
        types = distinct(
            [
                *(Wanted(name, "cdb_", TABLE_ENDINGS, of="table") for name in tables),
                *(Wanted(c.name, "cdb_", _endings(c), of=f"condition {c.domain.values}") for c in declared),
            ],
            taken,
        )
        table_types, choice_types = types[: len(tables)], types[len(tables) :]
        readers = distinct(
            [
                Wanted(output.name, f"{base}_out_", ("", "_value", "_values"), of=base)
                for base, table in zip(table_types, tables.values(), strict=True)
                for output in table.outputs.declared
            ],
            taken,
        )
        of_choices = [(type_, text) for type_, c in zip(choice_types, declared, strict=True) for text in _choice_texts(c)]
        of_facts = [(base, text) for base, table in zip(table_types, tables.values(), strict=True) for text in _facts(table)]
        outputs = [output for table in tables.values() for output in table.outputs.declared]
        given = [(name, text) for name, output in zip(readers, outputs, strict=True) for text in _given(output)]
        owned = [*of_choices, *of_facts, *given]
        wanted = [Wanted(text.removeprefix(_OWN), _head(of), is_upper=True, of=f"{of} {text}") for of, text in owned]
        unique = iter(distinct([*wanted, Wanted(guard.removeprefix("CDB_"), "CDB_", is_upper=True)], taken))
        choices = {c: _choices_of(c, type_, unique) for c, type_ in zip(declared, choice_types, strict=True)}
        faces = [_face_of(name, base, table, unique) for (name, table), base in zip(tables.items(), table_types, strict=True)]
        of_outputs = iter([_output_names(name, output, unique) for name, output in zip(readers, outputs, strict=True)])
        faces = [
            replace(face, outputs=tuple(next(of_outputs) for _ in table.outputs.declared))
            for face, table in zip(faces, tables.values(), strict=True)
        ]
        return cls(choices, {face.table: face for face in faces}, next(unique))


_OWN = "\0"
"""Before what is no name of the project."""


def _head(base: str) -> str:
    """What the enumerators of a type begin with."""
    return f"CDB_{upper(base.removeprefix('cdb_'))}_"


def _choice_texts(condition: Condition) -> list[str]:
    return [*([] if condition.domain.type.is_tags else [f"{_OWN}missing"]), *values_of(condition)]


def _facts(table: CompiledData) -> list[str]:
    return [*(c.name for c in conditions_of(table)), f"{_OWN}conditions"]


def _choices_of(condition: Condition, type_: str, names: Iterator[str]) -> Choices:
    missing = "" if condition.domain.type.is_tags else next(names)
    values = values_of(condition)
    return Choices(type_, values, tuple(next(names) for _ in values), missing)


def _face_of(name: str, base: str, table: CompiledData, names: Iterator[str]) -> TableFace:
    conditions = conditions_of(table)
    given = [c.name for c in conditions if c.expr is None]
    fields = dict(zip(given, distinct([Wanted(text) for text in given]), strict=True))
    enumerators = tuple(next(names) for _ in conditions)
    return TableFace(name, base, tuple(fields.get(c.name, "") for c in conditions), enumerators, next(names), ())


def _given(output: Output) -> list[str]:
    return [f"{_OWN}none", *output.values] if output.values else []


def _output_names(name: str, output: Output, names: Iterator[str]) -> OutputNames:
    none, *enumerators = [next(names) for _ in _given(output)] or [""]
    return OutputNames(name, none, tuple(enumerators))


def _endings(condition: Condition) -> tuple[str, ...]:
    return ("", "_set", "_values", "_none", "_add") if condition.domain.type.is_tags else ("", "_values")


def conditions_of(table: CompiledData) -> tuple[Condition, ...]:
    """The conditions of a table's schema: those of its columns, then the others that its rules and derived facts need."""
    return (*table.conditions, *(c for c in named_conditions(table.derivation, table.when) if c.name not in table.places))


# ---- names, texts and comments of a project, spelt so that no C or C++ compiler reads anything else into them. All is ASCII


MOST_LETTERS = 80
MOST_BYTES = 4000
"""C99 promises room for 4,095 characters in a text."""

_WORDS = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t char32_t class co_await
    co_return co_yield compl concept const const_cast consteval constexpr constinit continue decltype default delete do
    double dynamic_cast else enum explicit export extern false float for friend goto if import inline int long module
    mutable namespace new noexcept not not_eq nullptr operator or or_eq override final private protected public register
    reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast struct switch template
    this thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using virtual void volatile
    wchar_t while xor xor_eq near far huge interface small pascal cdecl fortran entry unix linux i386 vax sun sgi mips sparc
    arm min max errno assert signals slots emit foreach offsetof va_start va_end va_arg setjmp complex imaginary noreturn
    stdin stdout stderr I NULL EOF TRUE FALSE IN OUT OPTIONAL ERROR CONST VOID THIS DELETE BUFSIZ RAND_MAX SIZE_MAX
    WCHAR_MAX NAN INFINITY HUGE_VAL INT_MAX INT_MIN DBL_MAX FLT_MAX check verify nil YES NO
    """
RESERVED = frozenset(_WORDS.split())
"""Keywords of C and C++, and names that headers often make macros of."""


@dataclass(frozen=True)
class Wanted:
    """A name that is wanted for a text: "Defender.Tags" gives Defender_Tags, or in capitals DEFENDER_TAGS."""

    text: str
    prefix: str = ""
    endings: tuple[str, ...] = ("",)
    """What is put behind the name, so that each of these must be free."""
    is_upper: bool = False
    of: str = ""
    """What the text belongs to, where the same text is wanted for several things."""

    def name(self, n_digits: int) -> str:
        """The name, with so many digits of a hash of the text."""
        letters = _letters(self.text)
        stem = self.prefix + (upper(letters) if self.is_upper else letters)
        if not self.prefix and (stem in RESERVED or not stem[0].isalpha()):
            stem = f"{stem}_" if stem in RESERVED else f"n{stem}"
        digits = hashlib.blake2b(f"{self.of}\0{self.text}".encode("utf-8", "surrogatepass")).hexdigest()[:n_digits]
        return f"{stem.rstrip('_')}_{digits.upper() if self.is_upper else digits}" if digits else stem


def distinct(wanted: Sequence[Wanted], taken: Collection[str] = frozenset()) -> list[str]:
    """Names for texts, no two alike. A name that two texts would have, or that is taken, gets digits of a hash of its own text:
    which ones does not hang on their order."""
    n_digits = [0] * len(wanted)
    while True:
        names = [one.name(n) for one, n in zip(wanted, n_digits, strict=True)]
        whole = [[name + ending for ending in one.endings] for one, name in zip(wanted, names, strict=True)]
        claims = Counter(name for own in whole for name in own)
        clashes = [i for i, own in enumerate(whole) if any(claims[name] > 1 or name in taken for name in own)]
        if not clashes:
            return names
        for i in clashes:
            assert n_digits[i] < 128, wanted[i]
            n_digits[i] += 4


def upper(letters: str) -> str:
    """A name in capitals that keeps its word joints: IsInMidAirAnim gives IS_IN_MID_AIR_ANIM."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", letters).upper()


def _letters(text: str) -> str:
    """What of a text may be in a name, accents removed; two underlines on end belong to compilers."""
    plain = "".join(c for c in normalize("NFKD", text) if c.isascii())
    return re.sub(r"[^A-Za-z0-9]+", "_", plain)[:MOST_LETTERS].strip("_") or "unnamed"


def literal(text: str) -> str:
    """A text as C has it, in UTF-8. Raises ContextDBError where it is too long, or holds a NUL character."""
    octets = text.encode("utf-8", "surrogatepass")
    if 0 in octets:
        raise ContextDBError(Fault(f'the name "{safe_text(text)}" holds a NUL character.', "names that C can hold"))
    if len(octets) > MOST_BYTES:
        raise ContextDBError(
            Fault(f'the name "{safe_text(text)}" has {len(octets):,} bytes.', f"names of at most {MOST_BYTES:,} bytes")
        )
    return '"' + "".join(chr(b) if _is_plain(b) else f"\\{b:03o}" for b in octets) + '"'


def _is_plain(octet: int) -> bool:
    return 32 <= octet < 127 and chr(octet) not in '"\\?'


def comment(*parts: str, most: int = 200) -> str:
    """What the parts say as one comment; nothing in them ends it, or begins another."""
    text = safe_text(" ".join(part for part in parts if part), most).encode("ascii", "backslashreplace").decode("ascii")
    return f"/* {re.sub(r'[?](?=[?])', '? ', text.replace('*/', '* /').replace('/*', '/ *'))} */"
