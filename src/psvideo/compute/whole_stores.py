"""Elements that a compiled loop changes or leaves as they are, stored in whole vectors.

LLVM (20 and later) sees that some of a vector's places keep what they hold, and stores the others under a mask. That is
slow on AMD's processors without AVX-512: on one of them, a loop of two such stores took 3.5 times
as long as with whole ones.
"""

from typing import Any

import llvmlite.ir
from numba.extending import intrinsic

_ir: Any = llvmlite.ir


def _unmasked(typing_context: Any, value: Any) -> Any:
    """An element as it was loaded: for ``old = unmasked(a[i])`` and then ``a[i] = new if chosen else old``, and for the
    least and the most of an element and another number.

    It is frozen, which keeps LLVM from seeing where it comes from. It has to be loaded whatever is chosen: in one
    branch alone it would be a mask again.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        frozen = _ir.instructions.Instruction(builder.block, arguments[0].type, "freeze", [arguments[0]])
        builder._insert(frozen)  # llvmlite's builder has no name for it
        return frozen

    return value(value), generate


unmasked: Any = intrinsic(_unmasked)
