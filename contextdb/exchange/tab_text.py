"""Columns as tab-separated text, as Excel, LibreOffice and Google Sheets read it; `contextdb.exchange.delimited` reads it here.

A cell with a tab, a line end or a double quote at its start is in double quotes, with quotes in it doubled.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from contextdb.columns import TextColumn

_NEEDS_QUOTES = re.compile(r'[\t\r\n]|^"')


def tsv_field(text: str) -> str:
    """A cell as tab-separated text has it."""
    return '"' + text.replace('"', '""') + '"' if _NEEDS_QUOTES.search(text) else text


def write_tab_text(columns: Sequence[TextColumn]) -> bytes:
    """Columns as tab-separated text in UTF-8, the names first."""
    fields = [[tsv_field(text) for text in column.texts] for column in columns]
    header = "\t".join(tsv_field(column.name) for column in columns)
    cells = [[texts[code] for code in column.codes.tolist()] for texts, column in zip(fields, columns, strict=True)]
    return "".join(f"{line}\n" for line in (header, *map("\t".join, zip(*cells, strict=True)))).encode()
