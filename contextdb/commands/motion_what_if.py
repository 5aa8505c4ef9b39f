"""What `motion replay --what-if` changes: NAME=VALUE as weights of channels, biases of databases, and thresholds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from contextdb.commands.numbers import number_of
from contextdb.errors import Fault, QueryError, in_quotes, nearest, some
from contextdb.motion import MotionDatabase
from contextdb.motion.search.filters import Biases
from contextdb.motion.trace.reasked import Changes

BIASES = ("base", "continuing", "looping")
THRESHOLD = "threshold "
ACCEPTED = 'NAME=VALUE, such as "LeftFoot velocity=2", "continuing=-0.1" or "threshold jog_tired=3"'
MOST = 1e9


def changes_of(texts: Sequence[str], databases: Mapping[str, MotionDatabase]) -> Changes:
    """The changes that some texts mean. Raises QueryError for a text that is no NAME=VALUE, a name that there is not, with the
    nearest, or a value that is no number."""
    channels = list(dict.fromkeys(name for each in databases.values() for name in each.channel_names))
    known = [*channels, *BIASES, *(f"{THRESHOLD}{name}" for name in databases)]
    weights: dict[str, float] = {}
    biases: dict[str, float] = {}
    thresholds: dict[str, float | None] = {}
    for text in texts:
        name, value = _read(text, known)
        if name in channels and value < 0.0:
            raise QueryError(Fault(f"the weight of {in_quotes(name)} is {value:g}.", "a number, 0 or more"))
        if name in channels:
            weights[name] = value
        elif name in BIASES:
            biases[name] = value
        else:
            thresholds[name.removeprefix(THRESHOLD)] = value
    of_each: dict[str, Biases] = {name: replace(each.biases, **biases) for name, each in databases.items()} if biases else {}
    return {"weights": weights, "biases": of_each, "thresholds": thresholds}


def _read(text: str, known: Sequence[str]) -> tuple[str, float]:
    name, equals, number = (part.strip() for part in text.rpartition("="))
    if not equals or not name:
        raise QueryError(Fault(f"{in_quotes(text)} is not a change.", ACCEPTED))
    if name not in known:
        near = nearest(name, known)
        fault = f"there is no channel, bias or threshold {in_quotes(name)}."
        raise QueryError(Fault(fault, some(known), in_quotes(f"{near}={number}") if near else ""))
    value = number_of(number)
    if value is None or abs(value) > MOST:
        raise QueryError(Fault(f"{in_quotes(number)} is not a number.", ACCEPTED))
    return name, value
