"""Memory as compiled loops see it: arrays elsewhere, half floats as they are stored, arrays lent, rows of files."""

from typing import Any

import llvmlite.ir
from numba import types
from numba.extending import intrinsic
from numba.np.numpy_support import carray

from psvideo.compute.compiled import FUSED
from psvideo.compute.half_bits import converts_halves, float_of, half_bits

HALF_MAX = 65504.0
"""The largest half float."""
_ir: Any = llvmlite.ir


def _pointer(typing_context: Any, address: Any, like: Any) -> Any:
    """The address (an integer) as a pointer to elements of the array ``like``."""
    target: Any = types.CPointer(like.dtype)  # type: ignore[no-untyped-call]

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(target))

    return target(types.intp, like), generate


def _encoded(typing_context: Any, value: Any, like: Any) -> Any:
    """A float32 as the array ``like`` stores it: as it is, or rounded to a half float's 16 bits where it is uint16.

    Values beyond the largest half float become that one. A vector takes one instruction, where numpy takes a pass, and
    a dozen on processors without it.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if like.dtype != types.uint16:
            return arguments[0]
        largest = _ir.Constant(_ir.FloatType(), HALF_MAX)
        fits = builder.fcmp_ordered("<", arguments[0], largest)
        float_ = builder.select(fits, arguments[0], largest)
        if converts_halves(context):
            return builder.bitcast(builder.fptrunc(float_, _ir.HalfType()), _ir.IntType(16))
        return half_bits(builder, float_)

    return like.dtype(types.float32, like), generate


def _decoded(typing_context: Any, value: Any) -> Any:
    """A stored number as a float32: as it is, or from a half float's 16 bits where it is uint16."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if value != types.uint16:
            return arguments[0]
        if converts_halves(context):
            return builder.fpext(builder.bitcast(arguments[0], _ir.HalfType()), _ir.FloatType())
        return float_of(builder, arguments[0])

    return types.float32(value), generate


def _read_at(typing_context: Any, function: Any, opened: Any, into: Any, count: Any, begin: Any) -> Any:
    """Call the C library's ``pread``, which lies at the address ``function``, on an ``opened`` file: read up to
    ``count`` bytes from the byte ``begin`` on to the address ``into``, and return how many came; 0 or less: none."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word, address = context.get_value_type(types.intp), _ir.IntType(8).as_pointer()
        kind = _ir.FunctionType(word, [_ir.IntType(32), address, word, word])
        called, file, place, size, first = arguments
        file, place = builder.trunc(file, _ir.IntType(32)), builder.inttoptr(place, address)
        return builder.call(builder.inttoptr(called, kind.as_pointer()), [file, place, size, first])

    return types.intp(*[types.intp] * 5), generate


pointer: Any = intrinsic(_pointer)
encoded: Any = intrinsic(_encoded)
decoded: Any = intrinsic(_decoded)
read_at: Any = intrinsic(_read_at)


@FUSED.inlined
def lent(array: Any) -> Any:
    """The same (C-contiguous) array without its reference count, which every slice and call would count up and down.

    Threads that do so with one array wait for each other. The caller's own reference keeps the array alive.
    """
    return carray(pointer(array.ctypes.data, array), array.shape)


@FUSED.inlined
def flattened(array: Any) -> Any:
    """The same (C-contiguous) array as one line without its reference count.

    Where its planes lie a fixed number of elements apart, the compiler sees that they do not overlap.
    """
    return carray(pointer(array.ctypes.data, array), array.size)
