"""Steps of the search on 16 numbers at once, as numba intrinsics.

Written as vector instructions, because the compiler makes none of loops over 16 numbers that may overlap in memory; a machine
without registers of that width works on them in parts. They work in float32 and answer with a mask: bit i says whether lane i is at
most the limit. Rounding is the caller's concern: a limit has to be so much higher that no lane is missed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 16
_I32, _I64 = ir.IntType(32), ir.IntType(64)
_LANES = ir.VectorType(ir.FloatType(), LANES)
_ROUNDING = ("contract", "nsz")
"""Multiply and add may be one instruction."""


@intrinsic
def costs_at_most(typing, blocks, box, query, weights, start, stop, totals, limit):
    """Which frames of a box cost at most `limit` so far: an int64 mask.

    blocks float32 [B, F, 16]; query, weights float32 [F]. Adds features start … stop - 1 to `totals` float32 [16], so that a box
    can be given up after the first features.
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        base = builder.mul(builder.mul(arguments[1], lanes.size(0, 1)), _I64(LANES))

        def apart(feature: Any) -> tuple[Any, Any]:
            values = lanes.load(0, builder.add(base, builder.mul(feature, _I64(LANES))))
            return lanes.everywhere(3, feature), builder.fsub(values, lanes.everywhere(2, feature))

        return lanes.keep(lanes.squares(arguments[4], arguments[5], apart, 6), 6, arguments[7])

    integer = types.int64
    return integer(blocks, integer, query, weights, integer, integer, totals, types.float32), generate


@intrinsic
def bounds_at_most(typing, lows, highs, group, query, weights, start, stop, totals, limit):
    """Which boxes of a group may hold a frame that costs at most `limit`: an int64 mask; as `costs_at_most`.

    lows, highs float32 [G, F, 16].
    """

    def generate(context, builder, signature, arguments):
        lanes = _Lanes(context, builder, signature, arguments)
        base = builder.mul(builder.mul(arguments[2], lanes.size(0, 1)), _I64(LANES))

        def apart(feature: Any) -> tuple[Any, Any]:
            offset = builder.add(base, builder.mul(feature, _I64(LANES)))
            wanted = lanes.everywhere(3, feature)
            nearest = lanes.less(lanes.greater(wanted, lanes.load(0, offset)), lanes.load(1, offset))
            return lanes.everywhere(4, feature), builder.fsub(wanted, nearest)

        return lanes.keep(lanes.squares(arguments[5], arguments[6], apart, 7), 7, arguments[8])

    integer = types.int64
    return integer(lows, highs, integer, query, weights, integer, integer, totals, types.float32), generate


@intrinsic
def lowest(typing, mask):
    """The lowest bit of an int64 mask that is set."""

    def generate(context, builder, signature, arguments):
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), generate


class _Lanes:
    """Instructions on 16 float32 for one call of an intrinsic; arrays are told by the number of the argument."""

    def __init__(self, context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        self.builder = builder
        self.arrays = {
            i: context.make_array(kind)(context, builder, argument)
            for i, (kind, argument) in enumerate(zip(signature.args, arguments, strict=True))
            if isinstance(kind, types.Array)
        }

    def start(self, array: int) -> Any:
        return self.arrays[array].data

    def size(self, array: int, axis: int) -> Any:
        return self.builder.extract_value(self.arrays[array].shape, axis)

    def load(self, array: int, offset: Any) -> Any:
        """The 16 numbers from an offset on; arrays are aligned to 4 bytes only."""
        loaded = self.builder.load(self.builder.bitcast(self.builder.gep(self.start(array), [offset]), _LANES.as_pointer()))
        loaded.align = 4
        return loaded

    def everywhere(self, array: int, at: Any) -> Any:
        """One number in all lanes."""
        return self.spread(self.builder.load(self.builder.gep(self.start(array), [at])))

    def spread(self, number: Any) -> Any:
        nothing = ir.Constant(_LANES, ir.Undefined)
        first = self.builder.insert_element(nothing, number, _I32(0))
        return self.builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(_I32, LANES), [0] * LANES))

    def greater(self, left: Any, right: Any) -> Any:
        return self.builder.select(self.builder.fcmp_ordered(">", left, right), left, right)

    def less(self, left: Any, right: Any) -> Any:
        return self.builder.select(self.builder.fcmp_ordered("<", left, right), left, right)

    def squares(self, start: Any, stop: Any, apart: Callable[[Any], tuple[Any, Any]], array: int) -> Any:
        """An array's lanes and the weight x values² of features start … stop - 1, which `apart` gives, added up.

        Two sums take turns, so that an addition need not wait for the one before it.
        """
        builder = self.builder
        sums = [
            cgutils.alloca_once_value(builder, value) for value in (self.load(array, _I64(0)), ir.Constant(_LANES, [0.0] * LANES))
        ]
        last = builder.sub(stop, _I64(1))
        with cgutils.for_range_slice(builder, start, last, _I64(2), _I64) as (feature, _):
            for i, total in enumerate(sums):
                self.add_square(total, *apart(builder.add(feature, _I64(i))))
        is_odd = builder.trunc(builder.sub(stop, start), ir.IntType(1))
        with builder.if_then(is_odd):
            self.add_square(sums[0], *apart(last))
        return builder.fadd(builder.load(sums[0]), builder.load(sums[1]), flags=_ROUNDING)

    def add_square(self, total: Any, weight: Any, values: Any) -> None:
        """Add weight x values² to what `total` points to."""
        builder = self.builder
        weighted = builder.fmul(weight, values, flags=_ROUNDING)
        square = builder.fmul(weighted, values, flags=_ROUNDING)
        builder.store(builder.fadd(builder.load(total), square, flags=_ROUNDING), total)

    def keep(self, values: Any, array: int, limit: Any) -> Any:
        """Store lanes into an array; gives the mask of those that are at most `limit`."""
        self.builder.store(values, self.builder.bitcast(self.start(array), _LANES.as_pointer())).align = 4
        passes = self.builder.fcmp_unordered("<=", values, self.spread(limit))  # true of NaN: 0 x inf, where float32 ends
        return self.builder.zext(self.builder.bitcast(passes, ir.IntType(LANES)), _I64)
