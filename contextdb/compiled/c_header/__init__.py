"""Compiled tables for games written in C or C++: one header that opens artefacts and answers `query` with the same masks.

The part that is the same for every project is `contextdb.core`, C99 as it is written into the header; `face` adds a struct of
facts, enums and a few functions for each table. `linking` makes the file by which a game publishes what it asks, for
`contextdb live`, of `link.h`. Nothing here touches the disk but to read these files.
"""

from __future__ import annotations

from contextdb.compiled.c_header.face import c_header_of
from contextdb.compiled.c_header.linking import c_link_of

__all__ = ["c_header_of", "c_link_of"]
