"""One thing that is proposed for a clip, and what clips showed, stored so that only those that changed are looked at again."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from contextdb.motion.clips.clip import Clip
from contextdb.motion.clips.skeleton import Skeleton

Kind = Literal["roots", "contacts", "loops", "cuts", "tails", "noise", "starts", "turns", "targets", "duplicates"]
KINDS: tuple[Kind, ...] = get_args(Kind)
Shape = NDArray[np.float32]

N_SAMPLES = 24
"""So many poses of a clip are its shape."""
PLAIN = ("name", "frame_time_s", "metres_per_unit", "up", "notes", "key")
"""What of a clip is written as it is."""
PREPARING = 2
"""The version of what is proposed: one more whenever other marks would be for the same clip."""


@dataclass(frozen=True, slots=True)
class Proposal:
    """A mark that is proposed; or a cut of the clip's file or a path of its own for its root, which are no marks."""

    asset: str
    kind: Kind
    """One of `KINDS`."""
    tag: str | None
    """None for a cut and for a root."""
    from_s: float | None
    to_s: float | None
    """`from_s`, `to_s`: seconds since the clip's start; None is its start or its end."""
    value: float | None
    reason: str
    measure: float
    """The number that the reason is about."""

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


@dataclass
class KeptClip:
    """What a clip showed before it is compared with the markup: by kind, and its shape; as far as it was looked for."""

    key: str
    found: dict[str, list[Proposal]] = field(default_factory=dict)
    shape: Shape | None = None

    def to_json(self) -> dict[str, Any]:
        return {
            "key": self.key,
            "found": {kind: [each.to_json() for each in proposals] for kind, proposals in self.found.items()},
            "shape": None if self.shape is None else base64.b64encode(self.shape.astype("<f4").tobytes()).decode(),
        }

    @classmethod
    def of_json(cls, document: Mapping[str, Any]) -> KeptClip:
        proposals = {kind: [Proposal(**each) for each in listed] for kind, listed in document["found"].items()}
        shape = None if document["shape"] is None else np.frombuffer(base64.b64decode(document["shape"]), "<f4")
        return cls(str(document["key"]), proposals, None if shape is None else shape.reshape(2, N_SAMPLES, -1, 3))


@dataclass
class KnownProposals:
    """What clips showed, by their names. That of a clip that changed since is forgotten when it is requested."""

    clips: dict[str, KeptClip] = field(default_factory=dict)

    def of(self, clip: Clip) -> KeptClip:
        """What a clip shows as it is now; nothing of one that is new."""
        key = key_of(clip)
        if clip.name not in self.clips or self.clips[clip.name].key != key:
            self.clips[clip.name] = KeptClip(key)
        return self.clips[clip.name]


@dataclass(frozen=True, eq=False)
class ClipHead(Clip):
    """A clip whose motion is forgotten: its first frame stands for all. `key` is what `key_of` gave of the clip itself."""

    key: str = ""

    @classmethod
    def of(cls, clip: Clip, key: str) -> ClipHead:
        """The head of a clip of one frame or more."""
        values = np.broadcast_to(clip.values[:1].copy(), clip.values.shape)
        return cls(clip.name, clip.skeleton, clip.frame_time_s, values, clip.metres_per_unit, clip.up, clip.notes, key)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "values": self.values[:1].copy(), "n_frames": self.n_frames}

    def __setstate__(self, state: dict[str, Any]) -> None:
        shape = state.pop("n_frames"), state["values"].shape[1]
        self.__dict__.update(state | {"values": np.broadcast_to(state["values"], shape)})

    def to_json(self) -> dict[str, Any]:
        rig = self.skeleton
        skeleton = [rig.names, rig.parents.tolist(), rig.offsets.tolist(), rig.channels, rig.end_sites]
        first = self.values[0].tolist()
        return {"skeleton": skeleton, "first": first, "n_frames": self.n_frames} | {name: getattr(self, name) for name in PLAIN}

    @classmethod
    def of_json(cls, document: Mapping[str, Any]) -> ClipHead:
        names, parents, offsets, channels, ends = document["skeleton"]
        end_sites = tuple((int(joint), tuple(offset)) for joint, offset in ends)
        rig = Skeleton(tuple(names), np.array(parents), np.array(offsets), tuple(map(tuple, channels)), end_sites)
        values = np.broadcast_to(np.array([document["first"]]), (document["n_frames"], len(document["first"])))
        plain = {name: document[name] for name in PLAIN} | {"notes": tuple(document["notes"])}
        return cls(skeleton=rig, values=values, **plain)


def key_of(clip: Clip) -> str:
    """A digest of all that proposals for a clip depend on."""
    if isinstance(clip, ClipHead):
        return clip.key
    rig = clip.skeleton
    about = [PREPARING, clip.frame_time_s, clip.metres_per_unit, clip.up, rig.names, rig.parents.tolist(), rig.offsets.tolist()]
    digest = hashlib.blake2b(json.dumps([*about, rig.channels]).encode(), digest_size=16)
    digest.update(np.ascontiguousarray(clip.values).tobytes())
    return digest.hexdigest()
