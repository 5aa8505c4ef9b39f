"""The features of all clips of a build, worked out here, on all cores or on Dask: in chunks, whose size bounds the memory it takes.

Whoever works features out stores them in the cache, so that a build that was killed goes on where it stopped. Clips come back in
their own order, whoever was done first. An edge: this touches the disk.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from contextdb.disk.engines import Engines, here
from contextdb.errors import FileError, MotionError
from contextdb.files.scratch import Pile
from contextdb.motion.storage.build_inputs import Faults
from contextdb.motion.storage.clip_files import ClipFile, Extracted, extract
from contextdb.motion.storage.stored import FeatureCache

CHUNK = 16
"""So many of many clips are worked out at once."""
MANY = 64
"""For more clips it is worth to start workers."""
Chunk = tuple[ClipFile, ...]
Outcome = Extracted | MotionError | FileError
Progress = Callable[[int, int, str], None]
"""Called with how many clips are done, how many there are, and the name of the one done last."""
NOTHING = np.zeros((0, 0), np.float32)


def extract_all(
    files: Mapping[str, list[ClipFile]], cache: FeatureCache | None, progress: Progress | None, faults: Faults, engines: Engines
) -> dict[str, list[Extracted]]:
    """The features of all clips that can be read, by the names of databases."""
    listed = [file for own in files.values() for file in own]
    has_functions = any(file.schema.functions for file in listed)  # which may be anything, and are of this process
    size = CHUNK if len(listed) > MANY else 1
    chunks: list[Chunk] = [tuple(listed[i : i + size]) for i in range(0, len(listed), size)]
    outcomes: list[Outcome | None] = [None] * len(listed)
    pile, numbers, n_done = Pile(), dict[int, list[int]](), 0
    run = here if has_functions else engines
    for i, worked in run(extract_chunk, cache, chunks, named_chunk, is_much=len(listed) > MANY):
        for n, outcome in enumerate(worked, size * i):
            outcomes[n] = outcome
            if isinstance(outcome, Extracted):
                numbers[n] = [pile.put(array) for part in outcome.parts for array in (part.features, part.root)]
                bare = [replace(part, features=NOTHING, root=NOTHING) for part in outcome.parts]
                outcomes[n] = replace(outcome, file=listed[n], parts=bare)
            n_done += 1
            if progress is not None:
                progress(n_done, len(listed), listed[n].asset)
    arrays, n = pile.arrays(), 0
    extracted: dict[str, list[Extracted]] = {name: [] for name in files}
    for name, own in files.items():
        for result in outcomes[n : n + len(own)]:
            with faults.of(name):
                if not isinstance(result, Extracted):
                    assert result is not None, "each item has its result"
                    raise result
                places = iter(arrays[number] for number in numbers[n])
                parts = [replace(part, features=next(places), root=next(places)) for part in result.parts]
                extracted[name].append(replace(result, parts=parts))
            n += 1
    return extracted


def extract_chunk(cache: FeatureCache | None, chunk: Chunk) -> list[Outcome]:
    """The features of some clips; of one that cannot be read what is wrong with it."""
    outcomes: list[Outcome] = []
    for file in chunk:
        try:
            worked = extract(file, cache)
            outcomes.append(replace(worked, file=replace(file, rig=None)))  # which may be large, and is known where this goes
        except (MotionError, FileError) as error:
            outcomes.append(error)
    return outcomes


def named_chunk(chunk: Chunk) -> str:
    """What a chunk is called where it was lost."""
    return f"{chunk[0].path} to {chunk[-1].path}" if len(chunk) > 1 else str(chunk[0].path)
