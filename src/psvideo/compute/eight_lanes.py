"""Vectors of eight numbers in LLVM's code that is written by hand: what ``cubic_eight`` and ``linear_eight`` share.

The ``builder`` puts instructions into a compiled function; values are LLVM's.
"""

from typing import Any

import llvmlite.ir

EIGHT = 8
ir: Any = llvmlite.ir
FLOAT, INT = ir.FloatType(), ir.IntType(32)
FLOATS, INTS = ir.VectorType(FLOAT, EIGHT), ir.VectorType(INT, EIGHT)
FUSE = ("contract",)


def lanes(kind: Any, *own: float) -> Any:
    """Return a vector of constants: of eight, or eight times one."""
    return ir.Constant(kind, [ir.Constant(kind.element, lane) for lane in own * (EIGHT // len(own))])


def spread(builder: Any, value: Any, kind: Any) -> Any:
    """Return eight times a value."""
    first = builder.insert_element(ir.Constant(kind, ir.Undefined), value, INT(0))
    return builder.shuffle_vector(first, first, lanes(INTS, 0))


def pointer_to(builder: Any, address: Any, bytes_on: int = 0) -> Any:
    """Return where eight floats lie, so many bytes behind an address."""
    return builder.inttoptr(builder.add(address, ir.Constant(address.type, bytes_on)), FLOATS.as_pointer())


def loaded(builder: Any, address: Any, bytes_on: int = 0) -> Any:
    """Return eight floats that lie so many bytes behind an address."""
    return builder.load(pointer_to(builder, address, bytes_on), align=4, typ=FLOATS)


def stored(builder: Any, values: Any, address: Any, bytes_on: int = 0) -> None:
    """Put eight floats there."""
    builder.store(values, pointer_to(builder, address, bytes_on), align=4)


def plus(builder: Any, total: Any, one: Any, other: Any) -> Any:
    """Return a total (None: nothing yet) and the product of two vectors added to it."""
    product = builder.fmul(one, other, flags=FUSE)
    return product if total is None else builder.fadd(total, product, flags=FUSE)
