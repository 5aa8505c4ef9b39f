"""Where a row says that its clip plays otherwise than the markup of its database says; clips are not read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from contextdb.cells.row_play import RowPlay
from contextdb.disk.boundary import inside
from contextdb.errors import ContextDBError, in_quotes
from contextdb.findings import Finding
from contextdb.motion.markup.markup import Markup
from contextdb.motion.markup.reserved import ReservedTag, reserved_of
from contextdb.motion.markup.spans import Span
from contextdb.motion.storage.config import MotionConfig
from contextdb.tables.alike import finding_at
from contextdb.tables.table import Table


def check_against_markup(tables: Iterable[Table], folder: Path) -> Iterator[Finding]:
    """The contradictions of some tables of a project. Motion settings and markup that cannot be read are reported by
    `contextdb motion check`."""
    saying = [table for table in tables if table.outputs.plays is not None and table.schema.motion]
    for table in saying:
        try:
            config = MotionConfig.from_dict(table.schema.motion, tables=[table.name], file=table.schema.file)
        except ContextDBError:
            continue
        for database in (each for each in config.databases.values() if each.table == table.name):
            try:
                markup = Markup() if database.markup is None else Markup.load(inside(folder / database.markup, folder))
            except ContextDBError:
                continue
            has_mirror = bool(config.features[database.features].mirror)
            yield from _of_table(table, markup, database.markup is not None, has_mirror, database.name)


def _of_table(table: Table, markup: Markup, is_marked: bool, has_mirror: bool, database: str) -> Iterator[Finding]:
    plays = table.outputs.plays
    assert plays is not None, "only tables that say how rows play are looked at"
    for row, asset in enumerate(table.assets):
        how = RowPlay.of(plays[row].tolist())
        if how is None:
            continue
        for column, message in _contradictions(how, markup.spans_of(asset), is_marked):
            yield finding_at(table, row, "row-against-markup", "error", message, column)
        if how.mirror == "always" and not has_mirror:
            message = f"mirror is always, but the features of [databases.{database}] have no `mirror`: the row never plays."
            yield finding_at(table, row, "row-against-markup", "error", message, "mirror")


def _contradictions(how: RowPlay, spans: Iterable[Span], is_marked: bool) -> Iterator[tuple[str, str]]:
    """The column and what is wrong with it, for each part that the markup of the asset contradicts."""
    tags: dict[ReservedTag, list[Span]] = {}
    for span in spans:
        if (tag := reserved_of(span.tag)) is not None:
            tags.setdefault(tag, []).append(span)
    looping = ReservedTag.LOOPING in tags
    if how.loop is not None and is_marked and how.loop != looping:
        yield "loop", f"loop is {how.loop}, but the markup {'marks' if looping else 'does not mark'} the clip as Looping."
    if how.until == "any" and ReservedTag.NEXT_NATURAL_ONLY in tags:
        yield "until", "until is any, but the markup has NextNaturalOnly, which is left at natural transitions alone."
    weights = {span.value for span in tags.get(ReservedTag.ROOT_MOTION_WEIGHT, ())}
    if (how.root == "code" and weights - {0.0}) or (how.root == "animation" and weights - {1.0}):
        listed = ", ".join(f"{weight:g}" for weight in sorted(weight for weight in weights if weight is not None))
        yield "root", f"root is {how.root}, but the markup gives RootMotionWeight {listed}."
    for tag in (ReservedTag.EXCLUDED, ReservedTag.DO_NOT_CHOOSE):
        for span in tags.get(tag, ()):
            if how.start_s is not None and span.from_s <= how.start_s < span.to_s:
                where = f"from {span.from_s:g} to {span.to_s:g} s"
                yield "start_s", f"start_s is {how.start_s:g}, where nothing can be entered: {in_quotes(str(tag))} {where}."
