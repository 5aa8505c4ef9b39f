"""Actors cast for the roles of a table's rows: see `contextdb.casting.stage`."""

from contextdb.casting.explaining import CastExplanation
from contextdb.casting.facts import Actor, Actors, Prefer
from contextdb.casting.many import ManyCastMatches
from contextdb.casting.stage import Casting, CastMatches

__all__ = ["Actor", "Actors", "CastExplanation", "CastMatches", "Casting", "ManyCastMatches", "Prefer"]
