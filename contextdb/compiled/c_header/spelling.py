"""Names, texts and comments of a project, spelt so that no C or C++ compiler reads anything else into them. All is ASCII."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from unicodedata import normalize

from contextdb.errors import ContextDBError, Fault, safe_text

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
