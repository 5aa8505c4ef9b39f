"""A sheet of a workbook as columns: of .xlsx, .xlsm and .xls, read by python-calamine.

Values are read, never formulas; a merged area holds its value in each of its cells; dates, which Excel likes to make of `1-2`, are
told. A workbook that contextdb wrote gives back its texts and its types.
"""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import python_calamine as calamine

from contextdb.columns import TextColumn
from contextdb.errors import ContextDBError, Fault, Place, TableError, in_quotes, mend_for, plural, safe_text, some
from contextdb.exchange.grid import Block, Columns, column_letters, columns_of, parse_block
from contextdb.exchange.mapping import FIRST_LINE, TYPES_SHEET
from contextdb.exchange.reading import DATES, ERRORS, Reading, Remark, SheetWanted, capped, listed, text_of_value
from contextdb.exchange.xlsx_scan import Marks, comments_and_fills, is_old, marks_of, require_workbook
from contextdb.schema.settings import EMPTY, Schema, read_schema

_TEXT = {str}


def read_workbook(raw: bytes, file: str, sheet: str | None = None) -> Reading:
    """Read one sheet of a workbook: the one that is named, or cells of one ("Moves", "Moves!A1:F20", "A1:F20"), else the only one
    with cells in it. Raises TableError where the workbook is locked or broken, has no such sheet, or the sheet holds no table;
    SheetWanted where several sheets hold cells, and none is named."""
    require_workbook(raw, file)
    book = _opened(raw, file)
    names = [name for name in book.sheet_names if name.casefold() != TYPES_SHEET]
    name, block = _wanted(sheet, names, file)
    sheets = {each: _Sheet.read(book, each, file) for each in ([name] if name else names)}
    name, sheet_remarks = (name, []) if name else _only(sheets, _hidden_sheets(book), file)
    values, marks = sheets[name].values, marks_of(raw, name)
    types, remarks = _types_of_sheet(book, file)
    remarks = [*remarks, *_dates(values), *_formulas(marks.formulas)]
    grid = [list(row) if {*map(type, row)} == _TEXT else [text_of_value(value) for value in row] for row in values]
    remarks += _fill_errors(grid, marks, is_old(raw))
    remarks += _fill_merged(grid, sheets[name].merged, file)
    remarks += _hidden(grid, marks)
    wide = {top for (top, left), (bottom, right) in sheets[name].merged if left < right and top == bottom}
    own = _own_block(grid) if types is not None and block is None else None
    place = f"{file}, sheet {in_quotes(name)}"
    takes_all = block is not None and not block.is_open
    one = _own_columns(grid, own) if own else columns_of(grid, place, block, "sheet row", name, wide, takes_all)
    sheet_remarks += [Remark(f"the sheet {in_quotes(name)} of {len(names)}.")] if len(names) > 1 else []
    sheet_remarks = [*sheet_remarks, *remarks, *one.remarks]
    return Reading(
        tuple(one.columns),
        "xlsx",
        tuple(sheet_remarks),
        types or EMPTY,
        sheets=tuple(names),
        has_whole_names=types is None,
        spots=_spots(raw, name, one),
    )


def grid_of_workbook(raw: bytes, file: str, sheet: str | None = None) -> tuple[str, list[list[str]]]:
    """A sheet with its name, the one that is named or the only one with cells, as it stands. Raises as `read_workbook` does."""
    require_workbook(raw, file)
    book = _opened(raw, file)
    names = [name for name in book.sheet_names if name.casefold() != TYPES_SHEET]
    wanted = _wanted(sheet, names, file)[0]
    sheets = {each: _Sheet.read(book, each, file) for each in ([wanted] if wanted else names)}
    name = wanted or _only(sheets, _hidden_sheets(book), file)[0]
    grid = [[text_of_value(value) for value in row] for row in sheets[name].values]
    _fill_errors(grid, marks_of(raw, name), is_old(raw))
    _fill_merged(grid, sheets[name].merged, file)
    return name, grid


def sheets_of(raw: bytes, file: str) -> list[str]:
    """The sheets of a workbook that may hold a table. Raises TableError as `read_workbook` does."""
    require_workbook(raw, file)
    return [name for name in _opened(raw, file).sheet_names if name.casefold() != TYPES_SHEET]


def _opened(raw: bytes, file: str) -> calamine.CalamineWorkbook:
    try:
        return calamine.CalamineWorkbook.from_filelike(io.BytesIO(raw))
    except calamine.PasswordError:
        fault = Fault("the workbook is locked with a password.", "one without", "to save it without a password", Place(file))
    except BaseException as error:  # a class of its own for each kind of damage; at some it panics, which is no Exception
        fault = _damaged(error, file)
    raise TableError(fault)


def _damaged(error: BaseException, file: str) -> Fault:
    """What is said of a workbook that calamine cannot read; an interruption and a want of memory are passed on."""
    if isinstance(error, (KeyboardInterrupt, SystemExit, MemoryError)):
        raise error
    problem = f"the workbook is broken: {safe_text(str(error), 200)}."
    return Fault(problem, "a workbook as Excel saves it", "to open it in Excel and save it again", Place(file))


# ---- which sheet


def _wanted(sheet: str | None, names: Sequence[str], file: str) -> tuple[str | None, Block | None]:
    """The sheet and the cells that are requested, as far as they are."""
    if not names:
        raise TableError(Fault("the workbook has no sheet.", "a sheet with a table", place=Place(file)))
    if sheet is None or sheet in names:
        return sheet, None
    name, mark, cells = sheet.rpartition("!")
    block = parse_block(cells)
    name = name.strip("'") or names[0]
    if block is not None and name in names and (mark or len(names) == 1):
        return name, block
    mend = mend_for(sheet.partition("!")[0], names)
    raise TableError(Fault(f"there is no sheet {in_quotes(sheet)}.", some(names), mend, Place(file)))


def _hidden_sheets(book: calamine.CalamineWorkbook) -> frozenset[str]:
    """The sheets that Excel does not show."""
    return frozenset(one.name for one in book.sheets_metadata if not str(one.visible).endswith(".Visible"))


def _only(sheets: dict[str, _Sheet], hidden: frozenset[str], file: str) -> tuple[str, list[Remark]]:
    """The only sheet that has cells in it, and a remark about hidden ones: these are left out where another can be seen."""
    filled = [name for name, sheet in sheets.items() if any(value != "" for row in sheet.values for value in row)]
    seen = [name for name in filled if name not in hidden]
    if len(seen or filled) > 1:
        problem = f"{len(seen or filled)} sheets hold cells: {listed(seen or filled)}."
        raise SheetWanted(Fault(problem, "one of them", f"to name it: --sheet {in_quotes((seen or filled)[0])}", Place(file)))
    if not filled:
        return next(iter(sheets)), []
    if not seen:
        return filled[0], [Remark("the sheet is hidden.", f"sheet {in_quotes(filled[0])}")]
    left = [name for name in filled if name not in seen]
    return seen[0], [Remark("left out: it is hidden; --sheet reads it.", f"sheet {in_quotes(name)}", True) for name in left]


@dataclass(frozen=True)
class _Sheet:
    """The values of a sheet, and its merged areas as ((top, left), (bottom, right)), the ends counted in."""

    values: list[list[Any]]
    merged: Sequence[tuple[tuple[int, int], tuple[int, int]]] = ()

    @classmethod
    def read(cls, book: calamine.CalamineWorkbook, name: str, file: str) -> _Sheet:
        try:
            sheet = book.get_sheet_by_name(name)
            return cls(sheet.to_python(skip_empty_area=False), sheet.merged_cell_ranges or ())
        except BaseException as error:  # as above
            fault = _damaged(error, f"{file}, sheet {in_quotes(name)}")
        raise TableError(fault)


# ---- a workbook of our own


def _types_of_sheet(book: calamine.CalamineWorkbook, file: str) -> tuple[Schema | None, list[Remark]]:
    """What the sheet of types says, nothing where that cannot be used; None where there is no such sheet."""
    name = next((name for name in book.sheet_names if name.casefold() == TYPES_SHEET), None)
    if name is None:
        return None, []
    lines = [text_of_value(row[0]) if row else "" for row in _Sheet.read(book, name, file).values]
    if not lines or lines[0] != FIRST_LINE:
        return None, [Remark("left out: it is not as contextdb writes it.", f"sheet {in_quotes(name)}")]
    try:
        return read_schema("\n".join(lines), f'{file}, sheet "{name}"'), []
    except ContextDBError as error:
        why = f"the types it keeps cannot be used: {error.faults[0].message}"
        return EMPTY, [Remark(why, f"sheet {in_quotes(name)}", is_loss=True)]


def _own_block(grid: Sequence[Sequence[str]]) -> Block | None:
    """All of the sheet, as far as its first row has names; None where somebody put cells next to the table."""
    if not grid:
        return None
    width = max((at for at, name in enumerate(grid[0], 1) if name), default=0)
    is_alone = all(grid[0][:width]) and not any(any(row[width:]) for row in grid)
    return Block(0, 0, len(grid), width) if width and is_alone and len(set(grid[0][:width])) == width else None


def _own_columns(grid: Sequence[Sequence[str]], block: Block) -> Columns:
    """Every row and every text as it is, blank ones too."""
    columns = zip(*(row[: block.right] for row in grid), strict=True)
    return Columns([TextColumn.of(name, texts) for name, *texts in columns], [], range(1, len(grid)), range(block.right))


def _spots(raw: bytes, sheet: str, read: Columns) -> dict[tuple[int, str], tuple[str, str]]:
    """Comments on the cells of a table, and the colours of its rows: those that most of a row's cells have."""
    comments, fills = comments_and_fills(raw, sheet)
    if not comments and not fills:
        return {}
    spots = dict[tuple[int, str], tuple[str, str]]()
    for at, row in enumerate(read.rows):
        colours = Counter(fills.get((row, place), "") for place in read.places)
        colour = colours.most_common(1)[0][0]
        if colour:
            spots[at, ""] = ("", colour)
        for column, place in zip(read.columns, read.places, strict=True):
            if (row, place) in comments:
                spots[at, column.name] = (comments[row, place], "")
    return spots


# ---- what a person should know


def _fill_merged(grid: list[list[str]], merged: Sequence[tuple[tuple[int, int], tuple[int, int]]], file: str) -> list[Remark]:
    """Give every cell of a merged area the value of its first, and say so. Areas that lie over each other are refused."""
    remarks, n_left = [], sum(map(len, grid))
    for (top, left), (bottom, right) in merged:
        if top >= len(grid) or left >= len(grid[top]):
            continue
        block, text = Block(top, left, min(bottom + 1, len(grid)), min(right + 1, len(grid[0]))), grid[top][left]
        n_left -= (block.bottom - block.top) * (block.right - block.left)
        if n_left < 0:
            raise TableError(Fault("the workbook is broken: merged areas overlap.", "a workbook as Excel saves it").at(Place(file)))
        for row in grid[block.top : block.bottom]:
            row[block.left : block.right] = [text] * (block.right - block.left)
        remarks.append(Remark(f"merged cells; each now holds {in_quotes(text)}.", f"cells {block}"))
    return list(capped(remarks, "merged areas"))


def _dates(values: Sequence[Sequence[Any]]) -> Sequence[Remark]:
    dates = list[Remark]()
    for at, row in enumerate(values, 1):
        if {*map(type, row)} > _TEXT:  # a row of texts alone, as most are, costs nothing
            dates += [_date(value, at, column) for column, value in enumerate(row) if isinstance(value, DATES)]
    return capped(dates, "dates")


def _date(value: object, row: int, column: int) -> Remark:
    message = f"a date, {text_of_value(value)}, as Excel makes of texts such as 1-2; write it as text there, unless a day is meant."
    return Remark(message, f"cell {column_letters(column)}{row}", is_loss=True)


def _fill_errors(grid: list[list[str]], marks: Marks, is_old: bool) -> Sequence[Remark]:
    """Write the errors of Excel into their cells, which the reader of workbooks leaves empty, and say where they are."""
    if is_old:
        message = "Excel errors in an .xls file look like empty cells, which mean Any; in an .xlsx file they are reported."
        return [Remark(message, is_loss=True)]
    for row, column, error in marks.errors:
        if row < len(grid) and column < len(grid[row]):
            grid[row][column] = error
    remarks = [
        Remark(f"an error of Excel, {text}; no type reads it.", f"cell {column_letters(column)}{at}", is_loss=True)
        for at, row in enumerate(grid, 1)
        if not ERRORS.isdisjoint(row)
        for column, text in enumerate(row)
        if text in ERRORS
    ]
    return capped(remarks, "errors")


def _hidden(grid: Sequence[Sequence[str]], marks: Marks) -> list[Remark]:
    """Rows and columns with texts in them that Excel does not show: they come in, and are named."""
    rows = [row for row in marks.hidden_rows if row < len(grid) and any(grid[row])]
    width = len(grid[0]) if grid else 0
    columns = sorted(
        {at for some in marks.hidden_columns for at in range(some.start, min(some.stop, width)) if any(row[at] for row in grid)}
    )
    remarks = []
    if rows:
        remarks.append(Remark(f"{plural(len(rows), 'hidden row')} read like all others.", f"sheet row {rows[0] + 1}"))
    if columns:
        letters = ", ".join(map(column_letters, columns[:8])) + (", …" if len(columns) > 8 else "")
        remarks.append(Remark(f"{plural(len(columns), 'hidden column')} read like all others.", f"column {letters}"))
    return remarks


def _formulas(formulas: Iterable[tuple[str, str, bool]]) -> list[Remark]:
    formulas = list(formulas)
    without = [
        Remark(f"the formula ={safe_text(text)} has no value saved with it: the cell is empty.", f"cell {cell}", True)
        for cell, text, has in formulas
        if not has
    ]
    n_read = len(formulas) - len(without)
    example = next((f"cell {cell}, ={safe_text(text)}" for cell, text, has in formulas if has and text), "")
    message = f"{plural(n_read, 'formula')} read as the values that they had when the file was saved."
    return ([Remark(message, example)] if n_read else []) + list(capped(without, "formulas without a value"))
