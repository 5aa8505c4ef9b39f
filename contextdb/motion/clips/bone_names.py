"""Names of bones as rigs write them: which bone of one rig another rig calls otherwise.

A name is a side and a core: `LeftFoot`, `Foot_L`, `l_foot`, `mixamorig:LeftFoot` and `Bip01 L Foot` are the left "foot".
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Sequence

SIDE_WORDS = dict.fromkeys(("l", "left", "lf", "lft", "lt"), "left") | dict.fromkeys(("r", "right", "rgt", "rt"), "right")
NO_WORDS = frozenset(("bone", "bip", "bip01", "bip001", "jnt", "joint", "rig", "def", "ctrl", "skel", "character", "mixamorig"))
"""Words that a rig puts before or behind all its names."""
SAME = (
    ("hips", "hip", "pelvis"),
    ("upleg", "upperleg", "thigh"),
    ("leg", "lowerleg", "lowleg", "shin", "calf", "knee"),
    ("foot", "ankle"),
    ("toe", "toes", "toebase", "ball"),
    ("arm", "upperarm", "uparm"),
    ("forearm", "lowerarm", "lowarm", "elbow"),
    ("hand", "wrist"),
    ("shoulder", "clavicle", "collar"),
)
"""Cores that rigs use for one bone."""
_FIRST = {word: group[0] for group in SAME for word in group}
_WORDS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")

LEAST_LIKE = 0.6
MOST_CHARACTERS = 200
"""Characters of a name that are looked at."""


def nearest_bones(bone: str, names: Iterable[str], most: int) -> list[str]:
    """The bones that are most like one that is missing, the nearest first: those of the same side and core, then by spelling."""
    side = _side_and_word(bone)[0]

    def likeness(name: str) -> float:
        return _alike(bone, name) - (0.3 if _side_and_word(name)[0] != side else 0.0)

    return sorted(names, key=lambda name: -likeness(name))[:most]


def meant_bone(bone: str, names: Iterable[str]) -> str | None:
    """The bone that was probably meant: of the same side, and of the same or a similar core."""
    for name in nearest_bones(bone, names, 1):
        if _side_and_word(name)[0] == _side_and_word(bone)[0] and _alike(bone, name) >= LEAST_LIKE:
            return name
    return None


def _alike(bone: str, name: str) -> float:
    """How alike the cores of two names are, or how they are written: 1 where rigs use both for one bone."""
    one, other = _side_and_word(bone)[1], _side_and_word(name)[1]
    pairs = {(one, other), (_FIRST.get(one, one), _FIRST.get(other, other))}
    return max(difflib.SequenceMatcher(None, *pair).ratio() for pair in pairs)


def side_and_core(name: str) -> tuple[str, str]:
    """The side of a name, "left", "right" or "", and what is left of it without side, namespace and the rig's own words."""
    return _side_and_core(list(_words(name)))


def _side_and_core(words: list[str]) -> tuple[str, str]:
    side, word = _side_and_rest(words)
    return side, _FIRST.get(word, word)


def without_namespace(name: str) -> str:
    """What a name is behind the namespaces and paths of tools: `LeftFoot` of `mixamorig:LeftFoot` and `|rig|LeftFoot`."""
    return re.split("[:|]", name)[-1]


def side_words(name: str) -> tuple[str, ...]:
    """The words of a name, its namespace first, with "left" or "right" for its side in any spelling."""
    stem = without_namespace(name)
    return name[: -len(stem) or None], *(SIDE_WORDS.get(word, word) for word in _words(stem))


def cores_of(names: Sequence[str]) -> list[tuple[str, str]]:
    """The side and the core of all names of a rig, without the words that all of them begin with."""
    split = [list(_words(name)) for name in names]
    common = 0
    while len(split) > 1 and all(len(words) > common + 1 for words in split) and len({words[common] for words in split}) == 1:
        common += 1
    return [_side_and_core(words[common:]) for words in split]


def _side_and_word(name: str) -> tuple[str, str]:
    """The same as the name writes it."""
    return _side_and_rest(list(_words(name)))


def _side_and_rest(words: list[str]) -> tuple[str, str]:
    side = next((SIDE_WORDS[word] for word in words if word in SIDE_WORDS), "")
    core = "".join(word for word in words if word not in SIDE_WORDS and word not in NO_WORDS)
    if not side and len(words) == 1 and words[0][:1] in "lr" and words[0][1:] in _FIRST:  # lhip, rfoot
        side, core = SIDE_WORDS[words[0][0]], words[0][1:]
    return side, core


def _words(name: str) -> Iterator[str]:
    stem = without_namespace(name)[:MOST_CHARACTERS]
    for word in _WORDS.findall(stem) if stem.isascii() else [stem]:
        folded = word.casefold()
        side = next((side for side in ("left", "right") if folded.startswith(side)), "")
        yield from (part for part in (side, folded.removeprefix(side)) if part)
