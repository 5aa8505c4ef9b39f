"""Why not, figures of a session, what would have been and where two sessions part, for people: lines of text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from contextdb.errors import joined, plural
from contextdb.motion.trace.cost_views import cost_text, seconds
from contextdb.motion.trace.session_diff import SessionDiff
from contextdb.motion.trace.stats import GAINS, SessionStats
from contextdb.motion.trace.text_table import WIDTH, Column, table_lines
from contextdb.motion.trace.views import wrapped
from contextdb.motion.trace.what_if import WhatIf
from contextdb.motion.trace.why_not import WhyNot
from contextdb.motion.trace.winning_changes import Change, ChangePart

MOST_NAMES = 12
MOST_CHOICES = 20
LABEL = 12


def why_lines(answer: WhyNot, width: int = WIDTH) -> Iterator[str]:
    """Why an asset was not chosen, and what would have to change."""
    at = "" if answer.time_s is None else f" at {answer.time_s:.2f} s"
    place = f"{answer.asset}{at}, frame {answer.frame:,} of {answer.database}"
    if answer.winner == answer.asset:
        yield from wrapped(f"{answer.asset} was chosen: cost {cost_text(answer.cost)}.", width)
        return
    beaten = (
        "nothing was chosen" if answer.winner is None else f"{answer.winner} was chosen at cost {cost_text(answer.winner_cost)}"
    )
    yield from wrapped(f"{place}: cost {cost_text(answer.cost)}, rank {answer.rank:,}; {beaten}.", width)
    yield from ("", "why not", "")
    for reason in answer.reasons:
        yield from wrapped(reason, width)
    yield from ("", "what would have to change", "")
    if not answer.changes:
        yield "no single change of a cell, a mark, a bias or a weight"
    yield from _labelled([("wins" if each.wins else "not enough", _change_text(each)) for each in answer.changes], width)


def _change_text(change: Change) -> str:
    return " and ".join(_part_text(part) for part in change.parts)


def _part_text(part: ChangePart) -> str:
    if part.to == "without":
        return f"without the {part.kind} {part.what}"
    return f"{part.kind} {part.what} = {part.to if isinstance(part.to, str) else f'{part.to:.6g}'}"


def stats_lines(stats: SessionStats, width: int = WIDTH) -> Iterator[str]:
    """Figures of a session as aligned lines."""
    gain = (
        ""
        if stats.gain_median is None
        else f"median {_percent(stats.gain_median)}, {_percent(stats.gain_small_share or 0.0)} under 20 %"
    )
    spread = (
        ", ".join(f"{n} up to {_percent(high)}" for n, high in zip(stats.gains, GAINS, strict=True) if n) if stats.gains else ""
    )
    used = "" if stats.frames_used_share is None else f", {100.0 * stats.frames_used_share:.2g} % of the frames"
    rows = [
        ("jumps", f"{stats.jumps:,} in {stats.seconds:.2f} s, {stats.jumps_per_s:.2f} a second; {stats.forced_jumps:,} forced"),
        ("searches", ", ".join(f"{n:,} {cause}" for cause, n in stats.causes.items())),
        ("gain", f"{gain}; {spread}" if spread else gain),
        ("stay", "" if stats.stay_s is None else f"{stats.stay_s:.2f} s in a clip"),
        ("plays", f"{plural(stats.assets_used, 'asset')}{used}"),
    ]
    never = stats.assets_never_used
    if never is not None:
        rows.append(("never used", f"{len(never):,}: {joined(never, MOST_NAMES)}" if never else "none"))
    yield from _labelled([(label, text) for label, text in rows if text], width)


def _labelled(rows: Iterable[tuple[str, str]], width: int) -> Iterator[str]:
    """Texts in lines, each behind its label."""
    for label, text in rows:
        lines = wrapped(text, width - LABEL)
        yield from (f"{label if i == 0 else '':<{LABEL}}{line}" for i, line in enumerate(lines))


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"


def what_if_lines(answer: WhatIf, width: int = WIDTH) -> Iterator[str]:
    """What a change makes of a session."""
    n = len(answer.other_assets)
    searches = f"{answer.searches:,} recorded search{'' if answer.searches == 1 else 'es'}"
    yield f"of {searches}, {answer.other_frames:,} choose another frame, {n:,} another asset"
    if answer.other_assets:
        listed = answer.other_assets[:MOST_CHOICES]
        yield ""
        yield from table_lines(
            [
                Column("tick", [f"{each.tick:,}" for each in listed], is_number=True, is_key=True),
                Column("time s", [seconds(each.time_s) for each in listed], is_number=True),
                Column("was", [each.was or "nothing" for each in listed]),
                Column("becomes", [each.becomes or "nothing" for each in listed]),
            ],
            width,
        )
        if n > len(listed):
            yield f"and {n - len(listed):,} more"
    yield from ("", "the session run again in closed loop", "")
    if not answer.is_reproduced:
        yield from wrapped("(run again unchanged it does not play what was recorded: before is that run, not the recording)", width)
    yield from _measure_lines(("before", answer.before), ("after", answer.after), width)


def diff_lines(diff: SessionDiff, width: int = WIDTH) -> Iterator[str]:
    """Where two sessions part, as lines."""
    parting = diff.parting
    if parting is None:
        yield f"both play the same in all {plural(diff.updates, 'update')}"
    else:
        yield f"they part at tick {parting.tick:,}, {parting.time_s:.2f} s"
        yield from wrapped(f"first:  {parting.one or 'nothing'}. {parting.why_one}", width)
        yield from wrapped(f"second: {parting.other or 'nothing'}. {parting.why_other}", width)
        yield f"of {plural(diff.updates, 'update')}, {diff.other_frames:,} play another frame, {diff.other_assets:,} another asset"
    if diff.longer:
        yield f"the {'first' if diff.longer > 0 else 'second'} session is longer by {plural(abs(diff.longer), 'update')}"
    yield ""
    yield from _measure_lines(("first", diff.one), ("second", diff.other), width)


Measured = tuple[str, Mapping[str, float | None]]


def _measure_lines(one: Measured, other: Measured, width: int) -> Iterator[str]:
    names = list(one[1])
    columns = [Column("measure", names, is_key=True)]
    for heading, values in (one, other):
        columns.append(Column(heading, ["" if (v := values[name]) is None else f"{v:.4g}" for name in names], is_number=True))
    yield from table_lines(columns, width)
