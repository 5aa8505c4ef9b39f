"""The map of every two conditions in the HTML page: how much of their least covered combination has a valid row."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from contextdb.console import printable
from contextdb.covering import PairTable, Slice, format_percent
from contextdb.report.coverage_words import covered_text, slice_cells
from contextdb.report.document_html import embedded

MOST_CONDITIONS = 24
"""The most conditions in the map: those whose own values are covered least."""
FEW_SAMPLES = 50
MOST_TOLD = 5
NOTHING_COVERED = "Pairs of conditions: of any two, some combination of values has no valid row at all."
"""Instead of a map that is 0 everywhere."""
EDGES = (0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
"""Colours change at these shares."""


def heat_map(pairs: PairTable, number: int) -> str:
    """The map, its legend and the data that opens its squares."""
    order = list(range(len(pairs.conditions)))
    if len(order) < 2:
        return ""
    if len(order) > MOST_CONDITIONS:
        worst = {at: pairs.worst(at, at) for at in order}
        order.sort(key=lambda at: (1.0 if (w := worst[at]) is None or w.covered is None else w.covered, at))
        order = sorted(order[:MOST_CONDITIONS])
    squares = [(one, other) for i, one in enumerate(order) for other in order[: i + 1]]
    if all((least := pairs.worst(*square)) is not None and least.covered == 0.0 for square in squares):
        return f'<p class="muted">{NOTHING_COVERED}</p>\n'
    named = [escape(printable(pairs.conditions[at])) for at in order]
    head = "".join(f'<th scope="col"><div title="{name}">{name}</div></th>' for name in named)
    rows, k = [], 0
    for i, one in enumerate(order):
        cells = "".join(_square(pairs, one, other, k + j) for j, other in enumerate(order[: i + 1]))
        k += i + 1
        rows.append(f'<tr><th class="name" scope="row" title="{named[i]}">{named[i]}</th>{cells}</tr>\n')
    map_id = f"map{number}"
    left_out = len(pairs.conditions) - len(order)
    more = f" {left_out} more conditions are not shown; their own values are covered better." if left_out else ""
    how = "" if pairs.method == "exact" else f" Estimated from {pairs.n_samples:,} samples, seed {pairs.seed}."
    return (
        f'<section data-map="{map_id}">\n<h3>Pairs of conditions</h3>\n'
        '<p class="muted">How much, in percent, of the least covered combination of two conditions\u2019 values has a valid row; '
        f"the diagonal is one condition alone. A square opens its values.{how}{more}</p>\n"
        f'<div class="scroll"><table class="heat"><thead><tr><td></td>{head}</tr></thead>\n'
        f"<tbody>\n{''.join(rows)}</tbody></table></div>\n"
        '<div class="detail" hidden aria-live="polite"></div>\n'
        f'<script type="application/json" id="{map_id}">{_data(pairs, order, squares)}</script>\n</section>\n'
    )


def _square(pairs: PairTable, one: int, other: int, number: int) -> str:
    worst = pairs.worst(one, other)
    names = pairs.conditions[one] if one == other else f"{pairs.conditions[one]} with {pairs.conditions[other]}"
    label_text = escape(printable(f"{names}: {_sentence(worst) if worst else 'nothing was measured'}"))
    label, colour = ("·", "none") if worst is None else (short_percent(worst), colour_of(worst))
    button = f'<button type="button" class="{colour}" data-pair="{number}" aria-pressed="false"'
    return f'<td>{button} title="{label_text}" aria-label="{escape(label)} · {label_text}">{escape(label)}</button></td>'


def _data(pairs: PairTable, order: list[int], squares: list[tuple[int, int]]) -> str:
    """What the squares open, as JSON that ends no script."""
    at = {condition: i for i, condition in enumerate(order)}
    conditions = [{"name": printable(pairs.conditions[c]), "parts": [printable(p) for p in pairs.parts[c]]} for c in order]
    opened = [{"of": [at[a], at[b]], "slices": list(_slices(pairs.slices(a, b)))} for a, b in squares]
    return embedded({"conditions": conditions, "pairs": opened})


def _slices(slices: list[Slice]) -> Iterator[list[object]]:
    """For each slice its colour, the text of its square, its sentence, and whether it is among the worst."""
    measured = sorted((s for s in slices if s.covered is not None and s.covered < 1.0), key=lambda s: s.rank)
    worst = [id(s) for s in measured[:MOST_TOLD]]
    for each in slices:
        yield [colour_of(each), short_percent(each), printable(_sentence(each)), id(each) in worst]


def _sentence(each: Slice) -> str:
    cells = slice_cells(each)
    if each.covered is None:
        return f"{cells}: no context of it is possible, or none was tried"
    named = "" if each.is_named else "; no row names it explicitly"
    few = f"; {each.n_samples} samples only" if 0 < each.n_samples < FEW_SAMPLES else ""
    return f"{cells}: {covered_text(each)} covered, {format_percent(each.share)} of the contexts{named}{few}"


def short_percent(each: Slice) -> str:
    """The covered share of a slice in a few characters: 0 and 100 are certain, <1 and >99 nearly that."""
    if each.covered is None:
        return "·"
    percent = 100.0 * (each.covered if each.is_exact else each.lower if each.covered == 1.0 else each.covered)
    if each.is_exact and each.covered in (0.0, 1.0):
        return "0" if each.covered == 0.0 else "100"
    if not each.is_exact and each.covered == 1.0:
        return f">{min(99, int(percent))}"
    return "<1" if percent < 1.0 else ">99" if percent > 99.0 else f"{percent:.0f}"


def colour_of(each: Slice) -> str:
    """The colour of a square, from orange (nothing is covered) to blue (all is)."""
    if each.covered is None:
        return "none"
    return f"c{sum(each.covered >= edge for edge in EDGES)}"
