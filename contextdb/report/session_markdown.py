"""Sessions as Markdown, for a comment on a pull request: measures side by side, and what changed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from contextdb.motion.selection.decision import Action, Decision
from contextdb.motion.trace.cost_views import cost_text
from contextdb.motion.trace.views import NOTHING_FORCED, look_first
from contextdb.report.measure_results import SessionMeasures
from contextdb.report.render_markdown import MOST_BYTES, escaped

CHANGES = (Action.START, Action.JUMP)


def render(sessions: Sequence[SessionMeasures], decisions: Sequence[Sequence[Decision]], parting: str, page: str | None) -> str:
    """The comment; `page` is the name of its HTML page."""
    names = [session.file for session in sessions]
    parts = [
        f"## Session {' and '.join(map(escaped, names))}",
    ]
    parts += [
        f"{escaped(s.file)}: {s.headline}. {escaped(look_first(each) or NOTHING_FORCED)}"
        for s, each in zip(sessions, decisions, strict=True)
    ]
    if parting:
        parts.append(f"**{escaped(parting)}**")
    if page:
        parts.append(f"Playback, costs and reasons: {escaped(page)}, among the artefacts.")
    parts.append("\n".join(_measures(sessions)))
    text = "\n\n".join(parts) + "\n"
    for name, each in zip(names, decisions, strict=True):
        text += _changes(name, each, MOST_BYTES - len(text.encode()))
    return text


def _measures(sessions: Sequence[SessionMeasures]) -> Iterator[str]:
    rows: dict[str, list[str]] = {}
    for place, session in enumerate(sessions):
        for label, value, raw, _ in session.rows():
            row = rows.setdefault(label, [""] * (len(sessions) + 1))
            row[place], row[-1] = value, raw or row[-1]
    heads = [session.file for session in sessions] if len(sessions) > 1 else ["session"]
    yield "| " + " | ".join(map(escaped, ["measure", *heads, "raw clips"])) + " |"
    yield "| --- |" + " ---: |" * (len(sessions) + 1)
    yield from ("| " + " | ".join(map(escaped, [label, *values])) + " |" for label, values in rows.items())


def _changes(name: str, decisions: Sequence[Decision], room: int) -> str:
    """What changed, folded away, as far as there is room."""
    lines = [_line(decision) for decision in decisions if decision.action in CHANGES]
    head = f"\n<details><summary>What changed in {escaped(name)}: {len(lines):,} times</summary>\n\n"
    head += "| time | what | asset | cost | why |\n| ---: | --- | --- | ---: | --- |\n"
    end, left = "\n</details>\n", "\nThe rest is in the page.\n"
    room -= len((head + end + left).encode())
    retained: list[str] = []
    for line in lines:
        room -= len(line.encode())
        if room < 0:
            return head + "".join(retained) + left + end if retained else ""
        retained.append(line)
    return head + "".join(retained) + end


def _line(decision: Decision) -> str:
    what = "forced jump" if decision.is_forced else str(decision.action)
    asset = "" if decision.playing is None else decision.playing.asset
    cost = "" if decision.cost is None else cost_text(decision.cost)
    return f"| {decision.time_s:.2f} s | {what} | {escaped(asset)} | {cost} | {escaped(decision.why)} |\n"
