"""Names, texts and comments of a project, spelt so that no C or C++ compiler reads anything else into them. All is ASCII."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from unicodedata import normalize

from contextdb.errors import ContextDBError, Fault, shown

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


@dataclass
class Names:
    """Names that are given once each."""

    taken: set[str] = field(default_factory=set)

    def of(self, text: str, prefix: str = "", endings: tuple[str, ...] = ("",), is_upper: bool = False) -> str:
        """A name like the text, with a prefix, of which no ending is taken: "Defender.Tags" gives Defender_Tags."""
        stem = prefix + _letters(text)
        stem = stem.upper() if is_upper else stem
        if not prefix and (stem in RESERVED or not stem[0].isalpha()):
            stem = f"{stem}_" if stem in RESERVED else f"n{stem}"
        number, name = 1, stem
        while any(name + ending in self.taken for ending in endings):
            number, name = number + 1, f"{stem.rstrip('_')}_{number + 1}"
        self.taken.update(name + ending for ending in endings)
        return name


def _letters(text: str) -> str:
    """What of a text may be in a name, accents removed; two underlines on end belong to compilers."""
    plain = "".join(c for c in normalize("NFKD", text) if c.isascii())
    return re.sub(r"[^A-Za-z0-9]+", "_", plain)[:MOST_LETTERS].strip("_") or "unnamed"


def literal(text: str) -> str:
    """A text as C has it, in UTF-8.

    Raises
    ------
    ContextDBError
        It is too long, or holds a NUL character.
    """
    octets = text.encode("utf-8", "surrogatepass")
    if 0 in octets:
        raise ContextDBError(Fault(f'the name "{shown(text)}" holds a NUL character.', "names that C can hold"))
    if len(octets) > MOST_BYTES:
        raise ContextDBError(
            Fault(f'the name "{shown(text)}" has {len(octets):,} bytes.', f"names of at most {MOST_BYTES:,} bytes")
        )
    return '"' + "".join(chr(b) if _is_plain(b) else f"\\{b:03o}" for b in octets) + '"'


def _is_plain(octet: int) -> bool:
    return 32 <= octet < 127 and chr(octet) not in '"\\?'


def comment(*parts: str, most: int = 200) -> str:
    """What the parts say as one comment; nothing in them ends it, or begins another."""
    said = shown(" ".join(part for part in parts if part), most).encode("ascii", "backslashreplace").decode("ascii")
    return f"/* {re.sub(r'[?](?=[?])', '? ', said.replace('*/', '* /').replace('/*', '/ *'))} */"
