"""A sheet painted in a window of the terminal: where its columns stand, how it is styled and scrolled. It takes no keys.

Only what is seen is read and painted: see `tui.widgets.grid_paint`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import ClassVar, Self

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual.filter import LineFilter
from textual.geometry import Region, Size
from textual.reactive import reactive
from textual.scroll_view import ScrollView
from textual.scrollbar import ScrollBar, ScrollBarRender
from textual.strip import Strip

from contextdb.schema.policies import lets_choose

from ..contrast import readable
from ..drawn import SameWidths
from ..model.alignment import MOST_ALIGNED, indented
from ..model.layout import COMPACT, MOST_TEXTS, NARROWEST, WIDEST, Layout, fitted_width, layout, name_lines, name_width
from ..model.sheet import Sheet
from .grid_paint import Look, Painter

GROUNDS = (
    "row", "row-valid", "row-picked", "frozen", "header", "header-kind", "header-leaves", "header-chosen", "gutter", "test",
    "selected", "cursor", "cursor-away", "flash", "tint-red", "tint-amber", "tint-green", "tint-blue", "tint-violet",
)  # fmt: skip
MEANT = ("text", "any", "muted", "name", "failing", "fault", "disabled", "valid", "line", "on-cursor")
STEP, WIDEST_BY_KEYS = 2, 200
"""A key makes a column wider by so many cells; no wider than the second."""
ROOM_FOR_CHANCES = 100
"""In a narrower window chances stand beside the assets, where there is room."""
FLASH_S = 0.4
"""So long a cell is lit that has just begun to fail."""


class GridView(ScrollView, inherit_bindings=False):
    """A sheet as it is seen."""

    ALLOW_SELECT = False
    COMPONENT_CLASSES: ClassVar[set[str]] = {f"grid--{name}" for name in (*GROUNDS, *MEANT)}

    DEFAULT_CSS = """
    GridView {
        background: $surface; color: $foreground; scrollbar-size-vertical: 1; scrollbar-size-horizontal: 1;
        scrollbar-background: $panel; scrollbar-color: $foreground 25%; scrollbar-corner-color: $panel;
        scrollbar-background-hover: $panel; scrollbar-background-active: $panel;
        .grid--row { background: $surface; }
        .grid--row-valid { background: $success 8%; }
        .grid--row-picked { background: $success 18%; }
        .grid--frozen { background: $surface; }
        .grid--header { background: $panel; }
        .grid--header-kind { background: $panel; }
        .grid--header-leaves { background: $panel; text-style: underline; }
        .grid--header-chosen { background: $primary 40%; }
        .grid--gutter { background: $panel; }
        .grid--tint-red { background: red 45%; }
        .grid--tint-amber { background: orange 45%; }
        .grid--tint-green { background: green 50%; }
        .grid--tint-blue { background: dodgerblue 45%; }
        .grid--tint-violet { background: violet 40%; }
        .grid--test { background: $boost; text-style: bold; }
        .grid--selected { background: $primary 35%; }
        .grid--cursor { background: $block-cursor-background; color: $block-cursor-foreground; text-style: bold; }
        .grid--flash { background: $warning 45%; }
        .grid--cursor-away { background: $primary 50%; text-style: bold; }
        .grid--text { color: $foreground; }
        .grid--any { color: $foreground 45%; }
        .grid--muted { color: $foreground 55%; }
        .grid--name { color: $foreground; text-style: bold; }
        .grid--failing { color: $text-warning; }
        .grid--fault { color: $text-error; text-style: bold underline; }
        .grid--disabled { color: $foreground 40%; text-style: strike; }
        .grid--valid { color: $text-success; text-style: bold; }
        .grid--line { color: $foreground 18%; }
        .grid--on-cursor { color: $block-cursor-foreground; text-style: bold; }
        &:ansi .grid--selected, &:ansi .grid--header-chosen, &:ansi .grid--cursor-away {
            background: ansi_blue; color: ansi_bright_white;
        }
        &:ansi .grid--row-valid { background: ansi_default; }
        &:ansi .grid--row-picked { background: ansi_default; text-style: bold; }
    }
    """

    has_test_row: ClassVar[bool] = True
    is_in_test_row = reactive(False)
    """Whether the cursor is in the test row."""
    has_new_row: ClassVar[bool] = True
    """Whether an empty row stands below the last one, to type or paste a new one."""
    goes_to_new_row = reactive(False)
    """Whether the cursor went to that row; where no row is shown it is there anyhow."""

    def __init__(self, sheet: Sheet) -> None:
        super().__init__()
        self.sheet = sheet
        self._painter = Painter(sheet, self._style)
        self._styles: dict[tuple[str, str], Style] = {}
        self._widths: dict[str, int] = {}
        """The widths that a person gave to columns."""
        self._own_widths: dict[str, tuple[int, int]] = {}
        """For the other columns the width with the name in one line, and with the name wrapped."""
        self._names = (False, 1)
        """Whether names are wrapped, and how many lines the longest one takes."""
        self._layout: Layout | None = None
        self._laid_out = sheet.table
        """The table that the layout is of: a step may have made another one before the screen is reported."""
        self._said_shape = (-1, -1, -1)
        self._fields: tuple[str, ...] = ()
        """The fields of the test row behind the columns, that the layout is of."""
        self._extra: int | None = None
        self._had_chances = False
        self._painted: dict[int, Strip] = {}
        """The lines that were painted last, where the grid was then."""
        self._painted_at: tuple[object, ...] = ()
        self._rendered: Look | None = None
        """Where the grid is, while lines are rendered."""
        self._had_focus = False
        self._scrolled_in: tuple[object, ...] = ()
        """The sizes that the scroll bars are of."""

    def open(self, sheet: Sheet) -> None:
        self.sheet = sheet
        self._painter = Painter(sheet, self._style)
        self._widths.clear()
        self._own_widths.clear()
        self.is_in_test_row = self.goes_to_new_row = False
        self.changed()

    @property
    def is_in_new_row(self) -> bool:
        """Whether the cursor is in the empty row below the last one."""
        return self.has_new_row and not self.is_in_test_row and (self.goes_to_new_row or not len(self.sheet.view))

    @property
    def field(self) -> int:
        """The column of the test row that the cursor is in: a column of the table, or behind the last one a fact that is none."""
        n_columns, extra = self.sheet.shape[1], self._extra
        is_there = self.is_in_test_row and extra is not None and extra < len(self.sheet.extra)
        return n_columns + extra if is_there and extra is not None else self.sheet.cursor[1]

    def go_to_field(self, column: int) -> None:
        """Put the cursor of the test row on a field."""
        n_columns = self.sheet.shape[1]
        self._extra = column - n_columns if column >= n_columns else None
        if column < n_columns:
            self.sheet.go(self.sheet.cursor[0], column)

    def changed(self) -> None:
        """Show the sheet as it is now, after an edit, a filter or another fact."""
        self._painter.changed()
        self._layout = None
        self._fit()
        self.show_cursor(is_after_edit=True)
        self._repaint()

    def _repaint(self) -> None:
        """Paint the lines that look otherwise than they did."""
        look = self.look
        if not self.is_mounted or self._place(look) != self._painted_at:
            self.refresh()
            return
        others = [y for y in range(look.height) if self._painted.get(y) != self._painter.line(y, look)]
        if others:
            self.refresh(*(Region(0, y, look.layout.width, 1) for y in others))

    @staticmethod
    def _place(look: Look) -> tuple[object, ...]:
        return look.layout.width, look.height, look.left, look.top

    def requested_again(self) -> None:
        """Show the answers to other facts. Only lines that look otherwise are painted; cells that have just begun to fail flash."""
        rows = self._painter.requested_again()
        if rows is None or self.grid_layout.width != self.window.width or not self.is_mounted:
            self.changed()
            return
        self._paint_rows(rows)
        look = self.look
        self.refresh(Region(0, max(look.test_line - 1, 0), look.layout.width, 2))
        if self._painter.began:
            self.set_timer(FLASH_S, partial(self._flashed, self._painter.began))

    def _flashed(self, cells: frozenset[tuple[int, int]]) -> None:
        """Let some cells flash no more."""
        gone = self._painter.flashing & cells
        self._painter.flashing -= gone
        self._paint_rows(sorted({row for row, _ in gone}))

    def _paint_rows(self, rows: Sequence[int]) -> None:
        look = self.look
        seen = [row for row in rows if look.top <= row < look.top + look.n_body]
        if seen:
            self.refresh(*(Region(0, look.n_headers + row - look.top, look.layout.width, 1) for row in seen))

    def forget_widths(self) -> None:
        """Fit the columns again that nobody gave a width: their texts are others now."""
        self._own_widths.clear()
        self.changed()

    def refit(self) -> None:
        """Make room where something new is beside cells; no column becomes narrower."""
        for at, column in enumerate(self.sheet.table.columns):
            beside = min(self._beside(at), WIDEST)
            if column.name in self._widths:
                self._widths[column.name] = max(self._widths[column.name], beside)
            elif column.name in self._own_widths:
                wide, narrow = self._own_widths[column.name]
                self._own_widths[column.name] = max(wide, beside), max(narrow, beside)

    def autofit(self) -> None:
        """Make each column as wide as its texts and its name; one without texts as wide as at first."""
        for at, column in enumerate(self.sheet.table.columns):
            if any(text.strip() for text in column.texts):
                self._widths[column.name] = self._fitted(at, WIDEST)
            else:
                self._widths.pop(column.name, None)
        self.changed()

    def set_width(self, column: int, width: int | None) -> None:
        """Make a column so wide; None: as wide as its texts."""
        self._widths[self.sheet.header(column).name] = self._fitted(column, WIDEST) if width is None else width
        self.changed()

    def action_widen(self, steps: int) -> None:
        """Make the selected columns that are seen wider or narrower by so many steps."""
        widths, hidden, block = self.grid_layout.widths, self.sheet.hidden, self.sheet.block
        for at in range(block.left, block.right):
            if not hidden[at]:
                width = max(NARROWEST, min(widths[at] + steps * STEP, WIDEST_BY_KEYS))
                self._widths[self.sheet.table.columns[at].name] = width
        self.changed()

    @property
    def window(self) -> Size:
        """The cells there are to paint on."""
        return self.scrollable_content_region.size

    @property
    def grid_layout(self) -> Layout:
        """Where the columns stand."""
        fields = tuple(c.name for c in self.sheet.extra) if self.has_test_row else ()
        is_same = self._laid_out is self.sheet.table and self._fields == fields
        if self._layout is None or self._layout.width != self.window.width or not is_same:
            self._laid_out, self._fields = self.sheet.table, fields
            self._layout, is_wrapped, n_names = self._laid(fields)
            self._names = is_wrapped, n_names
        return self._layout

    @property
    def _has_chances(self) -> bool:
        """Whether rows may have a chance; once they had, their column stays, so that nothing moves while one types facts."""
        settings, query = self.sheet.table.settings, self.sheet.query
        self._had_chances = self._had_chances or (self.has_test_row and not query.is_empty and lets_choose([settings.policy]))
        return self._had_chances

    def _laid(self, fields: Sequence[str]) -> tuple[Layout, bool, int]:
        """Where the columns stand; whether names are wrapped, since not all were seen else; how many lines the longest takes."""
        names = [*(c.name for c in self.sheet.table.columns), *fields]
        hidden, asset = self.sheet.hidden, self.sheet.table.asset_column
        n_frozen = self.sheet.visible_columns.n_frozen([c.name for c in self.sheet.table.columns], asset)

        def made(is_wrapped: bool) -> Layout:
            widths = [0 if at < len(hidden) and hidden[at] else self._width(at, name, is_wrapped) for at, name in enumerate(names)]
            return layout(
                widths,
                n_frozen,
                self.sheet.table.n_rows,
                self.window.width,
                self.window.width >= ROOM_FOR_CHANCES and self._has_chances,
            )

        plain = made(False)
        if plain.total <= self.window.width:
            return plain, False, 1
        wrapped = made(True)
        lines = (len(name_lines(name, width - 1)) for name, width in zip(names, wrapped.widths, strict=True) if width)
        return wrapped, True, max(lines, default=1)

    @property
    def look(self) -> Look:
        x, y = self.scroll_offset
        height, is_in_test_row = self.window.height, self.is_in_test_row
        made = self.grid_layout
        return Look(
            made,
            height,
            x,
            y,
            is_in_test_row,
            self.has_focus,
            self.has_test_row,
            self.is_in_new_row,
            self.has_new_row,
            *self._names,
            self.field,
        )

    def cell_region(self) -> Region:
        """Where the cell of the cursor is on the screen, without its mark."""
        look, row, column = self.look, self._cursor_row, self.field
        y = look.test_line if self.is_in_test_row else look.n_headers + row - look.top
        x = look.layout.place(column, look.left)
        return Region(self.content_region.x + x + 1, self.content_region.y + y, look.layout.widths[column] - 1, 1)

    @property
    def _cursor_row(self) -> int:
        """The row of the view that the cursor is in; behind the last one for the empty row."""
        return len(self.sheet.view) if self.is_in_new_row else self.sheet.cursor[0]

    def render_lines(self, crop: Region) -> list[Strip]:
        """Render some lines; where the grid is at present is worked out once for all of them."""
        self._rendered = self.look
        try:
            return super().render_lines(crop)
        finally:
            self._rendered = None

    def render_line(self, y: int) -> Strip:
        look = self._rendered or self.look
        if (place := self._place(look)) != self._painted_at:
            self._painted, self._painted_at = {}, place
        self._painted[y] = strip = self._painter.line(y, look)
        return strip

    def notify_style_update(self) -> None:
        self._styles.clear()
        self._painter.forget_lines()
        super().notify_style_update()

    def _width(self, at: int, name: str, is_wrapped: bool) -> int:
        if name in self._widths:
            return self._widths[name]
        if name not in self._own_widths:
            self._own_widths[name] = self._width_of(at, name)
        return self._own_widths[name][is_wrapped]

    def _width_of(self, at: int, name: str) -> tuple[int, int]:
        """How wide a column is at first: with its name in one line, and with its name wrapped."""
        widest = WIDEST if name == self.sheet.table.asset_column else COMPACT
        header = self.sheet.header(at)
        wrapped = max(min(name_width(name), COMPACT) + 1, len(header.kind) + 3)
        if header.is_extra:
            wide = self._fitted(at, widest)
            return wide, min(wide, max(wrapped, len("no column") + 1))
        cells = max(self._fitted_cells(at, [], widest), self._beside(at))
        kind = f"{header.kind} · {header.unit}" if header.unit else header.kind
        wide = min(max(cells, min(max(cell_len(name) + 4, cell_len(kind) + 3), widest)), WIDEST)
        return wide, min(wide, max(wrapped, cells))

    def _fitted(self, at: int, widest: int) -> int:
        header = self.sheet.header(at)
        kind = f"{header.kind} · {header.unit}" if header.unit else header.kind
        if header.is_extra:
            return min(max(len("no column"), cell_len(header.name), cell_len(kind)) + 2, widest)
        fitted = self._fitted_cells(at, [header.name + " ↕", f"{kind} "], widest)
        return min(max(fitted, self._beside(at)), WIDEST)

    def _fitted_cells(self, at: int, heads: Sequence[str], widest: int) -> int:
        indent, column = self.sheet.indent(at), self.sheet.table.columns[at]
        aligned = [indented(text, indent) for text in column.texts[:MOST_ALIGNED]] if indent else []
        return fitted_width(column, [*heads, *aligned], widest)

    def _beside(self, at: int) -> int:
        """How wide a column must be for what is at the right of its cells: the actors of a role, the rows of inner tables."""
        query, column = self.sheet.query, self.sheet.table.columns[at]
        role = query.role_of(column.name)
        is_opener = query.is_nested and at == self.sheet.asset_at
        if role is None and not is_opener:
            return 0
        longest = max((cell_len(text) for text in column.texts[:MOST_TEXTS]), default=0)
        if role is None:
            return longest + len(" 000 of 000 rows") + 1
        return longest + max(cell_len(str(actor.get("name", ""))) for actor in query.actors[role]) + 3

    def _scrolled_into_view(self, row: int, column: int) -> tuple[int, int]:
        """The cursor, where the far corner of the selection is not seen, so that a paste of many rows does not carry one away."""
        look, here = self.look, self.sheet.cursor
        columns = {*range(look.layout.n_frozen), *look.layout.visible(look.left)}
        if column in columns and 0 < row - here[0] < look.n_body:  # all of it has room, such as rows pasted behind the last one
            return row, column
        is_seen = look.top <= row < look.top + max(look.n_body, 1) and column in columns
        return (row, column) if is_seen else here

    def _style(self, ground: str, meant: str) -> Style:
        if (ground, meant) not in self._styles:
            under = self.get_component_rich_style(f"grid--{ground}")
            over = self.get_component_rich_style(f"grid--{meant}")
            plain = Style(bgcolor=under.bgcolor, bold=under.bold, underline=under.underline)
            is_terminals = under.bgcolor is not None and under.bgcolor.number is not None
            colour = under.color if is_terminals else over.color  # no other is sure to be read on the terminal's own
            added = Style(color=colour, bold=over.bold or None, underline=over.underline or None, strike=over.strike or None)
            whole = plain + added
            self._styles[ground, meant] = self._filtered(whole if meant == "line" else readable(whole), is_read=meant != "line")
        return self._styles[ground, meant]

    def _filtered(self, style: Style, is_read: bool) -> Style:
        """A style as the app's filters make it."""
        segments = [Segment("x" if is_read else "│", style)]
        for one in super().get_line_filters():
            segments = one.apply(segments, self.background_colors[1])
        return segments[0].style or style

    def get_line_filters(self) -> Sequence[LineFilter]:
        """What texts ask for; each style is filtered once, in place of every cell of every line."""
        return [one for one in super().get_line_filters() if isinstance(one, SameWidths)]

    def _fit(self) -> None:
        rows, total = len(self.sheet.view), self.grid_layout.extent
        if self._said_shape != (rows, total, self.look.n_headers):
            self._said_shape = (rows, total, self.look.n_headers)
            self.virtual_size = Size(total, rows + self.has_new_row + self.look.n_headers)

    def on_resize(self) -> None:
        self._layout = None
        self._fit()
        self.show_cursor(is_after_edit=True)

    def focus(self, scroll_visible: bool = True) -> Self:
        """Take the keys; nothing is painted before they come."""
        self.app.call_later(self._take_keys, scroll_visible)
        return self

    def _take_keys(self, scroll_visible: bool) -> None:
        if self.is_attached:
            self.screen.set_focus(self, scroll_visible=scroll_visible)

    def _scroll_update(self, virtual_size: Size) -> None:
        """Textual paints both scroll bars, and every line with them, after each layout of the screen: only other sizes need it."""
        sizes = virtual_size, self.size, self.container_size, self.scrollbars_enabled
        if sizes != self._scrolled_in:
            super()._scroll_update(virtual_size)
            self._scrolled_in = virtual_size, self.size, self.container_size, self.scrollbars_enabled

    def watch_scroll_y(self, old_value: float, new_value: float) -> None:
        """Textual paints the whole bar for every row scrolled by: in a long table it looks the same for many."""
        bar = self.vertical_scrollbar
        if self.show_vertical_scrollbar and self._thumb(bar.position) == self._thumb(new_value):
            bar.set_reactive(ScrollBar.position, bar.validate_position(new_value))
        super().watch_scroll_y(old_value, new_value)

    def _thumb(self, position: float) -> int:
        """Where the thumb of the vertical bar begins, in the smallest steps that are painted: see `ScrollBarRender.render_bar`."""
        bar = self.vertical_scrollbar
        virtual, window, size = bar.window_virtual_size, bar.window_size, bar.size.height
        if not (virtual and window and size and virtual != window):
            return 0
        thumb = max(1, window / (virtual / size))
        return int((size - thumb) * position / (virtual - window) * len(ScrollBarRender.VERTICAL_BARS))

    def watch_has_focus(self, _has_focus: bool) -> None:
        """No style here depends on the keys. Textual would work out all of them again, and paint the scroll bars: every line."""

    def refresh(self, *regions: Region, repaint: bool = True, layout: bool = False, recompose: bool = False) -> Self:
        """Paint again. Textual asks for all when the keys come or go, and then the line of the cursor alone looks otherwise."""
        is_all = not regions and repaint and not (layout or recompose)
        if is_all and self.is_mounted and self.has_focus != self._had_focus:
            self._had_focus = self.has_focus
            look = self.look
            y = look.test_line if self.is_in_test_row else look.n_headers + self._cursor_row - look.top
            regions = (Region(0, y, look.layout.width, 1),)
        return super().refresh(*regions, repaint=repaint, layout=layout, recompose=recompose)

    def show_cursor(self, is_after_edit: bool = False) -> None:
        """Scroll so that the cursor, or the corner that Shift moves, is seen; behind another tab once it is seen again. After an
        edit of many cells it is enough that one of the two is seen."""
        if not self.size:
            return
        look, (row, column) = self.look, self.sheet.selection.far if not self.is_in_test_row else (0, self.field)
        row = self._cursor_row if self.is_in_new_row else row
        is_wide = self.sheet.selection.far != self.sheet.cursor
        if is_after_edit and is_wide and not (self.is_in_test_row or self.is_in_new_row):
            row, column = self._scrolled_into_view(row, column)
        top = min(max(look.top, row - max(look.n_body, 1) + 1), row) if not self.is_in_test_row else look.top
        left = look.layout.scroll_to(column, look.left) if look.layout.widths else 0
        if (top, left) != (look.top, look.left):
            self.scroll_to(left, top, animate=False, force=True, immediate=True)
