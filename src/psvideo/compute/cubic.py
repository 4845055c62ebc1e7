"""Cubic interpolation in compiled loops, of samples of which three, or one, lie beside each other in every pixel.

The four weights along either axis, and what four rows make of neighbouring samples, are vectors: one pixel in colour
takes about thirty instructions. Keys, "Cubic convolution interpolation for digital image processing", 1981, with a
slope of -0.75, as OpenCV has it. Why by hand: docs/decisions/cubic-by-vectors.md.
"""

from typing import Any

import llvmlite.ir
import numpy as np
from numba import types
from numba.extending import intrinsic

from psvideo.compute.compiled import FUSED

SLOPE = -0.75
WEIGHTS = (
    (0.0, 1.0, 0.0, 0.0),
    (SLOPE, 0.0, -SLOPE, 0.0),
    (-2 * SLOPE, -(SLOPE + 3), 2 * SLOPE + 3, SLOPE),
    (SLOPE, SLOPE + 2, -(SLOPE + 2), -SLOPE),
)
"""By power of how far a place is beyond the second of four samples: the weight of each."""
_ir: Any = llvmlite.ir
_FLOAT, _INT = _ir.FloatType(), _ir.IntType(32)
_FOUR = _ir.VectorType(_FLOAT, 4)
_FUSE = ("contract",)


def _of(lanes: tuple[float, ...]) -> Any:
    return _ir.Constant(_FOUR, [_ir.Constant(_FLOAT, lane) for lane in lanes])


def _chosen(builder: Any, vector: Any, lanes: tuple[int, ...], other: Any = None) -> Any:
    """A vector of some lanes of another, or of two."""
    places = _ir.Constant(_ir.VectorType(_INT, 4), [_INT(lane) for lane in lanes])
    return builder.shuffle_vector(vector, vector if other is None else other, places)


def _spread(builder: Any, value: Any) -> Any:
    """Four times a value."""
    first = builder.insert_element(_ir.Constant(_FOUR, _ir.Undefined), value, _INT(0))
    return _chosen(builder, first, (0, 0, 0, 0))


def _plus(builder: Any, total: Any, one: Any, other: Any) -> Any:
    return builder.fadd(total, builder.fmul(one, other, flags=_FUSE), flags=_FUSE)


def _weights(builder: Any, beyond: Any) -> Any:
    """The weights of four samples, of a place that lies so far beyond the second."""
    place, found = _spread(builder, beyond), _of(WEIGHTS[3])
    for power in (2, 1, 0):
        found = _plus(builder, _of(WEIGHTS[power]), found, place)
    return found


def _down(builder: Any, arguments: Any, vectors: int) -> list[Any]:
    """What four rows make of 4 times so many neighbouring samples."""
    address, stride, _, down = arguments
    weights = _weights(builder, down)
    total: list[Any] = [None] * vectors
    for row in range(4):
        own = _chosen(builder, weights, (row,) * 4)
        for n in range(vectors):
            place = builder.add(address, _ir.Constant(address.type, 16 * n))
            samples = builder.load(builder.inttoptr(place, _FOUR.as_pointer()), align=4, typ=_FOUR)
            made = total[n]
            total[n] = builder.fmul(own, samples) if made is None else _plus(builder, made, own, samples)
        address = builder.add(address, stride)
    return total


def _pixels(builder: Any, first: Any, second: Any, third: Any) -> tuple[Any, ...]:
    """Four pixels of three samples, each in a vector of its own, whose last lane is of no use: what is then added are
    vectors, where a sum of each channel would take every lane out by itself."""
    return (
        first,
        _chosen(builder, first, (3, 4, 5, 3), second),
        _chosen(builder, second, (2, 3, 4, 2), third),
        _chosen(builder, third, (1, 2, 3, 1)),
    )


def _cubic_of_three(typing_context: Any, address: Any, stride: Any, across: Any, down: Any) -> Any:
    """Three channels between 4 by 4 pixels, whose first lies at ``address``, each row ``stride`` bytes behind the one
    before; how far the place lies beyond the second column and row, 0 to 1."""
    made: Any = types.UniTuple(types.float32, 3)  # type: ignore[no-untyped-call]

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        weights = _weights(builder, arguments[2])
        samples = [
            builder.fmul(_chosen(builder, weights, tuple(place // 3 for place in range(4 * n, 4 * n + 4))), vector)
            for n, vector in enumerate(_down(builder, arguments, 3))
        ]
        one, two, three, four = _pixels(builder, *samples)
        total = builder.fadd(builder.fadd(one, two), builder.fadd(three, four))
        return context.make_tuple(builder, made, [builder.extract_element(total, _INT(lane)) for lane in range(3)])

    return made(types.intp, types.intp, types.float32, types.float32), generate


def _cubic_of_one(typing_context: Any, address: Any, stride: Any, across: Any, down: Any) -> Any:
    """The same of one channel."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (line,) = _down(builder, arguments, 1)
        samples = builder.fmul(_weights(builder, arguments[2]), line)
        one, two, three, four = (builder.extract_element(samples, _INT(pixel)) for pixel in range(4))
        return builder.fadd(builder.fadd(one, two), builder.fadd(three, four))

    return types.float32(types.intp, types.intp, types.float32, types.float32), generate


cubic_of_three: Any = intrinsic(_cubic_of_three)
cubic_of_one: Any = intrinsic(_cubic_of_one)


@FUSED.inlined
def cubic_weights(beyond: Any) -> Any:
    """The weights of four samples, as a tuple."""
    square = beyond * beyond
    cube = square * beyond
    slope = np.float32(SLOPE)
    return (
        slope * (cube - np.float32(2) * square + beyond),
        (slope + np.float32(2)) * cube - (slope + np.float32(3)) * square + np.float32(1),
        (np.float32(2) * slope + np.float32(3)) * square - (slope + np.float32(2)) * cube - slope * beyond,
        slope * (square - cube),
    )
