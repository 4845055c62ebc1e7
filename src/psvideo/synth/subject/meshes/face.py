"""The face of the bust: brows, eyes, nose, mouth and an ear, worked into a head as soft unions and cuts.

Lengths in metres, in the bust's space, folded at the middle: one side is both.
"""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.synth.subject.meshes.fields import (
    ball,
    common,
    difference,
    ellipsoid,
    limb,
    rotated,
    strand,
    union,
)

EYE = np.array([0.0315, 0.0010, 0.0640])
GLOBE_M = 0.0135


def with_face(head: Doubles, m: Doubles) -> Doubles:
    """Brows, eyes, nose and mouth on the head."""
    head = union(head, _brow(m), 0.020)
    socket = ellipsoid(m, (0.0315, 0.0035, 0.0935), (0.0225, 0.0135, 0.0200))
    head = difference(head, socket, 0.016)
    head = union(head, _eye(m), 0.004)
    return _mouth(_nose(head, m), m)


def _brow(m: Doubles) -> Doubles:
    points = [(0.012, 0.0205, 0.0815), (0.028, 0.0255, 0.0790), (0.048, 0.0180, 0.0610)]
    return strand(m, points, [0.0040, 0.0055, 0.0036], 0.01)


def _eye(m: Doubles) -> Doubles:
    """Eyeball with lids that leave an almond open."""
    globe = ball(m, EYE, GLOBE_M)
    lids = ball(m, EYE, GLOBE_M + 0.0029)
    x, y = (m[:, 0] - EYE[0]) / 0.0158, m[:, 1] - EYE[1]
    arch = 1.0 - x**2
    gap = np.maximum(y - 0.0058 * arch, -0.0042 * arch - y)
    eye = union(globe, common(lids, -gap, 0.0010), 0.0)
    crease = strand(
        m, [(0.0180, 0.0065, 0.0780), (0.0315, 0.0128, 0.0790), (0.0460, 0.0065, 0.0690)], [0.001, 0.0016, 0.001]
    )
    return difference(eye, crease, 0.003)


def _nose(head: Doubles, m: Doubles) -> Doubles:
    """Bridge, tip, wings and nostrils."""
    points = [(0, 0.018, 0.0805), (0, 0.001, 0.0860), (0, -0.022, 0.0955), (0, -0.032, 0.1005)]
    head = union(head, strand(m, points, [0.0070, 0.0062, 0.0074, 0.0084], 0.01), 0.016)
    head = union(head, ball(m, (0, -0.0350, 0.1018), 0.0092), 0.008)
    head = union(head, limb(m, (0, -0.0455, 0.084), (0, -0.0410, 0.1005), 0.0045, 0.0045), 0.006)
    wing = ellipsoid(m, (0.0122, -0.0405, 0.0890), (0.0066, 0.0070, 0.0100))
    head = union(head, wing, 0.007)
    nostril = ellipsoid(m, (0.0070, -0.0472, 0.0945), (0.0032, 0.0036, 0.0060))
    return difference(head, nostril, 0.003)


def _mouth(head: Doubles, m: Doubles) -> Doubles:
    """Muzzle, lips, the line between them, philtrum and the fold above the chin."""
    head = union(head, ellipsoid(m, (0, -0.067, 0.066), (0.030, 0.022, 0.0235)), 0.020)
    head = union(head, lips(m), 0.005)
    line = strand(
        m, [(0.0, -0.0703, 0.0940), (0.0090, -0.0696, 0.0918), (0.0260, -0.0722, 0.0780)], [0.0016, 0.0016, 0.0014]
    )
    head = difference(head, line, 0.0045)
    head = difference(head, limb(m, (0, -0.0515, 0.0935), (0, -0.0605, 0.0950), 0.0020, 0.0028), 0.005)
    return difference(head, ellipsoid(m, (0, -0.0885, 0.0930), (0.018, 0.0045, 0.0095)), 0.012)


def lips(m: Doubles) -> Doubles:
    """Upper and lower lip."""
    upper = strand(
        m,
        [(0.0020, -0.0640, 0.0890), (0.0080, -0.0635, 0.0878), (0.0235, -0.0712, 0.0755)],
        [0.0036, 0.0038, 0.0014],
        0.003,
    )
    lower = strand(
        m,
        [(0.0, -0.0768, 0.0870), (0.0095, -0.0762, 0.0850), (0.0225, -0.0722, 0.0755)],
        [0.0048, 0.0042, 0.0014],
        0.003,
    )
    return union(upper, lower)


def ear(m: Doubles) -> Doubles:
    """Shell, rim and lobe."""
    q = rotated(m, (0.064, -0.010, 0.005), 1, 24.0)
    q = rotated(q, (0.064, -0.010, -0.010), 0, -10.0)
    shell = ellipsoid(q, (0.0665, -0.008, -0.012), (0.0070, 0.0290, 0.0170))
    bowl = ellipsoid(q, (0.0745, -0.0085, -0.0075), (0.0075, 0.0170, 0.0095))
    rim = strand(
        q,
        [
            (0.0700, -0.002, 0.006),
            (0.0710, 0.015, 0.001),
            (0.0710, 0.0195, -0.012),
            (0.0715, 0.008, -0.0265),
            (0.0700, -0.013, -0.0235),
            (0.0690, -0.031, -0.009),
        ],
        [0.0022, 0.0030, 0.0034, 0.0034, 0.0032, 0.0052],
        0.003,
    )
    return union(difference(shell, bowl, 0.004), rim, 0.004)
