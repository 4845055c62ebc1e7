"""Compiled part of the robust solver: a normal's standard error, from residuals and how the usable lights stand."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.symmetric import adjugate
from psvideo.compute.whole_stores import unmasked
from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import COUNT, ONE, THREE, XX, XY, XZ, YY, YZ, ZERO, ZZ, X, Y, Z
from psvideo.solve.normals.robust.equations import DOUBT, LOWER, SCALE, SENT
from psvideo.solve.normals.robust.few_lights import EIGHT, FOUR
from psvideo.solve.normals.robust.odd_of_four import TWO
from psvideo.solve.normals.robust.weighing import Weights

SMALL_SAMPLE = np.float32(1.9)  # the median of few residuals of a fit that follows them falls short by so much
SUSPICION = np.float32(0.05)  # what a highlight among four that was left out still says against the other three
UNCHECKED = np.float32(2.5)  # three measurements are explained exactly, and nothing shows a highlight among them
DEGREES = np.float32(180 / np.pi)
NO_ERROR = np.float32(180)  # what is predicted where there is no solution
UNEXPLAINED = LOWER  # a plane of v that is free by then


@FUSED.called
def predict_error(weights: Weights, checked: int, w: Floats, v: Floats, n: int) -> None:
    """The normal's standard error in degrees into DOUBT, and g = 0 where it is too large to be trusted.

    The residuals' scale through the weighted equations: sigma sqrt(trace(P A^-1 P)) / |g|, with P across the normal.
    Beyond eight lights the error does not shrink further, because what is not matte does not average out. Where fewer
    than ``checked`` measurements are usable, residuals say little: they are taken for what is common in the picture.
    """
    for i in range(n):
        a, b, c, d, e, f = w[XX + i], w[XY + i], w[XZ + i], w[YY + i], w[YZ + i], w[ZZ + i]
        xx, xy, xz, yy, yz, zz, determinant = adjugate(a, b, c, d, e, f)
        x, y, z, count = w[X + i], w[Y + i], w[Z + i], w[COUNT + i]
        square = x * x + y * y + z * z
        along = x * x * xx + y * y * yy + z * z * zz + TWO * (x * y * xy + x * z * xz + y * z * yz)
        solved = (square > ZERO) & (determinant > ZERO) & (count >= THREE)
        across = (xx + yy + zz - along / square) / determinant if solved else ZERO
        light = np.sqrt(square) * v[SENT + i]
        few = count < np.float32(checked)
        scale = max(v[SCALE + i], weights.common * light if few else ZERO)
        sigma = max(scale, SUSPICION * v[DOUBT + i]) * (UNCHECKED if count < FOUR else SMALL_SAMPLE)
        spread = max(across * max(count / EIGHT, ONE) / square, ZERO) if solved else ZERO
        error = DEGREES * sigma * np.sqrt(spread) if solved else NO_ERROR
        trusted = error <= weights.most_error_deg
        judged = solved & (not few) & (count > THREE)
        v[UNEXPLAINED + i] = scale / light if judged else ZERO
        v[DOUBT + i] = min(error, NO_ERROR)
        w[X + i] = unmasked(x) if trusted else ZERO
        w[Y + i] = unmasked(y) if trusted else ZERO
        w[Z + i] = unmasked(z) if trusted else ZERO
