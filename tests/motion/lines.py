"""Databases on a line, for tests of choosing: a frame's one feature is a place, and its cost the squared distance to the query."""

from dataclasses import replace

import numpy as np

from contextdb.motion import MotionDatabase
from contextdb.motion.markup.marking import marks_of
from contextdb.motion.markup.markup import Markup
from contextdb.motion.search.filters import Biases

RATE = 10.0
DT = 1.0 / RATE
HEADER = "asset,tag,from,to,value\n"


def line(markup="", *, end_s=0.0, continuing=0.0, base=0.0, **assets):
    """A database of assets, each the places of its frames at 10 a second; `markup` is rows of a markup file."""
    lengths = [len(places) for places in assets.values()]
    stops = np.cumsum(lengths)
    features = np.concatenate([np.asarray(places, float) for places in assets.values()]).reshape(-1, 1)
    database = MotionDatabase.from_features(features, stops - lengths, stops, list(assets))
    marks = marks_of(Markup.parse(HEADER + markup), database.assets, database.starts, database.stops, RATE, end_s)
    return replace(database, marks=marks, biases=Biases(base=base, continuing=continuing))
