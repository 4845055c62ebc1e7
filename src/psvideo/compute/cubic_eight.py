"""Cubic interpolation in compiled loops at eight places beside each other at once.

Where places beside each other lie between samples that are beside each other, too, all eight take a line of memory of
each row and column of four by four: no sample is picked by itself. Where the eight come one column or row nearer to
each other or farther apart, five are taken, of which each place counts its four. Weights are those of ``cubic``.
"""

from typing import Any

from numba import types
from numba.extending import intrinsic

from psvideo.compute.cubic import WEIGHTS
from psvideo.compute.eight_lanes import EIGHT, FLOATS, INT, INTS, ir, lanes, loaded, plus, spread, stored

_BITS = ir.IntType(EIGHT)


def _wholes(builder: Any, places: Any, counting: bool) -> Any:
    """The whole numbers below eight places; where they are ``counting`` up, without what they are to be beyond the
    first."""
    wholes = builder.fptosi(places, INTS)
    return builder.sub(wholes, lanes(INTS, *range(EIGHT))) if counting else wholes


def _any(builder: Any, flags: Any) -> Any:
    return builder.icmp_unsigned("!=", builder.bitcast(flags, _BITS), _BITS(0))


def _begin_of_eight(typing_context: Any, across: Any, down: Any) -> Any:
    """Of eight places, of which the columns lie at the address ``across`` and the rows at ``down``: the column and the
    row in which they begin; and of each whether some are one farther (1), all follow on (0), or neither (2)."""
    made: Any = types.UniTuple(types.int32, 4)  # type: ignore[no-untyped-call]

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        firsts, beyond = [], []
        for address, counting in zip(arguments, (True, False), strict=True):
            wholes = _wholes(builder, loaded(builder, address), counting)
            first = builder.extract_element(wholes, INT(0))
            apart = builder.sub(wholes, spread(builder, first, INTS))
            before, after = (_any(builder, builder.icmp_signed(how, apart, lanes(INTS, 0))) for how in "<>")
            far = _any(builder, builder.icmp_unsigned(">", builder.add(apart, lanes(INTS, 1)), lanes(INTS, 2)))
            far = builder.or_(far, builder.and_(before, after))
            firsts.append(builder.sub(first, builder.zext(before, INT)))
            beyond.append(builder.select(far, INT(2), builder.zext(builder.or_(before, after), INT)))
        return context.make_tuple(builder, made, [*firsts, *beyond])

    return made(types.intp, types.intp), generate


def _weights(builder: Any, places: Any, first: Any, counting: bool, count: int) -> list[Any]:
    """The weights of eight places, by sample: of ``count`` from that before the ``first`` on, four or five."""
    within, weights = builder.fsub(places, builder.sitofp(builder.fptosi(places, INTS), FLOATS)), []
    for sample in range(4):
        found = lanes(FLOATS, WEIGHTS[3][sample])
        for power in (2, 1, 0):
            found = plus(builder, lanes(FLOATS, WEIGHTS[power][sample]), found, within)
        weights.append(found)
    if count == 4:
        return weights
    none, begin = lanes(FLOATS, 0.0), spread(builder, first, INTS)
    later = builder.icmp_signed("!=", _wholes(builder, places, counting), begin)
    return [builder.select(later, *two) for two in zip([none, *weights], [*weights, none], strict=True)]


def _sum_of(builder: Any, begin: Any, stride: Any, over: list[Any], beside: list[Any], pixel: int) -> Any:
    """The weighted sum of samples, of lines a ``pixel`` apart in rows ``stride`` apart, all in bytes."""
    total: Any = None
    for own in over:
        line: Any = None
        for place, weight in enumerate(beside):
            line = plus(builder, line, weight, loaded(builder, begin, pixel * place))
        total = plus(builder, total, own, line)
        begin = builder.add(begin, stride)
    return total


def _adding(channels: int, count: int) -> Any:
    def adding(typing_context: Any, picture: Any, begin: Any, places: Any, onto: Any, into: Any, share: Any) -> Any:
        """Put into the address ``into`` what lies at ``onto`` and a picture's light at eight places, each sample of
        which counts ``share[0]``, after it was cut off at ``share[1]``. ``picture`` is its address and the bytes of a
        row, ``begin`` the column and row in which the places begin, ``places`` the addresses of their columns and rows.
        """

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            pair = [builder.extract_value(one, n) for one in arguments[:3] for n in range(2)]
            address, stride, col, row, across, down = pair
            onto, into, share = arguments[3:]
            over = _weights(builder, loaded(builder, down), row, False, count)
            beside = _weights(builder, loaded(builder, across), col, True, count)
            counts, most = (spread(builder, builder.extract_value(share, n), FLOATS) for n in range(2))
            before = builder.add(
                builder.mul(builder.sext(builder.sub(row, INT(1)), stride.type), stride),
                builder.mul(builder.sext(builder.sub(col, INT(1)), stride.type), stride.type(4 * channels)),
            )
            first = builder.add(address, before)
            for n in range(channels):
                pixels = lanes(INTS, *((EIGHT * n + lane) // channels for lane in range(EIGHT)))
                own = [[builder.shuffle_vector(one, one, pixels) for one in weights] for weights in (over, beside)]
                line = builder.add(first, ir.Constant(first.type, 4 * EIGHT * n))
                light = _sum_of(builder, line, stride, own[0], own[1], 4 * channels)
                light = builder.select(builder.fcmp_ordered("<", light, most), light, most)
                made = plus(builder, loaded(builder, onto, 4 * EIGHT * n), counts, light)
                stored(builder, made, into, 4 * EIGHT * n)
            return context.get_dummy_value()

        two: Any = types.UniTuple
        addresses, starts, shares = two(types.intp, 2), two(types.int32, 2), two(types.float32, 2)
        return types.none(addresses, starts, addresses, types.intp, types.intp, shares), generate

    return intrinsic(adding)


begin_of_eight: Any = intrinsic(_begin_of_eight)
add_three: Any = _adding(3, 4)
add_three_of_five: Any = _adding(3, 5)
add_one: Any = _adding(1, 4)
add_one_of_five: Any = _adding(1, 5)
