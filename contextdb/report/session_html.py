"""Recorded sessions as one HTML page that needs no network: skeletons that play, a timeline to scrub, the reason of each moment.

What was measured and what changed is in the page as tables and reads without its script; the rest is drawn by it. Every text of a
session is escaped, and nothing of it can become markup or script.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape

from contextdb.console import __version__, printable
from contextdb.report.document_html import embedded, page
from contextdb.report.session_data import Detail, SessionView, document_of

BYTES_A_MINUTE = 1_000_000
"""A page is at most as long for each minute of its sessions, as long as the plainest one is; see `Detail`."""
LEAST_MINUTES = 1.0
KEYS = (
    ("Space", "play, pause"),
    ("← →", "a frame; with Shift a second"),
    ("[ ]", "the jump before, the next jump"),
    ("n", "the next peak of the measure"),
    ("+ −", "nearer, farther; drag to turn"),
)


def render(sessions: Sequence[SessionView], *, parting: str = "") -> str:
    """The page of a session, or of two side by side; `parting` says where two of them part.

    It holds as much detail as its size allows.
    """
    minutes = max(LEAST_MINUTES, sum(session.seconds for session in sessions) / 60.0)
    page = ""
    for detail in Detail.most_first():
        page = _page(sessions, detail, parting)
        if len(page.encode()) <= BYTES_A_MINUTE * minutes:
            break
    return page


def _page(sessions: Sequence[SessionView], detail: Detail, parting: str) -> str:
    names = [printable(session.name) for session in sessions]
    title = f"Session {names[0]}" if len(names) == 1 else f"Sessions {' and '.join(names)}"
    opening = parting or (_first_look(sessions[0]) if len(sessions) == 1 else "")
    parted = f"<p>{opening if not parting else escape(parting)}</p>\n" if opening else ""
    changes = "".join(_changes(session, name) for session, name in zip(sessions, names, strict=True))
    body = (
        f"<header><h1>{escape(title)}</h1>\n{parted}</header>\n<main>\n"
        f"{_player(names)}{_measures(sessions, names)}{changes}</main>\n"
        f'<footer><p class="muted">contextdb {__version__}</p></footer>\n'
        f'<script type="application/json" id="session">{embedded(document_of(sessions, detail))}</script>\n'
    )
    return page(title, "session", body)


def _first_look(session: SessionView) -> str:
    """Where to look first, as a sentence with a link where there is a moment for it."""
    time_s, why = session.first_look
    return f"Look first at {_link(time_s)}: {escape(printable(why))}." if why else "Nothing stands out."


def _player(names: Sequence[str]) -> str:
    lanes = "".join(_lane(number, name, len(names) > 1) for number, name in enumerate(names))
    keys = ", ".join(f"<kbd>{escape(key)}</kbd> {escape(does)}" for key, does in KEYS)
    return (
        '<p id="trouble" class="failed" role="alert" hidden></p>\n'
        '<noscript><p class="muted">Without scripts the page shows what was measured and what changed.</p></noscript>\n'
        '<section id="player" aria-label="Playback" hidden>\n'
        '<div class="controls">\n'
        '<button type="button" id="play">Play</button>\n'
        '<button type="button" id="back" aria-label="to the jump before">« jump</button>\n'
        '<button type="button" id="on" aria-label="to the next jump">jump »</button>\n'
        '<input type="range" id="time" min="0" value="0" aria-label="time">\n<span id="clock"></span>\n'
        f"{_choice('rate', 'speed of play', (('0.1', '0.1x'), ('0.25', '0.25x'), ('0.5', '0.5x'), ('1', '1x'), ('2', '2x')), '1')}"
        f"{_choice('span', 'time shown', (('0', 'all'), ('60', '60 s'), ('15', '15 s'), ('4', '4 s')), '0')}"
        '<label>peaks of <select id="measure"></select></label> <button type="button" id="peak">next peak</button>\n'
        '<label><input type="checkbox" id="ghosts" checked> what else could have played</label>\n'
        '<a id="link" href="#t=0.00">link to this moment</a>\n</div>\n'
        f'<div class="sessions">{lanes}</div>\n<p class="muted">{keys}</p>\n</section>\n'
    )


def _lane(number: int, name: str, is_named: bool) -> str:
    title = f"<h2>{escape(name)}</h2>\n" if is_named else ""
    return (
        f'<section aria-label="{escape(name)}">{title}'
        f'<canvas class="stage" id="stage{number}" tabindex="0" role="img" aria-label="the skeleton of {escape(name)}"></canvas>\n'
        f'<p class="muted" id="says{number}"></p>\n'
        f'<canvas class="timeline" id="timeline{number}" role="img" aria-label="what plays over time in {escape(name)}"></canvas>\n'
        f'<div id="why{number}"></div></section>\n'
    )


def _choice(name: str, label: str, options: Sequence[tuple[str, str]], chosen: str) -> str:
    items = "".join(f'<option value="{value}"{" selected" * (value == chosen)}>{text}</option>' for value, text in options)
    return f'<label>{label} <select id="{name}">{items}</select></label>\n'


def _measures(sessions: Sequence[SessionView], names: Sequence[str]) -> str:
    """A row for each measure, a column for each session, and what the raw clips have."""
    rows: dict[str, list[str]] = {}
    for place, session in enumerate(sessions):
        for name, (value, raw) in session.measures.items():
            row = rows.setdefault(name, [""] * (len(sessions) + 1))
            row[place], row[-1] = value, raw or row[-1]
    if not rows:
        return ""
    head = ["measure", *(names if len(names) > 1 else ["session"]), "raw clips"]
    lines = [[name, *values] for name, values in rows.items()]
    return f"<h2>Measures</h2>\n{_table(head, lines, numbers=range(1, len(head)))}"


def _changes(session: SessionView, name: str) -> str:
    lines = [[_link(change.time_s), *map(escape, change.texts)] for change in session.changes]
    if not lines:
        return f"<h2>What changed in {escape(name)}</h2>\n<p>Nothing: one animation plays on.</p>\n"
    body = _table(["time", "what", "asset", "cost", "why"], lines, numbers=(0, 3), is_markup=True)
    return f"<h2>What changed in {escape(name)}</h2>\n{body}"


def _link(time_s: float) -> str:
    return f'<a href="#t={time_s:.2f}">{time_s:.2f} s</a>'


def _table(head: Sequence[str], lines: Iterable[Sequence[str]], numbers: Iterable[int] = (), *, is_markup: bool = False) -> str:
    kinds: Mapping[int, str] = dict.fromkeys(numbers, ' class="n"')
    first = "".join(f"<th{kinds.get(i, '')}>{escape(text)}</th>" for i, text in enumerate(head))
    body = "".join(_row([text if is_markup else escape(text) for text in line], kinds) for line in lines)
    return f'<div class="scroll" tabindex="0"><table><thead><tr>{first}</tr></thead><tbody>{body}</tbody></table></div>\n'


def _row(cells: Sequence[str], kinds: Mapping[int, str]) -> str:
    return f"<tr>{''.join(f'<td{kinds.get(i, str())}>{cell}</td>' for i, cell in enumerate(cells))}</tr>"
