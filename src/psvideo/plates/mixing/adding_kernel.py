"""The compiled loops that add one frame's row, in its codes, to a row of a plate, or take an ambient level off it.

Each begins or goes on with a row: straight loops over samples, which become vectors.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded
from psvideo.compute.parts import INLINED
from psvideo.model.arrays import Codes16, Floats
from psvideo.plates.mixing.mixture_arrays import MixtureArrays


def some_reach(codes: NDArray[Any], limit: np.float32, most: np.float32) -> bool:
    """Whether any code, ``most`` at most, is ``limit`` or more. Compiled only."""
    raise NotImplementedError


@overload(some_reach, jit_options=INLINED, strict=False)
def _some_reach_of(codes: Any, limit: Any, most: Any) -> Callable[[Any, np.float32, np.float32], bool]:
    def of_integers(codes: Any, limit: np.float32, most: np.float32) -> bool:
        largest = codes[0]
        for sample in range(codes.shape[0]):  # compared as they are, many in one vector
            largest = codes[sample] if codes[sample] > largest else largest
        return bool(min(np.float32(largest), most) >= limit)

    def of_floats(codes: Any, limit: np.float32, most: np.float32) -> bool:
        count = np.int32(0)
        for sample in range(codes.shape[0]):
            count += np.int32(min(codes[sample], most) >= limit)
        return bool(count > 0)

    return of_integers if isinstance(codes.dtype, types.Integer) else of_floats


@FUSED.inlined
def add_pattern(
    mix: MixtureArrays, frame: int, place: int, codes: NDArray[Any], factor: np.float32, out: Floats, begun: bool
) -> bool:
    """Add a frame's row times its coefficient, where levels differ by column; return whether any sample is clipped."""
    cols = mix.zero.shape[2]
    clipped = np.int32(0)
    for col in range(cols):
        zero, gain = mix.zero[frame, place, col], mix.gain[frame, place, col]
        limit, scale = mix.clips_from / gain + zero, factor * gain
        for sample in range(col, mix.samples, cols):
            value = signal(mix, codes[sample])
            clipped += np.int32(value >= limit)
            light = (value - zero) * scale
            out[sample] = out[sample] + light if begun else light
    return bool(clipped > 0)


@FUSED.inlined
def signal(mix: MixtureArrays, code: Any) -> np.float32:
    """A code's signal, before the black level is taken off: from the table, or the code itself where it is linear."""
    value: np.float32 = mix.table[np.uintp(code)] if mix.table.size else min(np.float32(code), mix.most)
    return value


@FUSED.inlined
def add_by_table(
    codes: NDArray[Any], table: Floats, zero: np.float32, scale: np.float32, limit: np.float32, out: Floats, begun: bool
) -> bool:
    """Add a frame's row through a table, with one black level; return whether any sample is clipped."""
    clipped = np.int32(0)
    if begun:
        for sample in range(out.shape[0]):
            value = table[np.uintp(codes[sample])]
            clipped += np.int32(value >= limit)
            out[sample] += (value - zero) * scale
    else:
        for sample in range(out.shape[0]):
            value = table[np.uintp(codes[sample])]
            clipped += np.int32(value >= limit)
            out[sample] = (value - zero) * scale
    return bool(clipped > 0)


@FUSED.inlined
def add_halves(
    codes: NDArray[Any], zero: np.float32, scale: np.float32, limit: np.float32, out: Floats, begun: bool
) -> bool:
    """The same of half floats, which the processor decodes: their table would fill a core's nearest caches."""
    clipped = np.int32(0)
    if begun:
        for sample in range(out.shape[0]):
            value = decoded(np.uint16(codes[sample]))
            clipped = np.int32(clipped | (value >= limit))
            out[sample] += (value - zero) * scale
    else:
        for sample in range(out.shape[0]):
            value = decoded(np.uint16(codes[sample]))
            clipped = np.int32(clipped | (value >= limit))
            out[sample] = (value - zero) * scale
    return bool(clipped > 0)


@FUSED.inlined
def begin_linear(codes: NDArray[Any], zero: np.float32, scale: np.float32, most: np.float32, out: Floats) -> None:
    """Begin a row with linear codes of one black level, ``most`` at most: straight loops, which become vectors."""
    for sample in range(out.shape[0]):
        out[sample] = (min(np.float32(codes[sample]), most) - zero) * scale


@FUSED.inlined
def begin_with_level(
    codes: NDArray[Any], zero: np.float32, scale: np.float32, most: np.float32, level: Codes16, share: np.float32,
    least: np.float32, out: Floats,
) -> None:  # fmt: skip
    """The same, and take an ambient level off: its codes times ``share``, and ``least``."""
    for sample in range(out.shape[0]):
        light = (min(np.float32(codes[sample]), most) - zero) * scale - least
        out[sample] = light - share * np.float32(level[sample])


@FUSED.inlined
def add_linear(codes: NDArray[Any], zero: np.float32, scale: np.float32, most: np.float32, out: Floats) -> None:
    """Add linear codes of one black level, ``most`` at most, to a row that is begun."""
    for sample in range(out.shape[0]):
        out[sample] += (min(np.float32(codes[sample]), most) - zero) * scale


@FUSED.inlined
def take_off(level: Codes16, share: np.float32, least: np.float32, out: Floats) -> None:
    """Take an ambient level off a row: its codes times ``share``, and ``least``."""
    for sample in range(out.shape[0]):
        out[sample] = out[sample] - least - share * np.float32(level[sample])
