"""What an asset cell says: an asset, or `@other_table`, which refers to that table's rows.

MidAir_Dive    the asset MidAir_Dive
@dive          the rows of the table dive
"@dive"        the asset @dive: a name that begins with @ is in double quotes, a quote in it doubled
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from contextdb.cells.words import MARK

_QUOTED = re.compile(r'"(@(?:[^"]|"")*)"')


def inner_name(text: str) -> str | None:
    """The name of the table that an asset cell refers to; None for an asset."""
    bare = text.strip()
    return bare[len(MARK) :].strip() if bare.startswith(MARK) else None


def asset_name(text: str) -> str:
    """The asset that a cell names, without the quotes of one that begins with @."""
    quoted = _QUOTED.fullmatch(text.strip())
    return quoted[1].replace('""', '"') if quoted else text


def asset_text(asset: str) -> str:
    """An asset as its cell is written: in quotes where it would else refer to a table."""
    return '"' + asset.replace('"', '""') + '"' if asset.startswith(MARK) else asset


def says_nesting(texts: Iterable[str]) -> bool:
    """Whether some of an asset column's texts are more than the name of an asset."""
    return any(MARK in text and (inner_name(text) is not None or asset_name(text) != text) for text in texts)
