"""What stands on the table of the still life: vase, apple, pear, book, and a cloth that hangs in folds."""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.synth.subject.material import layered_noise
from psvideo.synth.subject.meshes.basic import Paint, box, grid_faces, lathe, painted, tube
from psvideo.synth.subject.shape import Shape, make_shape, merged


def _smooth_outline(points: list[tuple[float, float]], count: int) -> list[tuple[float, float]]:
    """Return a smooth curve through (radius, y) points (Catmull and Rom 1974)."""
    knots = np.array([points[0], *points, points[-1]])
    place = np.linspace(0, len(points) - 1, count)
    first = np.minimum(place.astype(int), len(points) - 2)
    t = (place - first)[:, None]
    a, b, c, d = (knots[first + shift] for shift in range(4))
    curve = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    return [(float(radius), float(y)) for radius, y in curve]


def vase() -> Shape:
    """A glazed vase with painted bands, 0.30 m high, open at the top."""
    outer = [
        (0.037, 0.300),
        (0.029, 0.270),
        (0.034, 0.245),
        (0.066, 0.205),
        (0.083, 0.155),
        (0.074, 0.095),
        (0.047, 0.035),
        (0.043, 0.0),
    ]
    rim = [(0.030, 0.300), (0.0335, 0.304), (0.037, 0.300)]
    inner = [(0.0, 0.10), (0.055, 0.12), (0.060, 0.19), (0.027, 0.245), (0.023, 0.270), (0.030, 0.300)]
    outline = [*_smooth_outline(inner, 60), *_smooth_outline(rim, 9)[1:], *_smooth_outline(outer, 140)[1:]]
    shape = lathe(outline, columns=192)
    return make_shape(shape.vertices, shape.faces, _vase_paint(shape.vertices))


def _vase_paint(v: Doubles) -> Doubles:
    """White glaze with blue rings and a frieze of diamonds round the belly."""
    albedo = np.tile([0.72, 0.73, 0.70], (len(v), 1)) * (1 + 0.05 * layered_noise(v / 0.02)[:, None])
    y, around = v[:, 1], np.arctan2(v[:, 0], v[:, 2]) * 16 / (2 * np.pi)
    blue = np.zeros(len(v), bool)
    for middle, half in (
        (0.292, 0.004),
        (0.262, 0.002),
        (0.232, 0.004),
        (0.190, 0.0025),
        (0.118, 0.0025),
        (0.055, 0.005),
        (0.008, 0.006),
    ):
        blue |= np.abs(y - middle) < half
    diamond = np.abs((around % 1.0) - 0.5) * 0.060 + np.abs(y - 0.154)
    blue |= (diamond < 0.026) & (diamond > 0.018) | (diamond < 0.009)
    albedo[blue] = (0.06, 0.11, 0.34)
    return albedo


def apple() -> Shape:
    """An apple with its stem, about 0.075 m across, red on one side."""
    rows, columns = 121, 180
    down, around = np.meshgrid(np.linspace(0, np.pi, rows), 2 * np.pi * np.arange(columns) / columns, indexing="ij")
    lobes = 1 + 0.022 * np.cos(5 * around) * np.sin(down / 2) ** 2
    radius = 0.040 * lobes * (1 - 0.10 * np.cos(down)) / 1.02
    dimple = 0.021 * np.exp(-((down / 0.30) ** 2)) + 0.011 * np.exp(-(((np.pi - down) / 0.28) ** 2))
    height = 0.036 * np.cos(down) - dimple * np.sign(np.cos(down))
    side = radius * np.sin(down) ** 0.88
    v = np.stack([side * np.sin(around), height, side * np.cos(around)], axis=-1).reshape(-1, 3)
    streaks = layered_noise(np.column_stack([np.cos(around).ravel() * 9, np.sin(around).ravel() * 9, down.ravel()]))
    red = np.clip(
        0.62 + 0.5 * np.sin(around.ravel() + 0.9) + 0.35 * streaks - 0.45 * np.exp(-((down.ravel() / 0.5) ** 2)), 0, 1
    )
    albedo = red[:, None] * [0.52, 0.05, 0.04] + (1 - red[:, None]) * [0.52, 0.50, 0.10]
    flesh = make_shape(v, grid_faces(rows, columns, wrap=True)[:, ::-1], albedo)
    stem = tube([(0, 0.012, 0), (0.001, 0.026, 0), (0.004, 0.038, 0.002)], 0.0014)
    return merged(flesh, painted(stem, (0.16, 0.09, 0.04)))


def pear() -> Shape:
    """A pear with its stem, about 0.105 m high."""
    outline = [
        (0.0, 0.094),
        (0.012, 0.092),
        (0.018, 0.080),
        (0.023, 0.062),
        (0.036, 0.035),
        (0.037, 0.017),
        (0.022, 0.002),
        (0.0, 0.004),
    ]
    shape = lathe(_smooth_outline(outline, 110), columns=150)
    v = shape.vertices.copy()
    v[:, 0] += 0.10 * np.clip(v[:, 1] - 0.04, 0, None) ** 1.2
    blush = np.clip(0.5 + 1.2 * layered_noise(v / 0.045) + 6 * v[:, 0], 0, 1)[:, None]
    speckle = 1 - 0.25 * (layered_noise(v / 0.0028) > 0.55)[:, None]
    albedo = (blush * [0.55, 0.28, 0.08] + (1 - blush) * [0.48, 0.47, 0.11]) * speckle
    stem = tube([(0.003, 0.088, 0), (0.004, 0.102, 0), (0.010, 0.114, 0.002)], 0.0013)
    return merged(make_shape(v, shape.faces, np.clip(albedo, 0, 1)), painted(stem, (0.15, 0.09, 0.05)))


def book() -> Shape:
    """A closed book lying flat, 0.21 by 0.15 m, spine to the front."""
    cover: Paint = (0.33, 0.06, 0.05)
    boards = [_slab((0.21, 0.004, 0.150), (0, y, 0), cover) for y in (0.002, 0.040)]
    pages = _slab((0.203, 0.034, 0.142), (0, 0.021, -0.003), (0.72, 0.68, 0.56))
    angle = np.linspace(-np.pi / 2, np.pi / 2, 40)
    arc = np.stack([0.021 * np.sin(angle) + 0.021, 0.011 * np.cos(angle) + 0.073], axis=-1)
    ends = np.array([-0.105, 0.105])
    v = np.stack([np.repeat(ends, 40), np.tile(arc[:, 0], 2), np.tile(arc[:, 1], 2)], axis=-1)
    spine = painted(make_shape(v, grid_faces(2, 40)), cover)
    bands = []
    for x in (-0.080, -0.074, 0.074, 0.080):
        strip = v.copy()
        strip[:, 0] = x + np.repeat([-0.0012, 0.0012], 40)
        strip[:, 1:] = 0.021 * np.array([1, 0]) + (strip[:, 1:] - 0.021 * np.array([1, 0])) * [1.03, 1.004]
        bands.append(painted(make_shape(strip, grid_faces(2, 40)), (0.62, 0.47, 0.14)))
    return merged(*boards, pages, spine, *bands)


def _slab(size: tuple[float, float, float], middle: tuple[float, float, float], paint: Paint) -> Shape:
    solid = box()
    return painted(make_shape(solid.vertices * np.array(size) + np.array(middle), solid.faces), paint)


def cloth() -> Shape:
    """A striped cloth, 0.42 m wide: it lies on a table's edge at y = 0, z = 0, and hangs down in folds in front."""
    rows, cols = 260, 320
    along, across = np.meshgrid(np.linspace(0, 0.50, rows), np.linspace(-0.21, 0.21, cols), indexing="ij")
    flat, bend = 0.24, 0.012
    turn = np.clip((along - flat) / bend, 0, np.pi / 2)
    hang = np.clip(along - flat - bend * np.pi / 2, 0, None)
    depth = -np.clip(flat - along, 0, None) + bend * np.sin(turn)
    y = -bend * (1 - np.cos(turn)) - hang
    drop = 1 - np.exp(-((hang / 0.08) ** 1.4))
    folds = np.sin(across * 62 + 0.8 * np.sin(across * 23)) + 0.45 * np.sin(across * 117 + 1.3)
    depth = depth + 0.013 * drop * (folds + 1.4)
    creases = layered_noise(np.stack([across, along, 0 * across], -1).reshape(-1, 3) / 0.11).reshape(rows, cols)
    y = y + 0.006 * (1 - drop) * np.clip(creases + 0.8, 0, None) * np.clip((flat - along) / 0.03, 0, 1)
    v = np.stack([across * (1 - 0.05 * drop), y + 0.002, depth], axis=-1).reshape(-1, 3)
    stripe = (np.floor(across.ravel() / 0.028) % 3 == 0) | (np.abs(along.ravel() - 0.47) < 0.006)
    albedo = np.where(stripe[:, None], [0.16, 0.24, 0.22], [0.66, 0.61, 0.50])
    return make_shape(v, grid_faces(rows, cols)[:, ::-1], albedo)
