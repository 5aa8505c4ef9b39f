"""A table from clips: for each clip a row with the cells that its own motion gives it, and the settings that such a table needs.

    clips ─► ClipFacts of each ─► cells beside the others ─► Described ─► sections of contextdb.toml

Nothing here touches the disk.
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from contextdb.cells.arguments import require_callable, require_kind, require_many_of
from contextdb.disk import MOST_PATTERNS
from contextdb.errors import ContextError, Fault, MotionError, in_quotes
from contextdb.motion.clips.clip import BY_SIZE, Clip
from contextdb.motion.clips.foot_bones import Rig
from contextdb.motion.clips.mirror import partners_of
from contextdb.motion.preparing.cells_of_clips import CONDITIONS, OUTPUTS, cells_of
from contextdb.motion.preparing.clip_facts import GAITS, NORMAL, ClipFacts, common_words, facts_of, style_of
from contextdb.motion.preparing.look import Meeting, meetings

RATE = 30.0
MOST_TURN_DPS = 1080.0
Sections = dict[tuple[str, str], dict[str, object]]
"""Of a contextdb.toml: keys and values by the path of their section."""
Tell = Callable[[int, int, str], None]
"""Takes how many clips are done of how many, and the name of the next."""


@dataclass(frozen=True, slots=True)
class Described:
    """A clip as a row of a table."""

    asset: str
    cells: Mapping[str, str]
    """Of the columns `gait`, `speed`, `direction`, `turn`, `style`, and the outputs `duration_s`, `start` and `end`."""
    facts: ClipFacts
    """What was measured; of joint clips on the actor of the first role."""

    def to_json(self) -> dict[str, Any]:
        return {"asset": self.asset, "cells": dict(self.cells), "facts": self.facts.to_json()}


def describe(clips: Sequence[Clip], *, mirrored: bool = False, progress: Tell | None = None) -> list[Described]:
    """Say of clips what the columns of a table say: gait, speed, direction, turn, style, duration, and how they begin and end.

    Parameters
    ----------
    clips : sequence of Clip
        Each under a name of its own, with at least one frame.
    mirrored : bool
        Whether each clip will play mirrored too, so that a turn to the left serves one to the right.
    progress : function, optional
        Called with the number of clips that are done, of all clips, and the name of the next.

    Returns
    -------
    list of Described
        In the order of the clips. Clips of one rig, gait and style share out all directions, turns and speeds: each cell ends a
        little beyond the middle between its clip and the next.

    Raises
    ------
    MotionError
        Two clips have one name, or a clip has no frame.
    ContextError
        `clips` are none.
    """
    clips = require_many_of(clips, Clip, "clips", "a list of Clip")
    require_kind(mirrored, bool, "mirrored", "True or False")
    if progress is not None:
        require_callable(progress, "progress")
    faults = [
        *(Fault(f"two clips are named {in_quotes(name)}.", "a name for each") for name, n in _counts(clips).items() if n > 1),
        *(Fault(f"the clip {in_quotes(clip.name)} has no frame.", "at least one") for clip in clips if not clip.n_frames),
    ]
    if faults:
        raise MotionError(*faults)
    facts = []
    for i, clip in enumerate(clips):
        if progress is not None:
            progress(i, len(clips), clip.name)
        facts.append(facts_of(clip))
    return described(facts, [clip.skeleton.names for clip in clips], mirrored)


def described(facts: Sequence[ClipFacts], rigs: Sequence[tuple[str, ...]], mirrored: bool) -> list[Described]:
    """The rows of clips that show some facts, of rigs with these bones."""
    common = common_words([each.asset for each in facts])
    styled = [replace(each, style=style_of(each.asset, common)) for each in facts]
    return [Described(each.asset, row, each) for each, row in zip(styled, cells_of(styled, rigs, mirrored), strict=True)]


def joint_clips(clips: Sequence[Clip]) -> dict[str, dict[str, int]]:
    """The clips that were recorded together, named ASSET.ROLE and of one length: asset to role to place in `clips`."""
    clips_of_asset = defaultdict[str, dict[str, int]](dict)
    for i, clip in enumerate(clips):
        asset, dot, role = clip.name.rpartition(".")
        if dot and asset and role.isidentifier():
            clips_of_asset[asset][role] = i
    names = {clip.name for clip in clips}
    sizes = {asset: {(clips[i].n_frames, clips[i].frame_time_s) for i in roles.values()} for asset, roles in clips_of_asset.items()}
    return {
        asset: dict(sorted(roles.items()))
        for asset, roles in clips_of_asset.items()
        if len(roles) > 1 and len(sizes[asset]) == 1 and asset not in names
    }


def joint_row(asset: str, facts: ClipFacts) -> Described:
    """The row of clips that were recorded together, of which `facts` are the first role's: its cells ask nothing of one body, since
    the facts that it needs are those of several actors, such as `Host.speed`."""
    own = replace(facts, asset=asset, style=NORMAL)
    return Described(asset, {**dict.fromkeys((*CONDITIONS, *OUTPUTS), ""), "duration_s": f"{own.duration_s:g}"}, own)


def _counts(clips: Sequence[Clip]) -> Counter[str]:
    return Counter(clip.name for clip in clips)


# ---- what contextdb.toml says of such a table


def condition_sections(rows: Sequence[Described]) -> Sections:
    fastest = max((row.facts.speed_mps.high for row in rows), default=0.0)
    styles = sorted({NORMAL, *(row.facts.style for row in rows)})
    return {
        ("conditions", "gait"): {"type": "enum", "values": list(GAITS), "description": "What the player asks for"},
        ("conditions", "speed"): {
            "type": "number",
            "min": 0.0,
            "max": float(math.ceil(1.5 * fastest + 1.0)),
            "unit": "m/s",
            "hysteresis": 0.1,
            "description": "How fast the character goes",
        },
        ("conditions", "direction"): {
            "type": "angle",
            "unit": "degrees",
            "hysteresis": 10.0,
            "mirror": "negate",
            "description": "Where he moves to, against the way he faces: 0 is ahead, left is positive",
        },
        ("conditions", "turn"): {
            "type": "number",
            "min": -MOST_TURN_DPS,
            "max": MOST_TURN_DPS,
            "unit": "degrees a second",
            "hysteresis": 10.0,
            "mirror": "negate",
            "description": "How fast he turns; left is positive",
        },
        ("conditions", "style"): {"type": "enum", "values": styles, "description": "How he carries himself"},
    }


def table_section(rows: Sequence[Described], asset_column: str) -> dict[str, object]:
    """What a new table of some rows is, beside its file."""
    outputs = {"duration_s": {"type": "number", "default": 0.0}, "start": {"type": "text"}, "end": {"type": "text"}}
    alone = [row for row in rows if row.cells["gait"]]
    fallback = min(alone, key=_fallback_rank, default=None)
    section: dict[str, object] = {"asset": asset_column, "policy": "collect", "outputs": outputs}
    return section | ({"fallback": fallback.asset} if fallback is not None else {})


def _fallback_rank(row: Described) -> tuple[bool, bool, float]:
    """A clip that stands comes first, then a normal one, then the slowest."""
    return row.facts.gait != "Idle", row.facts.style != NORMAL, row.facts.speed_mps.middle


@dataclass(frozen=True, eq=False)
class RigClips:
    """The clips of one rig, with the unit and the axis that their files leave open, and patterns that fit their files alone. `rig`
    is the file of the rig on which the others are put."""

    clips: Sequence[Clip]
    patterns: Sequence[str]
    roles: tuple[str, ...] = ()
    rig: str | None = None


def by_rig(clips: Sequence[Clip], paths: Sequence[str]) -> list[RigClips]:
    """The clips of each rig, with those of others that can be put on it; joint clips by their roles behind the others. `paths` are
    their files, below the folder of contextdb.toml, with "/" between names."""
    together, by_roles = meeting_rigs(clips)
    rigs = []
    for met, roles in (*((met, ()) for met in together), *((Meeting((members,)), roles) for roles, members in by_roles)):
        members = met.members
        own = {paths[i] for i in members}
        rig = paths[members[0]] if len(met.rigs) > 1 else None
        rigs.append(RigClips([clips[i] for i in members], patterns_of(sorted(own), {*paths} - own), roles, rig))
    return rigs


def meeting_rigs(clips: Sequence[Clip]) -> tuple[list[Meeting], list[tuple[tuple[str, ...], tuple[int, ...]]]]:
    """The clips of each rig, unit and axis, those of which there are most first, as they meet; and joint clips by their roles."""
    groups = defaultdict[tuple[tuple[str, ...], object], list[int]](list)
    roles_of = {i: tuple(roles) for roles in joint_clips(clips).values() for i in roles.values()}
    for i, clip in enumerate(clips):
        groups[roles_of.get(i, ()), (clip.skeleton.names, clip.metres_per_unit, clip.up)].append(i)
    ordered = sorted(groups.items(), key=lambda group: (-len(group[1]), group[1][0]))
    alone = [members for (roles, _), members in ordered if not roles]
    return meetings(clips, alone), [(roles, tuple(members)) for (roles, _), members in ordered if roles]


def patterns_of(own: Sequence[str], others: set[str]) -> list[str]:
    """Patterns of files that fit some paths, and none of some others: one for a folder, where its names can stand in one."""
    folders = defaultdict[tuple[str, str], list[str]](list)
    for path in own:
        folder, _, name = path.rpartition("/")
        stem, dot, ending = name.rpartition(".")
        folders[f"{folder}/" if folder else "", f"{dot}{ending}"].append(stem)
    names = defaultdict[str, dict[str, list[str]]](dict)
    for (folder, ending), stems in folders.items():
        beside = [path.removeprefix(folder).removesuffix(ending) for path in others if path.startswith(folder)]
        beside = [stem for stem in beside if "/" not in stem]
        for pattern in _parted(stems, beside, ""):
            names[_escaped(folder)].setdefault(pattern, []).append(_escaped(ending))
    return [f"{folder}{pattern}" for folder, own_names in names.items() for pattern in _in_one(own_names)]


def _in_one(names: Mapping[str, Sequence[str]]) -> list[str]:
    """Beginnings of names, each with its endings, as one pattern; as several where names have letters that choose."""
    every = [f"{pattern}{ending}" for pattern, endings in names.items() for ending in endings]
    if len(names) > 1 and len(every) <= MOST_PATTERNS and not set("".join(every)) & set("{},"):
        return [f"{{{','.join(every)}}}"]
    return [f"{pattern}{_one_of(endings)}" for pattern, endings in names.items()]


def _one_of(endings: Sequence[str]) -> str:
    """A pattern of some endings."""
    has_dots = all(ending.startswith(".") and not set(ending) & set("{},/") for ending in endings)
    return f".{{{','.join(ending[1:] for ending in endings)}}}" if len(endings) > 1 and has_dots else endings[0]


def _parted(own: Sequence[str], others: Sequence[str], start: str) -> Iterator[str]:
    """Beginnings of names, each with a star, that fit some names and none of some others."""
    if not any(other.startswith(start) for other in others):
        yield f"{_escaped(start)}*"
        return
    if start in own:
        yield _escaped(start)
    for letter in sorted({name[len(start)] for name in own if len(name) > len(start)}):
        longer = start + letter
        yield from _parted([name for name in own if name.startswith(longer)], others, longer)


def _escaped(text: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in text)


def motion_sections(rigs: Sequence[RigClips], table: str, markup: str | None = None, is_by_feet: bool = False) -> Sections:
    """What is compared, which databases there are, and a controller for each rig: "player", then "player_2" and so on. `is_by_feet`
    says whether standing feet move the roots of clips on the spot."""
    sections: Sections = {}
    for i, rig in enumerate(rigs):
        behind = "" if i == 0 else f"_{i + 1}"
        mirror = mirror_of(rig.clips[0])
        units = {clip.metres_per_unit for clip in rig.clips}
        sections["features", f"{table}{behind}"] = _features(rig.clips[0], mirror)
        names = [f"{table}{behind}" + ("" if j == 0 else f"_part{j + 1}") for j in range(len(rig.patterns))]
        for name, pattern in zip(names, rig.patterns, strict=True):
            sections["databases", name] = {
                "table": table,
                "clips": pattern,
                "features": f"{table}{behind}",
                "metres_per_unit": BY_SIZE if len(units) > 1 else rig.clips[0].metres_per_unit,
                "up": rig.clips[0].up,
                "mirror": bool(mirror),
                **({"rig": rig.rig} if rig.rig is not None else {}),
                **({"root": "feet"} if is_by_feet else {}),
                **({"markup": markup} if markup is not None else {}),
                **({"roles": list(rig.roles)} if rig.roles else {}),
            }
        if rig.roles:
            continue
        order = [{"database": name, "threshold": 0.0} for name in names[:-1]] + [{"database": names[-1]}]
        sections["selectors", f"{table}{behind}"] = {"order": order}
        sections["controllers", f"player{behind}"] = {"selector": f"{table}{behind}", "search_every_s": 0.1}
    return sections


def mirror_of(clip: Clip) -> list[list[str]]:
    """The pairs of bones that change places in a mirror, as patterns where these say the same; none of a rig without sides."""
    rig = Rig.of(clip)
    short = (("Left*", "Right*"),)
    for pairs in (short, rig.mirror):
        try:
            if pairs and partners_of(clip.skeleton, pairs).tolist() == partners_of(clip.skeleton, rig.mirror).tolist():
                return [list(pair) for pair in pairs]
        except (MotionError, ContextError):
            continue
    return []


def _features(clip: Clip, mirror: list[list[str]]) -> dict[str, object]:
    """The feet, the hips and the path of a rig."""
    rig = Rig.of(clip)
    channels: list[dict[str, object]] = [{"type": "position", "bone": foot, "weight": 0.75} for foot in rig.feet]
    channels += [{"type": "velocity", "bone": bone, "weight": 1.0} for bone in (*rig.feet, rig.hips)]
    ahead = [0.33, 0.67, 1.0]
    channels += [
        {"type": "trajectory", "what": "position", "at": ahead, "weight": 1.0},
        {"type": "trajectory", "what": "direction", "at": ahead, "weight": 1.5},
    ]
    return {"rate": RATE, **({"mirror": mirror} if mirror else {}), "channels": channels}


COLUMNS = (*CONDITIONS, *OUTPUTS)
