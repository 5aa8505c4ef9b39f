"""Decisions of the motion search as lines have them: the JSON of `contextdb motion replay`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from weakref import WeakKeyDictionary

from contextdb.errors import ContextError, Fault
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.decision import Decision
from contextdb.motion.selection.worked_out import WorkedOut
from contextdb.motion.trace.filter_rows import fingerprint, markup_digest
from contextdb.motion.trace.json_form import as_plain, decision_json
from contextdb.motion.trace.rows import row_of

_digests: WeakKeyDictionary[MotionDatabase, dict[str, str]] = WeakKeyDictionary()


def require_decision(decision: object) -> None:
    """Raise ContextError for what is no decision."""
    if not isinstance(decision, (Decision, Choice)):
        found = f"a link cannot tell of what is of type {type(decision).__name__}."
        raise ContextError(Fault(found, "the Decision of a controller, or the Choice of a selector"))


def sent_decision(decision: object) -> object:
    """A decision, or the choice of a selector as a decision with nothing but that."""
    return decision_json(decision) if isinstance(decision, Decision) else {"choice": as_plain(decision)}


def sent_row(decision: object) -> str | None:
    """A decision as a row of a recorded session, in Python's JSON: what is infinite is `Infinity`. None for a selector's choice."""
    return json.dumps(row_of(decision, lambda *_: ()), separators=(",", ":")) if isinstance(decision, Decision) else None


def databases_of(decision: object) -> Mapping[str, MotionDatabase] | None:
    """The databases that a decision was made with; None where it does not say."""
    found = decision.candidates if isinstance(decision, Decision) else None
    return found.databases if isinstance(found, WorkedOut) else None


def sent_databases(databases: Mapping[str, MotionDatabase]) -> dict[str, dict[str, str]]:
    """What tells whether a listener has the same databases: their digests, worked out once for each."""
    for database in databases.values():
        if database not in _digests:
            _digests[database] = {"digest": fingerprint(database), "markup": markup_digest(database)}
    return {name: _digests[database] for name, database in databases.items()}
