"""The page of `contextdb diff`, which a review opens: what changed in cells, what that does, contracts, and recorded moments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from contextdb.checks.contracts import proofs_of
from contextdb.checks.effects import Effects
from contextdb.commands.diff_backtest import Replayed
from contextdb.commands.diff_views import TITLE, columns_changed, headings, look_first, owners, rows_changed
from contextdb.covering.contracts import Proof
from contextdb.edits.diffing import CellChange, Diff
from contextdb.errors import Fault
from contextdb.report.document import Block, Document, Row, Rows, Section, Table
from contextdb.report.document_html import as_html
from contextdb.tables.table import Table as Sheet

CELLS = ("line", "asset", "column", "before", "after")
WORDS = {True: "holds", False: "broken", None: "open"}


def as_page(changes: Diff, effect: Effects | Fault | None, replayed: Replayed | None, more: Sequence[str] = ()) -> str:
    """The page, complete: nothing is left out for want of room. `more` are further sentences."""
    blocks = [*_cells(changes), *_effect(effect), *_contracts(changes), *([] if replayed is None else replayed.blocks)]
    name = str(changes.after.path or changes.after.name)
    of_moments = [] if replayed is None else replayed.sentences
    sentences = [*look_first(effect), changes.summary, *owners(changes), *of_moments, *more]
    gates = () if replayed is None else replayed.gates
    return as_html(Document("diff", "table", [Section(changes.after.name, name, sentences, blocks, gates)]))


def _cells(changes: Diff) -> Iterator[Block]:
    for title, parts in (("Columns", columns_changed(changes)), ("Rows", rows_changed(changes))):
        if parts:
            yield Rows(title, [Row((text,), (verb,)) for verb, text in parts], ("what", title.lower().rstrip("s")))
    cells = list(changes.cells)
    for title, is_meaning in (("Cells", True), ("Written differently, with the same meaning", False)):
        listed = [change for change in cells if change.is_meaning is is_meaning]
        if listed:
            yield Table(CELLS, [_cell(changes, change) for change in listed], title)


def _cell(changes: Diff, change: CellChange) -> Sequence[str]:
    line = changes.after.place(change.row).line
    place = f"{change.row + 1 if line is None else line:,}"
    return place, change.asset, change.column, change.before or "(empty)", change.after or "(empty)"


def _effect(effect: Effects | Fault | None) -> Iterator[Block]:
    rows = [] if effect is None else [Row(lines, (heading,)) for heading, lines in headings(effect, shows_all=True)]
    if rows:
        yield Rows(TITLE.capitalize(), rows)


def _contracts(changes: Diff) -> Iterator[Block]:
    """The contracts of both versions, those first that the change breaks."""
    before, after = (
        {proof.contract.name: proof for proof in proofs_of(table)} if isinstance(table, Sheet) else {}
        for table in (changes.before, changes.after)
    )
    rows = [_contract(name, before.get(name), after.get(name)) for name in dict.fromkeys((*after, *before))]
    rows.sort(key=lambda row: (row[2] != WORDS[False], row[1] == row[2]))
    if rows:
        yield Table(("contract", "before", "after", "what came out"), rows, "Contracts")


def _contract(name: str, before: Proof | None, after: Proof | None) -> tuple[str, str, str, str]:
    was, now = ("none" if proof is None else WORDS[proof.holds] for proof in (before, after))
    known = after or before
    why = f" {known.contract.why}" if known is not None and known.contract.why else ""
    return name, was, now, "" if known is None else known.sentence + why
