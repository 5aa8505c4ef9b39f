"""Clips that belong together: one asset with a clip for each role, on one axis of frames.

The clip of an asset for a role is named `ASSET.ROLE`, so a file is `tackle.Carrier.bvh`. A joint database is a view of a motion
database that holds all of them: each asset, as it is or mirrored, is one joint range, and frame i of it is frame i of the range of
each role. So what builds, saves, checks and plays clips does the same with these.

    cost of a joint frame = Σ over roles of what the pose and the path of its actor cost
                          + Σ over ordered pairs of roles of what the place and the facing of the one, seen by the other, cost
                          ÷ Σ of weight x features over all of these, and its bias

A place is two features, metres to the left and ahead, in units of half a metre; a facing is two, a unit vector, in units of a half,
about 30 degrees. The units are fixed, so that costs of several joint databases can be compared. The bias of a joint frame is the
mean of the biases of its roles' frames; it may be chosen when each of these may.

J joint ranges, K roles, P = K (K - 1) ordered pairs of roles, M joint frames: those of the first joint range, then of the second.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from contextdb.cells.arguments import require_kind, require_many, require_text
from contextdb.core import see_others
from contextdb.errors import Fault, MotionError, in_quotes, nearest, plural, some
from contextdb.motion.arguments import Flags
from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Ints
from contextdb.motion.features.channels import require_weight
from contextdb.motion.search.database import MotionDatabase
from contextdb.motion.search.layout import Features

N_RELATIVE = 4
"""Features of one role seen by another: left, ahead, and the facing to the left and ahead."""
PLACE = slice(0, 2)
FACING = slice(2, 4)


class Pair(NamedTuple):
    """One role and another that it sees, by their numbers."""

    role: int
    other: int


@dataclass(frozen=True, eq=False, repr=False)
class JointDatabase:
    """The joint clips of a motion database. Make it with `of`.

    Attributes
    ----------
    database : MotionDatabase
        With a range for each role of each joint range.
    roles : tuple of str, length K
    assets : tuple of str, length J
        Without the roles.
    mirrored : bool array, shape (J,)
    ranges : int64 array, shape (J, K)
        The range of each role.
    place_weight, facing_weight : float
        Of what each role sees of each other.
    """

    database: MotionDatabase
    roles: tuple[str, ...]
    assets: tuple[str, ...]
    mirrored: Flags
    ranges: Ints
    place_weight: float = 1.0
    facing_weight: float = 1.0

    @classmethod
    def of(
        cls, database: MotionDatabase, roles: Sequence[str], *, place_weight: float = 1.0, facing_weight: float = 1.0
    ) -> JointDatabase:
        """The joint clips of a database whose assets are named ASSET.ROLE. Raises MotionError for an asset that lacks the clip of a
        role, or whose clips differ in length; a clip of no role; a database without root motion; a weight not from 0 to a million.
        All faults together."""
        require_kind(database, MotionDatabase, "database", "a MotionDatabase")
        names = tuple(require_text(role, "one of roles") for role in require_many(roles, "roles", "a list of roles"))
        lengths = (database.stops - database.starts).tolist()
        faults = list(joint_faults(database.assets, lengths, names))
        if database.root is None or np.shape(database.root) != (database.n_frames, 3):
            faults.append(Fault("the database has no root motion.", "a database that was built from clips"))
        elif not np.isfinite(database.root[database.layout.frames]).all():
            faults.append(Fault("the root motion of a frame is not finite.", "finite numbers"))
        if faults:
            raise MotionError(*faults)
        groups: dict[tuple[str, bool, int], dict[str, int]] = {}
        for i, (name, mirrored) in enumerate(zip(database.assets, database.mirrored.tolist(), strict=True)):
            asset, role = divided(name, names)
            groups.setdefault((asset, mirrored, i % database.n_permutations), {})[role] = i
        if one_sided := [asset for (asset, _, _), each in groups.items() if len(each) < len(names)]:
            problem = f"the joint asset {in_quotes(one_sided[0])} is mirrored for some of its roles alone."
            raise MotionError(Fault(problem, "all clips of an asset mirrored, or none", rule="roles"))
        ranges = np.array([[each[role] for role in names] for each in groups.values()], np.int64).reshape(-1, len(names))
        return cls(
            database,
            names,
            tuple(asset for asset, _, _ in groups),
            np.array([mirrored for _, mirrored, _ in groups], np.bool_),
            ranges,
            require_weight(place_weight, "place_weight"),
            require_weight(facing_weight, "facing_weight"),
        )

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The ordered pairs of roles: length P."""
        every = range(len(self.roles))
        return tuple(Pair(i, j) for i in every for j in every if i != j)

    @cached_property
    def lengths(self) -> Ints:
        """The frames of each joint range: int64 [J]."""
        first = self.ranges[:, 0]
        return np.asarray(self.database.stops[first] - self.database.starts[first])

    @cached_property
    def firsts(self) -> Ints:
        """The first joint frame of each joint range: int64 [J]."""
        return np.asarray(np.cumsum(self.lengths) - self.lengths)

    @property
    def rate(self) -> float | None:
        """Frames a second; None for a database made from features."""
        return None if self.database.schema is None else self.database.schema.rate

    @property
    def n_frames(self) -> int:
        """M."""
        return int(self.lengths.sum())

    @cached_property
    def frame_ranges(self) -> Ints:
        """The joint range of each joint frame: int64 [M]."""
        return np.repeat(np.arange(len(self.assets)), self.lengths)

    @cached_property
    def frames(self) -> Ints:
        """The database's frame of each role in each joint frame: int64 [K, M]."""
        own = np.arange(self.n_frames) - np.repeat(self.firsts, self.lengths)
        return np.asarray(self.database.starts[self.ranges[self.frame_ranges]].T + own)

    @cached_property
    def relative(self) -> Features:
        """What each role sees of each other, in the units of costs: float32 [P, M, 4]."""
        assert self.database.root is not None, "checked when it was made"
        places = self.database.root[self.frames].astype(np.float64)
        seen = [seen_by(places[pair.role], places[pair.other]) for pair in self.pairs]
        return np.array(seen, np.float32).reshape(-1, self.n_frames, N_RELATIVE)

    @cached_property
    def own_weights(self) -> Floats:
        """What squared differences of each channel of a role are multiplied by: float64 [C]."""
        return np.asarray(self.database.weights / self._whole)

    @cached_property
    def relative_weights(self) -> tuple[float, float]:
        """The same of places and facings."""
        return self.place_weight / self._whole, self.facing_weight / self._whole

    @property
    def _whole(self) -> float:
        """The sum of weight x features."""
        sizes = np.array([columns.stop - columns.start for columns in self.database.slices])
        relative = self.place_weight * 2 + self.facing_weight * 2
        return float(len(self.roles) * (self.database.weights * sizes).sum() + len(self.pairs) * relative)

    def with_weights(
        self,
        weights: Mapping[str, float] | None = None,
        *,
        place_weight: float | None = None,
        facing_weight: float | None = None,
    ) -> JointDatabase:
        """The same with other weights of channels, places or facings; nothing is rebuilt. Raises MotionError for what is none."""
        return replace(
            self,
            database=self.database if weights is None else self.database.with_weights(weights),
            place_weight=self.place_weight if place_weight is None else require_weight(place_weight, "place_weight"),
            facing_weight=self.facing_weight if facing_weight is None else require_weight(facing_weight, "facing_weight"),
        )

    def __repr__(self) -> str:
        sizes = plural(len(self.assets), "joint range"), plural(self.n_frames, "joint frame"), f"roles {', '.join(self.roles)}"
        return f"<JointDatabase: {', '.join(sizes)}>"


def seen_by(places: Floats, others: Floats) -> Floats:
    """Places [..., 3] (x, z, heading) as other bodies see them, in the units of costs: [..., 4]."""
    one, other = (np.array(each, np.float64) for each in np.broadcast_arrays(places, others))
    seen = np.empty((*one.shape[:-1], N_RELATIVE))
    see_others(one.reshape(-1, 3), other.reshape(-1, 3), seen.reshape(-1, N_RELATIVE))
    return seen


def divided(name: str, roles: Sequence[str]) -> tuple[str, str]:
    """The asset and the role of a clip named ASSET.ROLE; the role is empty where it is none of these."""
    asset, dot, role = name.rpartition(".")
    return (asset, role) if dot and asset and role in roles else (name, "")


def role_fault(roles: Sequence[str]) -> bool:
    """Whether these cannot be the roles of joint clips: fewer than two, one twice, or one that no clip's name can end with."""
    return len(roles) < 2 or len(set(roles)) < len(roles) or any(not role.strip() or "." in role for role in roles)


def joint_faults(names: Sequence[str], lengths: Sequence[int], roles: Sequence[str]) -> Iterator[Fault]:
    """What is wrong with clips of these names and of so many frames, that they do not belong together."""
    if role_fault(roles):
        yield Fault(f"the roles are {some(roles) or 'none'}.", "two names or more, each once and without a dot", rule="roles")
        return
    clips_of_asset: dict[str, dict[str, int]] = {}
    for name, length in zip(names, lengths, strict=True):
        asset, role = divided(name, roles)
        if not role:
            last = name.rpartition(".")[2]
            near = nearest(last, roles) if last != name else None
            mend = f"{name.rpartition('.')[0]}.{near}" if near else ""
            yield Fault(f"the clip {in_quotes(name)} is of no role.", f"names such as {name}.{roles[0]}", mend, rule="roles")
        else:
            clips_of_asset.setdefault(asset, {})[role] = length
    for asset, clips in clips_of_asset.items():
        if missing := [role for role in roles if role not in clips]:
            there = f"a clip for each role: {', '.join(f'{asset}.{role}' for role in roles)}"
            yield Fault(f"the joint asset {in_quotes(asset)} has no clip for {some(missing)}.", there, rule="roles")
        elif len(set(clips.values())) > 1:
            role_lengths = ", ".join(f"{role} {plural(clips[role], 'frame')}" for role in roles)
            yield Fault(
                f"the clips of the joint asset {in_quotes(asset)} differ in length: {role_lengths}.",
                "clips that were recorded together, cut at the same frames",
                rule="roles",
            )
