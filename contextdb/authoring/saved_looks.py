"""What was seen of many clips, kept on disk while the others are looked at, so that a run that was killed goes on where it stopped.

    .contextdb-cache/seen/KEY.json      the clips of one chunk

The key is a digest of what was asked and of the files: their sizes and times, as they were before they were read. The folder goes
when a run comes to its end. A file that is missing or cannot be read is as if it were not there. An edge: this touches the disk.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from contextdb.authoring.clip_looks import MANY, ClipAt, LeftOut, Looks, Seen, chunks_of, look_at_chunk
from contextdb.disk.engines import Engines
from contextdb.disk.own_files import (
    has_own,
    is_own_folder,
    make_own_folder,
    own_names,
    read_own,
    remove_own,
    remove_own_folder,
    write_own,
)
from contextdb.errors import FileError
from contextdb.motion.clips.clip_measures import Measures
from contextdb.motion.preparing.clip_facts import ClipFacts
from contextdb.motion.preparing.proposal import PREPARING, ClipHead, KeptClip
from contextdb.motion.storage.building import CACHE_FOLDER

VERSION = 1
SUFFIX = ".json"


@dataclass(frozen=True)
class SavedLooks:
    """The chunks in the cache of a folder."""

    folder: Path

    @classmethod
    def of(cls, folder: Path) -> SavedLooks:
        """Those of a folder of clips."""
        return cls(folder / CACHE_FOLDER / "seen")

    def key(self, looks: Looks, chunk: Sequence[ClipAt]) -> str:
        """What is asked about which clips as they are now."""
        questions = [VERSION, PREPARING, looks.facts, list(looks.kinds)]
        clips = [
            [str(at.file), at.take, at.unit, at.up, at.is_by_feet, at.rig.digest if at.rig else "", *_stamp(at.file)]
            for at in chunk
        ]
        return hashlib.blake2b(json.dumps([questions, clips]).encode(), digest_size=16).hexdigest()

    def get(self, key: str) -> list[Seen | LeftOut] | None:
        """What was seen of a chunk; None where that is not known."""
        with suppress(FileError, OSError, ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError):
            if is_own_folder(self.folder.parent) and has_own(self.folder / f"{key}{SUFFIX}"):
                return [_read(each) for each in json.loads(read_own(self.folder / f"{key}{SUFFIX}"))]
        return None

    def put(self, key: str, seen: Sequence[Seen | LeftOut]) -> None:
        """Keep what was seen of a chunk, unless something kept a clip from being looked at, which is said anew each time."""
        if any(isinstance(each, Seen) and each.faults for each in seen):
            return
        with suppress(FileError, OSError):
            make_own_folder(self.folder.parent)
            make_own_folder(self.folder, is_ignored=False)
            write_own(self.folder / f"{key}{SUFFIX}", json.dumps([_written(each) for each in seen]).encode(), syncs=False)

    def remove(self) -> None:
        with suppress(FileError, OSError):
            if not is_own_folder(self.folder.parent):
                return
            for name in own_names(self.folder):
                if name.endswith(SUFFIX):
                    remove_own(self.folder / name)
            remove_own_folder(self.folder)


def look_at_all(
    clips: Sequence[ClipAt], looks: Looks, engines: Engines, saved: SavedLooks | None = None
) -> Iterator[tuple[int, Seen | LeftOut]]:
    """What each clip shows, with its number, in any order; of many clips what was seen before is not looked at again."""
    is_much = len(clips) > MANY
    chunks = list(enumerate(chunks_of(clips)))
    size = len(chunks[0][1]) if chunks else 1
    keys = {i: saved.key(looks, chunk) for i, chunk in chunks} if saved is not None and is_much else {}
    left = []
    for i, chunk in chunks:
        known = saved.get(keys[i]) if saved is not None and keys else None
        if known is None:
            left.append((i, chunk))
        else:
            yield from enumerate(known, size * i)
    for k, seen in engines(look_at_chunk, looks, [chunk for _, chunk in left], named_chunk, is_much=is_much):
        i = left[k][0]
        if saved is not None and keys:
            saved.put(keys[i], seen)
        yield from enumerate(seen, size * i)


def named_chunk(chunk: Sequence[ClipAt]) -> str:
    """What a chunk is called where it was lost."""
    return f"{chunk[0].file} to {chunk[-1].file}" if len(chunk) > 1 else str(chunk[0].file)


def _stamp(file: Path) -> list[int]:
    try:
        status = os.stat(file)
    except OSError:
        return [0, 0]
    return [status.st_size, status.st_mtime_ns]


def _written(seen: Seen | LeftOut) -> object:
    if not isinstance(seen, Seen):
        return list(seen)
    plain = {"notes": seen.notes, "states_unit": seen.states_unit, "head": seen.head.to_json(), "measures": seen.measures.to_json()}
    facts = None if seen.facts is None else seen.facts.to_json()
    return {**plain, "facts": facts, "proposals": None if seen.proposals is None else seen.proposals.to_json()}


def _read(document: object) -> Seen | LeftOut:
    if isinstance(document, list):
        return tuple(map(str, document))
    assert isinstance(document, dict)
    facts, proposals = document["facts"], document["proposals"]
    return Seen(
        ClipHead.of_json(document["head"]),
        tuple(document["notes"]),
        bool(document["states_unit"]),
        Measures.of_json(document["measures"]),
        None if facts is None else ClipFacts.of_json(facts),
        None if proposals is None else KeptClip.of_json(proposals),
    )
