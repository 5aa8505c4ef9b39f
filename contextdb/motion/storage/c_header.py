"""The header by which a game in C or C++ plays the characters of a bundle: the core's parts for motion, as they are."""

from __future__ import annotations

from contextdb.core import motion_text

_TEXT = """
/* Motion. Written by `contextdb compile --c-motion`: do not edit.
 *
 * Characters in C99 or C++17: open a bundle of `contextdb motion build --bundle`, then see "Characters of a bundle" below. Compile
 * with -ffp-contract=off (MSVC: /fp:precise), so that all machines have the same bits. */

#ifndef CDB_MOTION_H
#define CDB_MOTION_H

#ifdef __cplusplus
extern "C" {{
#endif
#if defined(__clang__) /* numbers of words go among others, as doubles */
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wunknown-warning-option"
#pragma clang diagnostic ignored "-Wenum-float-conversion"
#endif
{motion}
#if defined(__clang__)
#pragma clang diagnostic pop
#endif
#ifdef __cplusplus
}}
#endif

#endif /* CDB_MOTION_H */
"""


def c_motion_header(reader: str) -> str:
    """The text of the header, ASCII with line feeds; `reader` is that of the tables' parts, which it begins with."""
    return reader + _TEXT.format(motion=motion_text())
