"""Symmetric 3 x 3 matrices in compiled loops: a, b, c in the first row, d, e below them, f last."""

import numpy as np

from psvideo.compute.compiled import FUSED

Number = np.float32
Adjugate = tuple[Number, Number, Number, Number, Number, Number, Number]


@FUSED.inlined
def adjugate(a: Number, b: Number, c: Number, d: Number, e: Number, f: Number) -> Adjugate:
    """The adjugate's xx, xy, xz, yy, yz, zz, and the determinant: the inverse is the one divided by the other."""
    xx, xy, xz = d * f - e * e, c * e - b * f, b * e - c * d
    yy, yz, zz = a * f - c * c, b * c - a * e, a * d - b * b
    return xx, xy, xz, yy, yz, zz, a * xx + b * xy + c * xz
