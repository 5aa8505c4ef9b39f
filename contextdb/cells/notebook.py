"""How things show themselves: in one line, and in a notebook as a small table of their first rows. Texts in them are escaped."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice

from contextdb.errors import in_quotes, safe_text

MOST_ROWS = 20
MOST_COLUMNS = 12
MOST_CHARACTERS = 300


def one_line(kind: str, name: str, message: str) -> str:
    """What a thing is, in one line: its public type, its name where it has one, and what there is to tell."""
    return f"<{kind} {in_quotes(name)}: {message}>" if name else f"<{kind}: {message}>"


def as_html(caption: str, heads: Sequence[str], rows: Iterable[Sequence[object]], n_rows: int | None = None) -> str:
    """A table in HTML: its first rows and columns, and how many more rows there are. Without `n_rows` the rows are counted."""
    from html import escape

    listed = iter(rows)
    first = [_line("td", row) for row in islice(listed, MOST_ROWS)]
    left = sum(1 for _ in listed) if n_rows is None else n_rows - len(first)
    more = [f"<p>and {left:,} more</p>"] if left > 0 else []
    head = f"<p>{escape(safe_text(caption, MOST_CHARACTERS))}</p>"
    return "\n".join([head, "<table>", f"<thead>{_line('th', heads)}</thead>", "<tbody>", *first, "</tbody>", "</table>", *more])


def _line(tag: str, cells: Sequence[object]) -> str:
    from html import escape

    texts = [safe_text(str(cell), MOST_CHARACTERS) for cell in cells[:MOST_COLUMNS]] + (["…"] if len(cells) > MOST_COLUMNS else [])
    return f"<tr>{''.join(f'<{tag}>{escape(cell)}</{tag}>' for cell in texts)}</tr>"
