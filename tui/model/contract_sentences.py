"""Contracts as the sentences in which people write them, and back.

    Whenever HasBall and not Down, some row carry* can play.
    Whenever speed > 8, every row that can play is run* or sprint*.
    Always at most 3 rows can play.
    Whenever Airborne, no row like walk* can play, because nobody walks on air.
    Always the row that is picked is weight > 0.

After "row" stands a pattern of names of assets, or an expression over the row: `asset`, `weight`, `priority`, outputs.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from contextdb.cells.words import quoted
from contextdb.errors import Fault
from contextdb.schema.contracts import Contract

ANY = "asset like '*'"
_FORMS = (
    ("some", re.compile(r"some rows?(?: (?P<kind>.+?))? can play", re.IGNORECASE)),
    ("every", re.compile(r"every row(?: that can play)? is (?P<kind>.+)", re.IGNORECASE)),
    ("none", re.compile(r"no rows?(?: (?P<kind>.+?))? can play", re.IGNORECASE)),
    ("at_most", re.compile(r"at most (?P<n>\d+|one) rows?(?: (?P<kind>.+?))? can play", re.IGNORECASE)),
    ("winner", re.compile(r"the row that is picked is (?P<kind>.+)", re.IGNORECASE)),
)
_PREMISE = re.compile(
    r"(?:whenever (?P<when>.+?)(?:, ?| )|always,? )?(?P<demand>(?:some rows?|every row|no rows?|at most (?:\d+|one)|the row)\b.*)",
    re.IGNORECASE | re.DOTALL,
)
_WHY = re.compile(r",? because (?P<why>.+)$", re.IGNORECASE | re.DOTALL)
_PATTERN = re.compile(r"(?:like )?(?P<pattern>[\w*?./:@-]*[\w*?])")
_LIKE = re.compile(r"asset like '(?P<pattern>[\w*?./:@-]*[\w*?])'")
_WORDS = re.compile(r"[A-Za-z0-9]+")
EXAMPLE = "Whenever HasBall and not Down, some row carry* can play"
ACCEPTED = (
    "Whenever …, or Always; then: some row … can play; every row that can play is …; no row … can play; "
    "at most 3 rows … can play; the row that is picked is …"
)
MOST_NAME = 5
"""Words of a sentence that name a contract."""


@dataclass(frozen=True)
class Sentence:
    """What a text says: the keys of a contract, or what is wrong."""

    part: Mapping[str, object]
    fault: Fault | None = None


def sentence_of(contract: Contract) -> str:
    """A contract as a sentence, without its end."""
    premise = f"Whenever {contract.when}, " if contract.when else "Always "
    kind = "" if contract.kind in (None, ANY) else f" {_kind_words(contract.kind or '')}"
    demand = {
        "some": f"some row{kind} can play",
        "every": f"every row that can play is{kind or ' *'}",
        "none": f"no row{kind} can play",
        "at_most": f"at most {contract.most} row{'' if contract.most == 1 else 's'}{kind} can play",
        "winner": f"the row that is picked is{kind or ' *'}",
    }[contract.verb]
    return premise + demand + (f", because {contract.why.rstrip('.')}" if contract.why else "")


def read_sentence(text: str, table: str) -> Sentence:
    """What a sentence demands of a table."""
    plain = " ".join(text.split()).rstrip(".")
    why = _WHY.search(plain)
    match = _PREMISE.fullmatch(plain[: why.start()] if why else plain)
    for verb, form in _FORMS if match is not None else ():
        demand = form.fullmatch(match["demand"].strip()) if match is not None else None
        if match is not None and demand is not None:
            kind = _kind(demand["kind"])
            limit: object = int(demand["n"].replace("one", "1")) if verb == "at_most" else kind or ANY
            limit = {"n": limit, "of": kind} if verb == "at_most" and kind else limit
            part: dict[str, object] = {"table": table} | ({"when": match["when"]} if match["when"] else {}) | {verb: limit}
            return Sentence(part | ({"why": why["why"]} if why else {}))
    return Sentence({}, Fault("this is no contract.", ACCEPTED, EXAMPLE))


def name_for(part: Mapping[str, object], taken: Collection[str]) -> str:
    """A name for a new contract, of the words of its sentence."""
    words = _WORDS.findall(" ".join(str(part[key]) for key in part if key not in ("table", "why")))
    base = "_".join([str(part.get("table", "")), *words[:MOST_NAME]]).strip("_") or "contract"
    name, n = base, 1
    while name in taken:
        n += 1
        name = f"{base}_{n}"
    return name


def facts_of(context: Mapping[str, object]) -> dict[str, str]:
    """The facts of a counterexample as the test row takes them."""
    return {name: _fact(value) for name, value in context.items()}


def _fact(value: object) -> str:
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, (list, tuple, set, frozenset)):
        return " ".join(quoted(str(tag)) for tag in sorted(map(str, value))) or '""'
    return quoted(value) if isinstance(value, str) else f"{value}"


def _kind(text: str | None) -> str | None:
    if text is None:
        return None
    match = _PATTERN.fullmatch(text.strip())
    return f"asset like '{match['pattern']}'" if match is not None else text.strip()


def _kind_words(kind: str) -> str:
    match = _LIKE.fullmatch(kind)
    return match["pattern"] if match is not None else kind
