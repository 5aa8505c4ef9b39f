"""Actors cast for the roles of a table's rows: see `contextdb.compiled.casting.stage`."""

from contextdb.compiled.casting.explaining import CastExplanation
from contextdb.compiled.casting.facts import Actor, Actors, Prefer
from contextdb.compiled.casting.stage import Casting, CastMatches

__all__ = ["Actor", "Actors", "CastExplanation", "CastMatches", "Casting", "Prefer"]
