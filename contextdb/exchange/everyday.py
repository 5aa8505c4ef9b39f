"""Words that people write in sheets where a table of ours has its own: truths, "does not matter", totals, weight and priority.

German, French, Spanish, Italian, Portuguese, Dutch, Polish and the languages of the north, beside English. A word is only looked up
where the rest of its column agrees, and what became of it is said.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from contextdb.cells.domains import BOOL
from contextdb.cells.grammar import reads
from contextdb.cells.words import says_any
from contextdb.columns import TextColumn


def _each(words: str, meaning: str) -> dict[str, str]:
    return dict.fromkeys(words.split(), meaning)


TRUTHS = {
    **_each("x ✓ ✔ ☑ ✅ wahr vrai vero verdadero verdadeiro waar prawda sant sann ja oui sì sí si sim tak", "True"),
    **_each("✗ ✘ ☐ ❌ ✖ falsch faux falso onwaar fałsz falsk nein non não nao nee nie nei nej", "False"),
}
MATTERS_NOT = frozenset(
    _each("n/a n.a. n.a k.a. – — * egal beliebig indifférent cualquiera qualquer qualsiasi willekeurig dowolny", "Any")
)
SUMS = frozenset(
    {
        **_each("total totals sum average mean count summe gesamt gesamtsumme mittelwert durchschnitt anzahl somme moyenne", ""),
        **_each("suma promedio somma media totale soma média totaal gemiddelde razem średnia summa medel", ""),
        "grand total": "",
    }
)
JOB_WORDS = {
    **_each("weight weights gewicht gewichtung poids pondération peso ponderación ponderação weging waga vikt vægt vekt", "weight"),
    **_each("priority prio priorität prioritaet priorité prioridad prioridade priorità prioriteit priorytet prioritet", "priority"),
    **_each("enabled aktiv aktiviert activé actif activado activo attivo ativo actief ingeschakeld aktywny", "enabled"),
}
"""A name of a column, folded, and the job that it has in those languages."""

_ENDS = (
    ("min", "max"), ("minimum", "maximum"), ("mini", "maxi"), ("low", "high"), ("lower", "upper"), ("lo", "hi"), ("from", "to"),
    ("von", "bis"), ("ab", "bis"), ("de", "à"), ("de", "a"), ("desde", "hasta"), ("da", "a"), ("van", "tot"), ("od", "do"),
    ("mín", "máx"), ("mindest", "höchst"),
)  # fmt: skip
LOWS, HIGHS = frozenset(low for low, _ in _ENDS), frozenset(high for _, high in _ENDS)
_COMPARISONS = {
    re.compile(rf"\s*(?:{words})\s+([+-]?\d+(?:[.,]\d+)?)\s*", re.IGNORECASE): sign
    for words, sign in (
        (r"ab|from|at least|min\.?|mind\.|mindestens|minimum|dès|au moins|desde|vanaf|od", ">="),
        (r"bis(?: zu)?|up to|at most|max\.?|höchstens|maximum|jusqu'à|au plus|hasta|até|fino a|tot", "<="),
        (r"über|above|over|more than|mehr als|plus de|más de|più di|meer dan", ">"),
        (r"unter|below|under|less than|weniger als|moins de|menos de|meno di|minder dan", "<"),
    )
}
_UNIT = re.compile(r"(?<=\d)\s*([^\W\d_]{1,4}(?:/[^\W\d_]{1,3}[²2]?)?|%)\s*$")
COUNTS_ROWS = frozenset(("#", "nr", "no", "n°", "nº", "id", "index", "lfdnr", "num", "number", "nummer", "row", "zeile"))
"""Names, folded and without a point, of a column that numbers the rows."""
_WORD = re.compile(r"[^\W\d_]+?(?=[A-Z](?=[a-z]))|[^\W\d_]+|\d+")


def is_sum(text: str) -> bool:
    """Whether a text is what people write before a total."""
    return text.strip().rstrip(":").casefold() in SUMS


def as_truths(column: TextColumn) -> TextColumn | None:
    """A column of True and False as people tick and write: "x", "✗", "WAHR". None where nobody does, or it holds something else."""
    texts = [TRUTHS.get(text.strip().casefold(), text) for text in column.texts]
    if texts == list(column.texts) or not all(says_any(text) or reads(text, BOOL) for text in texts):
        return None
    return _rewritten(column, texts)


def with_any(column: TextColumn) -> TextColumn | None:
    """A column with Any where its texts say that a condition does not matter; None where none does."""
    texts = ["Any" if text.strip().casefold() in MATTERS_NOT else text for text in column.texts]
    return None if texts == list(column.texts) else _rewritten(column, texts)


def compared(text: str) -> str:
    """A number with a word for "at least", "below" or the like before it as a comparison; another text as it is."""
    return next((f"{sign}{match[1]}" for words, sign in _COMPARISONS.items() if (match := words.fullmatch(text))), text)


def without_unit(texts: Sequence[str]) -> Sequence[str]:
    """Texts without the unit that ends each that says something, where that is the same one."""
    matches = [_UNIT.search(text) for text in texts if not says_any(text)]
    units = {match and match[1] for match in matches}
    return [_UNIT.sub("", text) for text in texts] if len(units) == 1 and None not in units else texts


def counts_rows(name: str, texts: Sequence[str]) -> bool:
    """Whether a column numbers the rows, one after the other."""
    is_named = re.sub(r"[\s._]", "", name).casefold() in COUNTS_ROWS
    return is_named and len(texts) > 1 and list(texts) in ([str(at) for at in range(first, first + len(texts))] for first in (0, 1))


def without_end(name: str) -> tuple[str, str] | None:
    """The word "min", "max", "von", … of a name in small letters, and the name without it; None where there is not exactly one."""
    words = [match for match in _WORD.finditer(name) if match[0].casefold() in LOWS | HIGHS]
    if len(words) != 1:
        return None
    before, after = name[: words[0].start()], name[words[0].end() :]
    rest = f"{before.rstrip(' _-.')}{after}" if before.strip(" _-.") else after.lstrip(" _-.")
    return words[0][0].casefold(), rest.strip()


def are_ends(low: str, high: str) -> bool:
    """Whether two such words are the ends of one interval."""
    return (low, high) in _ENDS


def _rewritten(column: TextColumn, texts: list[str]) -> TextColumn:
    return TextColumn.of(column.name, (texts[code] for code in column.codes.tolist()))
