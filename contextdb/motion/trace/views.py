"""A recorded session for people: what changed and when, and one decision in full. Pure functions that give lines of text.

Source: "PTM Status", "PTM Searches" and "Top Candidates" of the diagnostics in EA's talk; the debugger of Remedy's: why was my
animation interrupted, and why is mine not picked?
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict

from contextdb.cells.words import three_digits
from contextdb.console import printable
from contextdb.errors import in_quotes
from contextdb.motion.markup.left_out import LeftOut
from contextdb.motion.search.candidates import Candidates
from contextdb.motion.selection.choice import Choice, Search, Status
from contextdb.motion.selection.decision import Action, Decision, Playing
from contextdb.motion.selection.root_motion import NO_MOTION
from contextdb.motion.selection.trigger import Trigger
from contextdb.motion.trace.cost_views import Ranked, View, candidate_lines, cost_text, named, seconds, summary_of
from contextdb.motion.trace.text_table import WIDTH, Column, shortened, table_lines

EventTexts = Mapping[tuple[str, int], Sequence[str]]
STEADY = (Action.HOLD, Action.NOTHING)
"""What is reported once while it lasts, as playing on is reported with what is played."""
CAUSES = {
    Trigger.NOTHING_PLAYS: "nothing played",
    Trigger.LOST: "not loaded",
    Trigger.ENDED: "ended",
    Trigger.NOT_AMONG: "not among",
    Trigger.NOT_VALID: "not valid",
    Trigger.INTERRUPTED: "interrupted",
    Trigger.FORCED: "forced",
    Trigger.DUE: "due",
}
LEAST_ASSET, MOST_DATABASE = 16, 16
LABEL = 12


# ---- a session


def summary_line(decisions: Iterable[Decision]) -> str:
    """A session in one line: how long it is, and how often what happened."""
    n, n_searches, last_s, actions = 0, 0, 0.0, dict.fromkeys(Action, 0)
    for decision in decisions:
        n, n_searches, last_s = n + 1, n_searches + decision.searched, decision.time_s
        actions[decision.action] += 1
    counts = [(n, "update"), (n_searches, "search"), (actions[Action.JUMP], "jump"), (actions[Action.LOOP], "loop")]
    parts = [f"{count:,} {noun}{'' if count == 1 else 'es' if noun == 'search' else 's'}" for count, noun in counts]
    return f"{last_s:.2f} s: {', '.join(parts)}"


def look_first(decisions: Iterable[Decision]) -> str:
    """Where to look first, in a sentence: at the forced jump that fits worst; "" where none is."""
    forced = [(decision.cost, decision) for decision in decisions if decision.is_forced and decision.cost is not None]
    if not forced:
        return ""
    cost, worst = max(forced, key=lambda pair: pair[0])
    return f"Look first at {worst.time_s:.2f} s: {nothing_fits('' if worst.playing is None else worst.playing.asset, cost)}."


NOTHING_FORCED = "Nothing to look at first: no jump is forced."
"""What a report opens with where `look_first` has nothing."""


def nothing_fits(asset: str | None, cost: float) -> str:
    """What is wrong with a forced jump."""
    return f"what plays ends there and nothing fits well: {asset} costs {cost:.3g}"


def session_lines(decisions: Iterable[Decision], *, name: str = "", width: int = WIDTH) -> Iterator[str]:
    """One row for each decision that changed something, with how long it then went on; only where an asset whose name contains
    `name` plays or is left. `width` is in cells; the names of assets are shortened to fit."""
    spells = [spell for spell in _spells(decisions) if _plays(spell[0], name)]
    assets = Column("asset", [_asset(first.playing) for first, _ in spells])
    columns = list(_session_columns(spells, assets))
    others = sum(column.width + 2 for column in columns if column is not assets and not column.is_empty)
    columns[columns.index(assets)] = assets.narrowed(max(LEAST_ASSET, width - others))
    yield from table_lines(columns, width)


def _spells(decisions: Iterable[Decision]) -> list[tuple[Decision, float]]:
    """Each decision that changed something, and the seconds until the next such one, or the last of all."""
    changed: list[Decision] = []
    last: Decision | None = None
    for decision in decisions:
        if last is None or _changes(decision, last):
            changed.append(decision)
        last = decision
    ends_s = [decision.time_s for decision in changed[1:]] + ([last.time_s] if last else [])
    return [(decision, end_s - decision.time_s) for decision, end_s in zip(changed, ends_s, strict=True)]


def _changes(decision: Decision, last: Decision) -> bool:
    if decision.held != last.held:
        return True
    if decision.action is Action.CONTINUE:
        return last.action in STEADY
    return decision.action not in STEADY or decision.action is not last.action


def _plays(decision: Decision, name: str) -> bool:
    playing = (each for each in (decision.playing, decision.before) if each is not None)
    return not name or any(name.casefold() in each.asset.casefold() for each in playing)


def _session_columns(spells: Sequence[tuple[Decision, float]], assets: Column) -> Iterator[Column]:
    firsts = [first for first, _ in spells]
    playing = [first.playing for first in firsts]
    databases = [each.database if each else "" for each in playing]
    yield Column("tick", [f"{first.tick:,}" for first in firsts], is_number=True, is_key=True)
    yield Column("time s", [seconds(first.time_s) for first in firsts], is_number=True)
    yield Column("search", [cause_of(first) for first in firsts])
    yield Column("", [_action(first) for first in firsts])
    if len(set(filter(None, databases))) > 1:
        yield Column("database", [shortened(database, MOST_DATABASE) for database in databases])
    yield assets
    yield Column("at s", [seconds(each.time_s) if each else "" for each in playing], is_number=True)
    yield Column("cost", [cost_text(first.cost) for first in firsts], is_number=True)
    yield Column("playing on", [cost_text(first.continuing_cost) for first in firsts], is_number=True)
    yield Column("for s", [seconds(for_s) for _, for_s in spells], is_number=True)


def _asset(playing: Playing | None) -> str:
    return "" if playing is None else playing.asset + (" (mirrored)" if playing.mirrored else "")


def _action(decision: Decision) -> str:
    """What the update did, and the guard that saw to it."""
    return f"{decision.action} ({decision.held})" if decision.held else str(decision.action)


def cause_of(decision: Decision) -> str:
    """Why there was a search, in a word or two: what the decision's sentence begins with."""
    if decision.together is not None:
        return "joint"
    causes = (words for cause, words in CAUSES.items() if decision.why.startswith(cause.sentence(decision.before)))
    return next(causes, "") if decision.searched else ""


# ---- one decision


def decision_lines(
    decision: Decision,
    view: View = View.SUMMARY,
    *,
    name: str = "",
    events: EventTexts | None = None,
    width: int = WIDTH,
    ranked: Sequence[Ranked] | None = None,
) -> Iterator[str]:
    """One decision in full: what came of it, what was searched, and what the best candidates cost.

    Only candidates whose asset's name holds `name` are displayed, with the costs of a view, or instead of them the frames `ranked`.
    `events` is what the markup says of frames, by (database, frame); `width` is in cells of a line.
    """
    known_events = {} if events is None else events
    yield f"tick {decision.tick:,} at {decision.time_s:.2f} s: {decision.action}"
    yield from wrapped(decision.why, width)
    yield ""
    for label, text in _status(decision, known_events):
        lines = wrapped(text, width - LABEL) or [""]
        yield from (f"{label if i == 0 else '':<{LABEL}}{line}" for i, line in enumerate(lines))
    if decision.choice is not None:
        yield from ("", "searches", "", *search_lines(decision, width))
    if ranked is not None:
        yield from ("", f"the best frames of assets whose name contains {in_quotes(name)} ({view})", "")
        yield from candidate_lines(ranked, view, known_events, width)
    elif decision.candidates:
        yield from ("", f"top candidates ({view})", "", *_top_lines(decision, view, name, known_events, width))


def _status(decision: Decision, events: EventTexts) -> Iterator[tuple[str, str]]:
    playing, before, move = decision.playing, decision.before, decision.root_motion
    yield "plays", _playing_text(playing)
    if before is not None and before != playing:
        yield "before", f"{_playing_text(before)}, if it played on"
    for what, cost, of in (("cost", decision.cost, playing), ("playing on", decision.continuing_cost, before)):
        if cost is not None:
            yield what, cost_text(cost) + _parts_text(decision, of)
    if decision.together is not None:
        for role, actor in decision.together.cast.items():
            own = decision.together.costs[role]
            parts = ", ".join(f"{part} {cost_text(cost)}" for part, cost in sorted(own.items(), key=lambda each: -each[1]) if cost)
            yield "together" if role == next(iter(decision.together.cast)) else "", f"{role} is {actor}: {parts or cost_text(0.0)}"
    if decision.held:
        yield "held by", decision.held
    if playing is not None and events.get((playing.database, playing.frame)):
        yield "events", ", ".join(events[playing.database, playing.frame])
    if move != NO_MOTION or decision.root_weight != 1.0:
        turn = math.degrees(move.turn_rad)
        yield "moved", f"{move.ahead_m:.3f} m ahead, {move.left_m:.3f} m left, turned {turn:.1f}°; weight {decision.root_weight:g}"
    if decision.play is not None:
        said = {key: value for key, value in asdict(decision.play).items() if value is not None}
        yield "its row says", ", ".join(f"{key} {value}" for key, value in said.items())
    if decision.play_rate != 1.0:
        yield "play rate", f"{decision.play_rate:.2f}"
    if decision.search_us is not None:
        yield "search", f"{decision.search_us:,.0f} µs"
    if decision.context:
        yield "context", ", ".join(f"{key} = {fact_text(value)}" for key, value in decision.context.items())


def _playing_text(playing: Playing | None) -> str:
    if playing is None:
        return "nothing"
    permutation = "" if playing.permutation_s is None else f", permutation {playing.permutation_s:g} s"
    return f"{_asset(playing)} at {playing.time_s:.2f} s, frame {playing.frame:,} of {playing.database}{permutation}"


def _parts_text(decision: Decision, playing: Playing | None) -> str:
    """What a cost is made of, where its frame is among the candidates."""
    for each in _ranked(decision):
        if playing is not None and (each.database, each.row.frame) == (playing.database, playing.frame):
            parts = [f"{part} {cost_text(cost)}" for part, cost in summary_of(each.row).items() if cost]
            return f": {', '.join(parts)}" if parts else ""
    return ""


def fact_text(value: object) -> str:
    """A fact as people write it, a number with three digits."""
    if isinstance(value, (list, tuple, set, frozenset)):
        return " ".join(f"+{tag}" for tag in sorted(map(str, value))) or "no tags"
    return "missing" if value is None else three_digits(f"{value:.9g}") if isinstance(value, float) else str(value)


def search_lines(decision: Decision, width: int = WIDTH) -> Iterator[str]:
    """The databases of a decision's choice in order; before them, as 0, what would play on."""
    choice = decision.choice
    if choice is None or not choice.searches:
        return
    rows = [(str(i), *_search_texts(decision, choice, search)) for i, search in enumerate(choice.searches, 1)]
    if decision.before is not None and decision.continuing_cost is not None:
        on = decision.before
        rows.insert(
            0,
            (
                "0",
                on.database,
                _asset(on),
                seconds(on.time_s),
                f"{on.frame:,}",
                cost_text(decision.continuing_cost),
                "",
                "plays on",
            ),
        )
    headers = ("order", "database", "asset", "time s", "frame", "cost", "threshold", "result")
    texts = list(zip(*rows, strict=True))
    numbers, keys = ("order", "time s", "frame", "cost", "threshold"), ("order", "database")
    yield from table_lines(
        [Column(header, text, header in numbers, header in keys) for header, text in zip(headers, texts, strict=True)], width
    )


def _search_texts(decision: Decision, choice: Choice, search: Search) -> tuple[str, ...]:
    hit, threshold = search.hit, "" if search.threshold is None else f"{search.threshold:g}"
    result = f"{search.status}, {choice.reason}" if search.status is Status.WINNER else str(search.status)
    if hit is None or not hit:
        return search.database, "", "", "", "", threshold, result
    rows = (each.row for each in _ranked(decision) if each.database == search.database and each.row.frame == hit.frame)
    row = next(rows, None)
    asset = str(hit.asset) + (" (mirrored)" if row is not None and row.mirrored else "")
    return search.database, asset, seconds(row.time_s if row else None), f"{hit.frame:,}", cost_text(hit.cost), threshold, result


def _top_lines(decision: Decision, view: View, name: str, events: EventTexts, width: int) -> Iterator[str]:
    rows = named(_ranked(decision), name)
    if rows:
        yield from candidate_lines(rows, view, events, width)
    else:
        yield f"none whose name contains {in_quotes(name)}" if name else "none"
    several = len(decision.candidates) > 1
    yield ""
    for database, candidates in decision.candidates:
        if candidates.counts:
            yield from wrapped(f"left out{f' of {database}' if several else ''}: {left_out_text(candidates)}", width)


def wrapped(text: str, width: int) -> list[str]:
    """A text in lines; no name is broken, however long."""
    return textwrap.wrap(printable(text), width, break_long_words=False, break_on_hyphens=False)


def left_out_text(candidates: Candidates) -> str:
    """How many frames were left out for each reason, the most first."""
    counts = sorted(candidates.counts.items(), key=lambda item: (-item[1], item[0]))
    return ", ".join(f"{count:,} {LeftOut(reason).text}" for reason, count in counts)


def _ranked(decision: Decision) -> list[Ranked]:
    """The candidates of all databases, cheapest first."""
    every = [(row.cost, database, row) for database, candidates in decision.candidates for row in candidates]
    every.sort(key=lambda each: each[0])
    return [Ranked(i, database, row, role_of(decision, database, row.frame)) for i, (_, database, row) in enumerate(every, 1)]


def role_of(decision: Decision, database: str, frame: int) -> str:
    """What a frame is to the decision: "chosen", "plays on", or nothing."""
    here = (database, frame)
    playing, before = ((each.database, each.frame) if each else None for each in (decision.playing, decision.before))
    if here == playing and decision.action in (Action.START, Action.JUMP):
        return "chosen"
    return "plays on" if here == before and decision.continuing_cost is not None else ""
