"""What the debugger says of a moment, and of an asset in it."""

from __future__ import annotations

from collections.abc import Iterator

from contextdb.console import printable
from contextdb.motion.selection.decision import Playing
from contextdb.motion.trace.cost_views import cost_text

from .landscape import Row
from .recording import Moment


def named(playing: Playing) -> str:
    """The animation that plays, with what is particular about it."""
    permutation = "" if playing.permutation_s is None else f" +{playing.permutation_s:g} s"
    return f"{playing.asset}{' ~' if playing.mirrored else ''}{permutation}"


def instead(moment: Moment) -> str:
    """What is chosen with other weights."""
    assert moment.turned is not None, "was looked at before"
    choice = moment.turned.choice
    if choice is None or choice.database is None:
        return "With these weights nothing may play."
    what = f"{choice.hit.asset} at cost {cost_text(choice.hit.cost)}"
    if not moment.turned.is_changed:
        return f"With these weights the same is chosen: {what}."
    return f"With these weights {'another asset' if moment.turned.is_other_asset else 'another frame'} is chosen: {what}."


def detail(moment: Moment, row: Row) -> Iterator[str]:
    """What is known of an asset, in two lines."""
    search = moment.landscape.searches[row.database]
    database = search.database
    rate = 30.0 if database.schema is None else database.schema.rate
    at_s = (row.frame - int(database.starts[row.range])) / rate
    out = "" if row.may_play else f" · left out: {row.reason}"
    tags = [
        tag for tag, has in zip(database.marks.tags, database.marks.kind_tags[database.marks.kinds[row.frame]], strict=True) if has
    ]
    tag_text = f" · {', '.join(tags)}" if tags else ""
    yield printable(f"{row.name} at {at_s:.2f} s: cost {cost_text(row.cost)}{out}{tag_text} · {row.database}")
    own = database.cost_weights * search.sums[:, row.frame]
    parts = sorted(zip(database.channel_names, own.tolist(), strict=True), key=lambda part: -part[1])
    yield printable(" + ".join(f"{name} {cost_text(value)}" for name, value in parts) + _biases(search.biases[row.frame]))


def channel_costs(moment: Moment, name: str, frame: int) -> dict[str, float]:
    """What each channel adds to the cost of a frame."""
    search = moment.landscape.searches.get(name)
    if search is None:
        return {}
    own = search.database.cost_weights * search.sums[:, frame]
    return dict(zip(search.database.channel_names, own.tolist(), strict=True))


def _biases(bias: float) -> str:
    return f" + biases {cost_text(float(bias))}" if bias else ""
