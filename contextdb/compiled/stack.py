"""All masks of a compiled table in one array, addressed by codes, as the kernels want it.

A code is the number of a mask in the stack: one for each condition (for tags one for each slot), in the order of the conditions.
A wide column's code is the fact's class instead, and is behind all others; the kernels put its two digits together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contextdb import bitmask
from contextdb.bitmask import Words
from contextdb.compiled.classes import ColumnMasks, TagMasks, ValueMasks, WideMasks
from contextdb.compiled.groups import groups_of

Codes = NDArray[np.int32]
LocalCodes = tuple[int, ...] | None
"""What a column's `codes` gives for a fact; None for a fact that is ignored."""


@dataclass(frozen=True, eq=False)
class Groups:
    """Value slots (bool, enum, text, and each slot of tags, in the order of conditions) joined, see `contextdb.compiled.groups`.

    Group g joins the value slots members[edges[g]:edges[g + 1]]; its leaf for their classes v is mask firsts[g] + sum of strides
    * v. `strides` has one for each member.
    """

    members: NDArray[np.int64]
    edges: NDArray[np.int64]
    firsts: NDArray[np.int64]
    strides: NDArray[np.int64]

    @classmethod
    def of(cls, columns: Sequence[ColumnMasks], n_rows: int, first: int) -> tuple[Groups, list[Words]]:
        """Join the columns; gives the leaves of each group too, to be stacked from mask `first` on."""
        slots = [part for column in columns for part in _value_parts(column)]
        members, edges, firsts, strides, leaves = [], [0], [], [], []
        for group in groups_of([len(part) for part in slots], n_rows):
            sizes = [len(slots[slot]) for slot in group]
            joint = slots[group[0]]
            for slot in group[1:]:
                joint = (joint[:, None] & slots[slot]).reshape(len(joint) * len(slots[slot]), joint.shape[1])
            members += group
            strides += [int(np.prod(sizes[i + 1 :])) for i in range(len(sizes))]
            edges.append(len(members))
            firsts.append(first)
            leaves.append(joint)
            first += len(joint)
        return cls(*(np.array(a, np.int64) for a in (members, edges, firsts, strides))), leaves

    @property
    def arrays(self) -> tuple[NDArray[np.int64], ...]:
        """What the kernels take."""
        return self.members, self.edges, self.firsts, self.strides


@dataclass(frozen=True, eq=False)
class MaskStack:
    """The masks uint64 [n_masks, W], column after column, then the leaves of `groups`, and where each column's begin. Mask 0 holds
    every row: a fact that is ignored.

    For each condition `starts` is the number of its first mask, `n_slots` how many codes it has. `wide` int64 [n_wide, 6] is for
    each wide column: condition, first mask, layers, G, shift, number of classes K. After its layers is one mask for a missing fact.
    """

    masks: Words
    starts: tuple[int, ...]
    n_slots: tuple[int, ...]
    wide: NDArray[np.int64]
    groups: Groups

    @classmethod
    def of(cls, columns: Sequence[ColumnMasks], n_rows: int) -> MaskStack:
        """Copy the columns' masks together."""
        parts = [bitmask.full(n_rows)[None]]
        starts, wide, at = [], [], 1
        for i, column in enumerate(columns):
            part = _part(column)
            if isinstance(column, WideMasks):
                wide.append((i, at, len(column.low), column.n_coarse, column.shift, len(column.bounds) + 1))
            starts.append(at)
            parts.append(part)
            at += len(part)
        slots = tuple(len(c.masks) // 3 if isinstance(c, TagMasks) else 1 for c in columns)
        groups, leaves = Groups.of(columns, n_rows, at)
        return cls(np.concatenate([*parts, *leaves]), tuple(starts), slots, np.array(wide, np.int64).reshape(-1, 6), groups)

    @cached_property
    def n_plain(self) -> int:
        """How many codes are mask numbers; those of wide columns follow."""
        return self.n_codes - len(self.wide)

    @cached_property
    def n_codes(self) -> int:
        return sum(self.n_slots)

    def holds(self, codes: Codes) -> bool:
        """Whether every code of a context is in range."""
        plain, classes = codes[: self.n_plain], codes[self.n_plain :]
        is_plain_right = ((plain >= 0) & (plain < len(self.masks))).all()
        return bool(is_plain_right and ((classes >= -1) & (classes <= self.wide[:, 5])).all())

    def masks_of(self, codes: Codes, enabled: Words) -> Words:
        """The rows for each of many contexts' codes, int32 [N, n_codes], of those that are enabled: uint64 [N, W]."""
        found = np.broadcast_to(enabled, (len(codes), len(enabled))).copy()
        own = np.empty_like(found)
        for j in range(self.n_plain):
            found &= self.masks.take(codes[:, j], axis=0, out=own, mode="clip")  # codes are in range: "raise" would copy once more
        for i in range(len(self.wide)):
            found &= self.wide_masks(i, codes[:, self.n_plain + i])
        return found

    def wide_masks(self, i: int, classes: Codes) -> Words:
        """The masks of wide column i for many classes: int32 [N] to uint64 [N, W]."""
        _, first, n_layers, n_coarse, shift, n_classes = self.wide[i].tolist()
        size = 2 * n_coarse + (1 << shift)
        k = np.clip(classes, 0, n_classes - 1)
        g, f = k >> shift, k & ((1 << shift) - 1)
        found = np.zeros((len(k), self.masks.shape[1]), np.uint64)
        for start in range(first, first + 2 * size * n_layers, 2 * size):
            found |= self._half(start, g, f, n_coarse) & self._half(start + size, g, f, n_coarse)
        found[classes == n_classes] = self.masks[first + 2 * size * n_layers]
        found[classes < 0] = self.masks[0]
        return found

    def _half(self, start: int, g: Codes, f: Codes, n_coarse: int) -> Words:
        masks = self.masks
        half: Words = masks[start + g] | (masks[start + n_coarse + g] & masks[start + 2 * n_coarse + f])
        return half

    def codes(self, local: Sequence[LocalCodes]) -> Codes:
        """The codes of one context from what each column's `codes` gave."""
        is_wide = set(self.wide[:, 0].tolist())
        plain: list[int] = []
        classes: list[int] = []
        for i, own in enumerate(local):
            if i in is_wide:
                classes.append(-1 if own is None else own[0])
            else:
                plain += [0] * self.n_slots[i] if own is None else [self.starts[i] + code for code in own]
        return np.array(plain + classes, np.int32)


def _value_parts(column: ColumnMasks) -> list[Words]:
    """The masks of each value slot of a column, without those for a missing fact."""
    if isinstance(column, TagMasks):
        return [column.masks[i : i + 2] for i in range(0, len(column.masks), 3)]
    return [column.masks[:-1]] if isinstance(column, ValueMasks) else []


def _part(column: ColumnMasks) -> Words:
    if not isinstance(column, WideMasks):
        return column.masks
    layers = np.concatenate([column.low, column.high], axis=1)
    return np.concatenate([layers.reshape(-1, layers.shape[-1]), column.any_mask[None]])
