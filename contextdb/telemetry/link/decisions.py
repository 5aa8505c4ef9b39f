"""Decisions of the motion search as lines have them: the JSON of `contextdb motion replay`."""

from __future__ import annotations

from contextdb.errors import ContextError, Fault
from contextdb.motion.selection.choice import Choice
from contextdb.motion.selection.decision import Decision
from contextdb.motion.trace.json_form import as_plain, decision_json


def require_decision(decision: object) -> None:
    """Raise ContextError for what is no decision."""
    if not isinstance(decision, (Decision, Choice)):
        found = f"a link cannot tell of what is of type {type(decision).__name__}."
        raise ContextError(Fault(found, "the Decision of a controller, or the Choice of a selector"))


def sent_decision(decision: object) -> object:
    """A decision, or the choice of a selector as a decision with nothing but that."""
    return decision_json(decision) if isinstance(decision, Decision) else {"choice": as_plain(decision)}
