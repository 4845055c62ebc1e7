"""Maximal-length sequences (Golomb 1967): every word of ``order`` bits, except all zeros, occurs exactly once."""

TAPS = {
    3: (3, 2),
    4: (4, 3),
    5: (5, 3),
    6: (6, 5),
    7: (7, 6),
    8: (8, 6, 5, 4),
    9: (9, 5),
    10: (10, 7),
}
"""By order: how far back the bits stand whose sum, modulo 2, is the next one (primitive polynomials)."""


def maximal_length(order: int) -> tuple[bool, ...]:
    """Return one period of the sequence of an order in ``TAPS``, ``2 ** order - 1`` bits, the first of them 1.

    >>> "".join(str(int(bit)) for bit in maximal_length(3))
    '1110010'
    """
    bits = [True] * order
    while len(bits) < 2**order - 1:
        bits.append(bool(sum(bits[-back] for back in TAPS[order]) % 2))
    return tuple(bits)
