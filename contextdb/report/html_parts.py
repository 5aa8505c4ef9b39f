"""What HTML reports are made of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from contextdb.console import printable

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def table_of(label: str, columns: Sequence[tuple[str, bool]], lines: Iterable[Sequence[str]]) -> str:
    """A table that its reader can sort; of each column its title, and whether it holds numbers."""
    head = "".join(f'<th{" class=n" if is_number else ""} scope="col">{escape(name)}</th>' for name, is_number in columns)
    body = "".join(f"<tr>{''.join(line)}</tr>\n" for line in lines)
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(label)}"><table class="sortable">'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n"
    )


def paragraph(said: str, kind: str = "") -> str:
    """A paragraph; `kind` is its class."""
    return f"<p{f' class={kind}' if kind else ''}>{escaped(said)}</p>\n"


def escaped(said: str) -> str:
    """A text of a table or a file, with nothing in it that a browser would obey."""
    return escape(printable(said))
