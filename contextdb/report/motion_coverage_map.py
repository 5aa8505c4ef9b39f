"""A map of movements in an HTML page: squares coloured by the share of the contexts that want a bin in which it is filled."""

from __future__ import annotations

from html import escape

from contextdb.covering import format_percent
from contextdb.errors import plural
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.measuring.moves import Counts, Map
from contextdb.report.coverage_heat import EDGES
from contextdb.report.document_html import REGION


def header_of(name: str) -> tuple[str, str]:
    """The name of a column in two lines; the second is empty where it is one word."""
    first, _, second = name.partition(" " if " " in name else "-")
    return first, second


def html_map(of: Map, frames: Counts, wanted: Floats, holes: Floats) -> str:
    """The table of one map: a square for each bin, coloured as those of table coverage are."""
    head = "".join(f'<th scope="col">{"<br>".join(filter(None, header_of(column.name)))}</th>' for column in of.columns)
    last = max((row for row in range(of.shape[0]) if frames[row].any() or wanted[row].any()), default=-1)
    body = "".join(
        f'<tr><th class="name" scope="row">{escape(of.rows[row].name)}</th>'
        + "".join(
            _square(of.words(row, column), int(frames[row, column]), float(wanted[row, column]), float(holes[row, column]))
            for column in range(of.shape[1])
        )
        + "</tr>\n"
        for row in range(last + 1)
    )
    label = escape(f"{of.caption}, in m/s")
    return (
        f'<div class="scroll" tabindex="0" {REGION}{label}"><table class="heat motion">'
        f'<thead><tr><th scope="col">m/s</th>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n'
    )


def _square(words: str, frames: int, wanted: float, hole: float) -> str:
    """One bin: coloured by the share of the contexts that want it in which it is filled."""
    label_text = f"{words}: {plural(frames, 'frame')}"
    if wanted > 0.0:
        label_text += f"; wanted in {format_percent(wanted, 1)} of the contexts, missing in {format_percent(hole, 1)}"
    filled = 1.0 - hole / wanted if wanted > 0.0 else 0.0
    colour = f"c{sum(filled >= edge for edge in EDGES)}" if wanted > 0.0 else "none"
    label = f"{frames:,}{'!' if hole > 0.0 else ''}" if frames or wanted > 0.0 else "·"
    return f'<td><span class="square {colour}" title="{escape(label_text)}">{label}</span></td>'
