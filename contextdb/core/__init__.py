"""The core: what a compiled table answers, in C99. The same sources are the header of games and this package's extension.

    boxes.h, count.h    boxes of contexts for coverage: counted, searched, compared
    python_*.h, abi.h   what Python sees of them: the extension `contextdb.core._core`, by the stable ABI
    poses.h             all parts of the poses, in order: functions, rotations, paths, frames, a rig, and the stages of a pose
    core.h              all parts for tables, in order: masks and classes, programs, a table's query, outputs, picks
    motion.h            all parts for motion: the searches for the best frame, for that of several characters, and controllers
    batch.h, choose.h   many contexts and many characters at once; fact_columns.h and keys.h are their columns and counters

Only this file imports the extension. Nothing here keeps state but the objects that it gives out, and no array is copied: a `Table`
holds the arrays and texts that it is made of."""

from __future__ import annotations

import re
from functools import cache

try:
    from contextdb.core._core import (
        Answer,
        Batch,
        Boxes,
        Choices,
        Controllers,
        Frames,
        Live,
        PoseFrames,
        Poses,
        Program,
        Shared,
        Table,
        Ways,
        aim,
        align,
        begin_one_off,
        begin_roles,
        bend_legs,
        count_holders,
        direction_of,
        feel_ground,
        fill_plays,
        fill_ranges,
        filter_kinds,
        forbid_others,
        going,
        group_keys,
        hash_keys,
        list_rows,
        lower_hips,
        motion_from,
        motion_then,
        move_bodies,
        pack_codes,
        phase,
        place_joints,
        pose_columns,
        read_column,
        risen,
        row_at,
        search_joint,
        see_others,
        shortest_part,
        stand_legs,
        steer_paths,
        turn_rows,
        unpack_codes,
        until_down_s,
        warp,
        write_ends,
        write_paths,
    )
except ImportError as error:
    problem = "contextdb's core is not built for this Python"
    mend = "run `python build_core.py` in the checkout, or install contextdb again"
    raise ImportError(f"{problem}: {mend} ({error})", name="contextdb.core") from None

__all__ = [
    "FLAT",
    "SLOTS",
    "VALUE",
    "WIDE",
    "Answer",
    "Batch",
    "Boxes",
    "Choices",
    "Controllers",
    "Frames",
    "Live",
    "PoseFrames",
    "Poses",
    "Program",
    "Shared",
    "Table",
    "Ways",
    "aim",
    "align",
    "begin_one_off",
    "begin_roles",
    "bend_legs",
    "count_holders",
    "direction_of",
    "feel_ground",
    "fill_plays",
    "fill_ranges",
    "filter_kinds",
    "forbid_others",
    "going",
    "group_keys",
    "hash_keys",
    "header_text",
    "list_rows",
    "lower_hips",
    "motion_from",
    "motion_text",
    "motion_then",
    "move_bodies",
    "pack_codes",
    "phase",
    "place_joints",
    "pose_columns",
    "read_column",
    "risen",
    "row_at",
    "search_joint",
    "see_others",
    "shortest_part",
    "stand_legs",
    "steer_paths",
    "turn_rows",
    "unpack_codes",
    "until_down_s",
    "warp",
    "write_ends",
    "write_paths",
]

VALUE, FLAT, WIDE, SLOTS = 1, 2, 3, 4
"""How the masks of a column are kept; see `contextdb.compiled.classes`."""


@cache
def header_text() -> str:
    """The parts of the core in their order, C99 and C++11, as the header for games has them."""
    return _parts_of("core.h")


@cache
def motion_text() -> str:
    """The parts for motion, behind those of `header_text`."""
    return "".join(_parts_of(name) for name in ("poses.h", "motion.h", "motion_game.h"))


def _parts_of(name: str) -> str:
    """The text of the parts that a file includes, with what else of it is no comment before the first part."""
    from importlib.resources import files

    folder = files("contextdb.core")
    lines = folder.joinpath(name).read_text(encoding="ascii")
    text, is_begun = "", name == "core.h"
    for line in lines[lines.index("*/") + 3 :].splitlines(keepends=True):
        part = re.match(r'#include "(\w+\.h)"$', line.rstrip())
        if part:
            text += folder.joinpath(part[1]).read_text(encoding="ascii")
        elif not (is_begun and line.isspace()):
            text += line
    return _with_bodies_apart(text)


def _with_bodies_apart(text: str) -> str:
    """The text, in which a public function is only declared where another file has it."""
    function = re.compile(r"^(CDB_API [^{;]*?\))\n(\{\n.*?^\})$", re.M | re.S)
    return function.sub(r"\1\n#if CDBI_HAS_BODIES\n\2\n#else\n;\n#endif", text)
