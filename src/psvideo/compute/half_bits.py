"""Half floats by whole numbers, for processors without instructions for them (x86 without F16C: before 2012, emulated).

LLVM calls a library's function there, which compiled loops are not linked with: the process would end without a word.
The steps are F. Giesen's (2012, "float->half variants"), with his names for what is exact: rounding to nearest even
by adding to the bits, and by adding 0.5, whose last place is the smallest half float.
"""

from typing import Any

import llvmlite.binding
import llvmlite.ir

_ir: Any = llvmlite.ir
_binding: Any = llvmlite.binding
_INT, _FLOAT = _ir.IntType(32), _ir.FloatType()


def converts_halves(context: Any) -> bool:
    """Return whether the processor that numba's ``context`` compiles for converts half floats by itself."""
    features = getattr(context.codegen(), "_tm_features", None)
    if not isinstance(features, str) or not _binding.get_process_triple().startswith(("x86", "i386", "i686")):
        return True
    return "+f16c" in features


def half_bits(builder: Any, value: Any) -> Any:
    """The 16 bits of a float32 (no NaN) rounded to a half float; infinity beyond the largest one."""
    bits = builder.bitcast(value, _INT)
    sign = builder.and_(builder.lshr(bits, _INT(16)), _INT(0x8000))
    size = builder.and_(bits, _INT(0x7FFFFFFF))
    odd = builder.and_(builder.lshr(size, _INT(13)), _INT(1))
    rebased = builder.add(size, _INT(0xC8000FFF))  # exponents count from 15 and not from 127, and half a place
    usual = builder.lshr(builder.add(rebased, odd), _INT(13))
    beside_half = builder.fadd(builder.bitcast(size, _FLOAT), _FLOAT(0.5))
    small = builder.sub(builder.bitcast(beside_half, _INT), _INT(0x3F000000))
    found = builder.select(builder.icmp_unsigned("<", size, _INT(0x38800000)), small, usual)  # below 2 ** -14
    found = builder.select(builder.icmp_unsigned("<", size, _INT(0x477FF000)), found, _INT(0x7C00))  # 65520
    return builder.trunc(builder.or_(sign, found), _ir.IntType(16))


def float_of(builder: Any, half: Any) -> Any:
    """The float32 that a half float's 16 bits stand for."""
    wide = builder.zext(half, _INT)
    size = builder.shl(builder.and_(wide, _INT(0x7FFF)), _INT(13))
    scaled = builder.fmul(builder.bitcast(size, _FLOAT), _FLOAT(2.0**112))  # exponents count from 127 again
    bits = builder.bitcast(scaled, _INT)
    endless = builder.icmp_unsigned(">=", size, _INT(0x0F800000))
    bits = builder.select(endless, builder.or_(bits, _INT(0x7F800000)), bits)
    sign = builder.shl(builder.and_(wide, _INT(0x8000)), _INT(16))
    return builder.bitcast(builder.or_(bits, sign), _FLOAT)
