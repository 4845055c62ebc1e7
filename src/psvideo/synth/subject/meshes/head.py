"""A sculpted bust: head, hair, neck, shoulders and a turned base, drawn as soft unions and cuts; its face is ``face``.

Proportions follow the classical canon: the eyes at half the head's height, the face in thirds from hairline to brow,
nose and chin. Lengths in metres; the chin is near y = -0.115, the crown near 0.12, the face looks along +z.
"""

from collections.abc import Callable

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.synth.subject.material import layered_noise
from psvideo.synth.subject.meshes.face import EYE, GLOBE_M, ear, lips, with_face
from psvideo.synth.subject.meshes.fields import (
    ball,
    common,
    ellipsoid,
    limb,
    mirrored,
    strand,
    union,
)
from psvideo.synth.subject.meshes.surface_nets import extract_surface
from psvideo.synth.subject.shape import Shape, make_shape

CELL_M = 0.0019

Detail = Callable[[Doubles, Doubles], Doubles]


def bust() -> Shape:
    """A head with neck and shoulders on a round base, about 0.53 m high."""
    vertices, faces = extract_surface(bust_field, np.array([-0.2, -0.43, -0.16]), np.array([0.2, 0.15, 0.14]), CELL_M)
    return make_shape(vertices, faces, _paint(mirrored(vertices)))


def _paint(m: Doubles) -> Doubles:
    """Return the albedo at points of the surface: skin with a little life in it, hair, lips, irises, a dark base."""
    albedo = np.array([0.74, 0.62, 0.52]) * (1.0 + 0.10 * layered_noise(m / 0.03)[:, None])
    cheek = np.exp(-(((m - [0.040, -0.040, 0.065]) / 0.020) ** 2).sum(axis=1))[:, None]
    albedo *= 1.0 - cheek * [0.0, 0.22, 0.24]
    albedo[lips(m) < 0.0014] = (0.56, 0.27, 0.24)
    along = np.clip(1.0 - ((m[:, 0] - 0.0315) / 0.0215) ** 2, 0.0, None)
    brow = (np.abs(m[:, 1] - 0.0205 - 0.0060 * along) < 0.0024 * along**0.6) & (m[:, 2] > 0.04)
    albedo[brow | (_hair(m) < 0.0012)] = (0.22, 0.13, 0.07)
    strands = 1.0 + 0.45 * layered_noise(m / np.array([0.004, 0.012, 0.030]))[:, None]
    albedo = np.where(_hair(m)[:, None] < 0.0012, albedo * strands, albedo)
    looking = np.hypot(m[:, 0] - EYE[0], m[:, 1] - EYE[1] - 0.0008)
    white = (np.linalg.norm(m - EYE, axis=1) < GLOBE_M + 0.0008) & (m[:, 2] > EYE[2])
    albedo[white] = (0.80, 0.77, 0.72)
    albedo[white & (looking < 0.0058)] = (0.12, 0.17, 0.16)
    albedo[white & (looking < 0.0026)] = (0.03, 0.03, 0.03)
    stone = (m[:, 1] < -0.352) | (_base(m) < 0.0006)
    albedo[stone] = np.array([0.13, 0.14, 0.16]) * (1.0 + 0.6 * layered_noise(m[stone] / 0.012)[:, None])
    return np.clip(albedo, 0.01, 0.9)


def bust_field(p: Doubles) -> Doubles:
    """Return the signed distance to the bust."""
    m = mirrored(p)
    body = _neck(p, m)
    body = _within(body, m, (0.25, -0.45, -0.20), (0.0, -0.09, 0.20), lambda b, q: union(_shoulders(q), b, 0.035))
    body = _within(body, m, (0.25, -0.45, -0.20), (0.0, -0.30, 0.20), lambda b, q: union(b, _base(q), 0.008))
    body = _within(body, m, (0.12, -0.17, -0.20), (0.0, 0.20, 0.20), lambda b, q: union(b, _skull(q), 0.016))
    body = _within(body, m, (0.09, -0.13, 0.02), (0.0, 0.06, 0.20), with_face)
    body = _within(body, m, (0.12, -0.09, -0.20), (0.0, 0.20, 0.20), lambda b, q: union(b, _hair(q), 0.004))
    return _within(body, m, (0.12, -0.06, -0.06), (0.04, 0.05, 0.05), lambda b, q: union(b, ear(q), 0.006))


def _within(
    body: Doubles, m: Doubles, far: tuple[float, float, float], near: tuple[float, float, float], detail: Detail
) -> Doubles:
    """Return the body with a detail worked in where folded points lie in a box; elsewhere it is not even computed."""
    low, high = np.minimum(far, near), np.maximum(far, near)
    inside = ((m >= low) & (m <= high)).all(axis=1)
    worked = body.copy()
    worked[inside] = detail(body[inside], m[inside])
    return worked


def _skull(m: Doubles) -> Doubles:
    """Cranium, cheeks, jaw and chin."""
    cranium = ellipsoid(m, (0, 0.032, -0.014), (0.0715, 0.083, 0.092))
    forehead = ellipsoid(m, (0, 0.040, 0.022), (0.060, 0.058, 0.063))
    midface = ellipsoid(m, (0, -0.028, 0.026), (0.056, 0.076, 0.058))
    head = union(union(cranium, forehead, 0.03), midface, 0.03)
    cheekbone = ellipsoid(m, (0.042, -0.019, 0.050), (0.021, 0.013, 0.022))
    head = union(head, cheekbone, 0.026)
    cheek = ellipsoid(m, (0.029, -0.053, 0.050), (0.026, 0.034, 0.028))
    head = union(head, cheek, 0.030)
    jaw = strand(
        m, [(0.052, -0.048, -0.004), (0.046, -0.077, 0.014), (0.013, -0.104, 0.062)], [0.012, 0.011, 0.012], 0.01
    )
    head = union(head, jaw, 0.034)
    underside = ellipsoid(m, (0, -0.086, 0.026), (0.042, 0.022, 0.044))
    head = union(head, underside, 0.024)
    chin = ellipsoid(m, (0, -0.103, 0.069), (0.017, 0.013, 0.014))
    return union(head, chin, 0.020)


def _hair(m: Doubles) -> Doubles:
    """A cap of waved locks, combed back from a hairline."""
    cap = ellipsoid(m, (0, 0.034, -0.021), (0.0785, 0.0895, 0.0955))
    nape = ellipsoid(m, (0, -0.022, -0.058), (0.056, 0.045, 0.048))
    front = union(cap, ellipsoid(m, (0, 0.058, 0.018), (0.062, 0.049, 0.061)), 0.03)
    angle = np.arctan2(m[:, 0], m[:, 1] - 0.02)
    run = m[:, 2] + 0.35 * m[:, 1]
    waves = 0.0022 * np.sin(20.0 * angle + 2.0 * np.sin(95.0 * run)) + 0.0008 * np.sin(46.0 * angle + 60.0 * run)
    line = np.interp(
        m[:, 2], [-0.12, -0.05, -0.038, -0.028, 0.0, 0.030, 0.075], [-0.062, -0.055, -0.03, 0.022, 0.022, 0.036, 0.066]
    )
    line = line + 0.003 * np.sin(150.0 * m[:, 0] + 60.0 * m[:, 2]) - 0.20 * m[:, 0] * (m[:, 2] > 0.03)
    return common(union(front, nape, 0.03) + waves, line - m[:, 1], 0.010)


def _neck(p: Doubles, m: Doubles) -> Doubles:
    """Column, the muscles from ear to breastbone, and the throat."""
    column = limb(p, (0, -0.055, -0.020), (0, -0.190, -0.032), 0.050, 0.056)
    muscle = strand(
        m, [(0.054, -0.055, -0.026), (0.037, -0.125, 0.002), (0.011, -0.192, 0.030)], [0.010, 0.010, 0.008], 0.01
    )
    throat = ball(p, (0, -0.135, 0.025), 0.005)
    return union(union(column, muscle, 0.022), throat, 0.020)


def _shoulders(m: Doubles) -> Doubles:
    """Chest and shoulders, cut off like an antique bust."""
    chest = ellipsoid(m, (0, -0.275, -0.030), (0.150, 0.110, 0.080))
    shoulder = ellipsoid(m, (0.135, -0.235, -0.040), (0.058, 0.060, 0.055))
    slope = limb(m, (0.040, -0.155, -0.045), (0.135, -0.210, -0.042), 0.032, 0.032)
    body = union(union(chest, shoulder, 0.03), slope, 0.040)
    breast = ellipsoid(m, (0.060, -0.262, 0.022), (0.062, 0.045, 0.030))
    body = union(body, breast, 0.030)
    collar = strand(
        m, [(0.012, -0.199, 0.032), (0.070, -0.196, 0.020), (0.130, -0.196, -0.018)], [0.0055, 0.0050, 0.0070], 0.01
    )
    body = union(body, collar, 0.020)
    rounded = ellipsoid(m, (0, -0.195, -0.020), (0.185, 0.150, 0.150))
    body = common(body, rounded, 0.012)
    return common(body, m[:, 0] - 0.172, 0.014)


def _base(m: Doubles) -> Doubles:
    """A turned foot: a waisted column on a round plinth."""
    radius = np.hypot(m[:, 0], m[:, 2] + 0.024)
    y = m[:, 1]
    waist = 0.032 + 0.020 * ((y + 0.365) / 0.03) ** 2
    column = np.maximum(radius - np.minimum(waist, 0.070), np.abs(y + 0.355) - 0.040)
    plinth = np.maximum(radius - 0.074, np.abs(y + 0.402) - 0.010) - 0.002
    return union(column, plinth, 0.003)
