"""How the solver's loops are compiled: inlined into one function, with pointers to plates and half-float results."""

from collections.abc import Callable
from typing import Any, TypeVar

import llvmlite.ir
import numba
from numba import types
from numba.extending import intrinsic, overload
from numba.np.numpy_support import carray

from psvideo.compute.compiled import compiled as keep_compiled

_HALF_MAX = 65504.0
_ir: Any = llvmlite.ir

Function = TypeVar("Function", bound=Callable[..., Any])

# Products may be fused and divisions shared; NaN and infinity keep their meaning, sums their order.
_OPTIONS: dict[str, Any] = {"fastmath": {"contract", "nsz", "arcp"}, "error_model": "numpy"}
_PART = _OPTIONS | {"nogil": True, "forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def compiled(function: Function) -> Function:
    """Compile a function that Python calls, and keep it on disk."""
    return keep_compiled(function, **_OPTIONS)


def inlined(function: Function) -> Function:
    """Compile a function into the compiled functions that call it, and for nobody else."""
    part: Function = numba.njit(**_PART)(function)
    return part


def apart(function: Function) -> Function:
    """Compile a function for the compiled functions that call it, and optimise its long loops by themselves."""
    part: Function = numba.njit(**(_PART | {"forceinline": False}))(function)
    return part


def _pointer(typing_context: Any, address: Any, like: Any) -> Any:
    """The address (an integer) as a pointer to elements of the array ``like``."""
    target: Any = types.CPointer(like.dtype)  # type: ignore[no-untyped-call]

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(target))

    return target(types.intp, like), generate


def _encoded(typing_context: Any, value: Any, like: Any) -> Any:
    """A float32 as the array ``like`` stores it: as it is, or rounded to a half float's 16 bits where it is uint16.

    Values beyond the largest half float become that one. A vector takes one instruction, where numpy takes a pass.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if like.dtype != types.uint16:
            return arguments[0]
        largest = _ir.Constant(_ir.FloatType(), _HALF_MAX)
        fits = builder.fcmp_ordered("<", arguments[0], largest)
        return builder.bitcast(
            builder.fptrunc(builder.select(fits, arguments[0], largest), _ir.HalfType()), _ir.IntType(16)
        )

    return like.dtype(types.float32, like), generate


pointer: Any = intrinsic(_pointer)
encoded: Any = intrinsic(_encoded)


def at(numbers: Any, pixel: int) -> Any:
    """What ``of_light`` or one light's 1 / strength, for all pixels or as planes, is in a pixel. Compiled only."""
    raise NotImplementedError


@overload(at, jit_options={"forceinline": True}, strict=False)
def _at(numbers: Any, pixel: Any) -> Callable[[Any, int], Any]:
    if isinstance(numbers, types.Float) or (
        isinstance(numbers, types.UniTuple) and isinstance(numbers.dtype, types.Float)
    ):
        return lambda numbers, pixel: numbers
    if isinstance(numbers, types.UniTuple):
        return lambda numbers, pixel: (numbers[0][pixel], numbers[1][pixel], numbers[2][pixel])
    return lambda numbers, pixel: numbers[pixel]


@inlined
def of_light(matrix: Any, light: int) -> Any:
    """One light's three numbers: the same for all pixels (matrix (light, 3)), or planes ((light, 3, pixel))."""
    return matrix[light, 0], matrix[light, 1], matrix[light, 2]


@inlined
def lent(array: Any) -> Any:
    """The same (C-contiguous) array without its reference count, which every slice and call would count up and down.

    Threads that do so with one array wait for each other. The caller's own reference keeps the array alive.
    """
    return carray(pointer(array.ctypes.data, array), array.shape)
