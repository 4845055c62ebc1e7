"""Linear interpolation of 8-bit codes in compiled loops at eight places at once, as vectors of LLVM's.

Both neighbours in a row come in one load. Why by hand: docs/decisions/cubic-by-vectors.md.
"""

from typing import Any

from numba import types
from numba.extending import intrinsic

from psvideo.compute.eight_lanes import EIGHT, FLOATS, INT, INTS, ir, lanes, loaded, plus, spread, stored

LEAST_COLS = 4
"""How many columns a picture has at least."""


def _least(builder: Any, one: Any, other: Any) -> Any:
    return builder.select(builder.icmp_signed("<", one, other), one, other)


def _split(builder: Any, address: Any, count: Any) -> tuple[Any, Any, Any]:
    """The whole numbers below eight places, kept from 0 to ``count`` - 1, how far these lie beyond, and the last."""
    last = builder.sub(spread(builder, count, INTS), lanes(INTS, 1))
    places, zero, most = loaded(builder, address), lanes(FLOATS, 0.0), builder.sitofp(last, FLOATS)
    places = builder.select(builder.fcmp_ordered(">", places, zero), places, zero)
    places = builder.select(builder.fcmp_ordered("<", places, most), places, most)
    wholes = builder.fptosi(places, INTS)
    return wholes, builder.fsub(places, builder.sitofp(wholes, FLOATS)), last


def _words(builder: Any, address: Any, places: Any) -> Any:
    """Four bytes from each of eight places on."""
    words: Any = ir.Constant(INTS, ir.Undefined)
    for lane in range(EIGHT):
        own = builder.add(address, builder.zext(builder.extract_element(places, INT(lane)), address.type))
        word = builder.load(builder.inttoptr(own, INT.as_pointer()), align=1, typ=INT)
        words = builder.insert_element(words, word, INT(lane))
    return words


def _between(builder: Any, one: Any, other: Any, share: Any) -> Any:
    return plus(builder, plus(builder, None, one, builder.fsub(lanes(FLOATS, 1.0), share)), other, share)


def _linear_of_eight(typing_context: Any, picture: Any, shape: Any, across: Any, down: Any, into: Any) -> Any:
    """Put the codes between those of a picture (its address, and how many rows and columns it has) at eight places into
    the address ``into``; the places' columns lie at ``across`` and their rows at ``down``. Beyond the border they are
    the border's. In memory lower bytes come first."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        picture, shape, across, down, into = arguments
        count_rows, count_cols = (builder.trunc(builder.extract_value(shape, n), INT) for n in range(2))
        row, below, last_row = _split(builder, down, count_rows)
        col, beyond, last_col = _split(builder, across, count_cols)
        begin = _least(builder, col, builder.sub(last_col, lanes(INTS, LEAST_COLS - 1)))
        bits = builder.shl(builder.sub(col, begin), lanes(INTS, 3))
        stride, lines = spread(builder, count_cols, INTS), []
        for own in (row, _least(builder, builder.add(row, lanes(INTS, 1)), last_row)):
            words = builder.lshr(_words(builder, picture, builder.add(builder.mul(own, stride), begin)), bits)
            two = (builder.and_(builder.lshr(words, lanes(INTS, 8 * n)), lanes(INTS, 255)) for n in range(2))
            one, other = (builder.sitofp(code, FLOATS) for code in two)
            lines.append(_between(builder, one, other, beyond))
        codes = _between(builder, lines[0], lines[1], below)
        stored(builder, codes, into)
        return context.get_dummy_value()

    size: Any = types.UniTuple(types.intp, 2)  # type: ignore[no-untyped-call]
    return types.none(types.intp, size, types.intp, types.intp, types.intp), generate


linear_of_eight: Any = intrinsic(_linear_of_eight)
