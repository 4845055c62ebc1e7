"""A painted ball that turns under five lights before an even wall, drawn from its points, and its true ways."""

import math

import cv2
import numpy as np
from scipy.spatial.transform import Rotation
from sketched_pairs import pairs_around, sketched

from psvideo.model.arrays import Doubles, Flags, Floats
from psvideo.model.irradiance.ground import Ground
from psvideo.model.rig import Light
from psvideo.plates.align.by_surface import BySurface
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Pair

SHAPE, COUNT, RADIUS_PX = (160, 192), 5, 62.0
FLASHES_S = 1 / (COUNT + 1) * (np.arange(COUNT) - (COUNT - 1) / 2)
TURN = np.radians([-6.0, 15.0, 4.0])
"""How fast the ball turns, right, down and to the camera: 17 degrees and up to 18 px in a round."""
UNITS = np.array([1, 1, *[1 / RADIUS_PX] * 4])


def turned(places: Doubles, spin: Doubles, time_s: float) -> Doubles:
    """Places (point, 3: right, down, near) after a turn. With a third axis towards the camera these axes are
    left-handed: SciPy's rotations are told in right-handed ones, right, down and away."""
    away = np.array([1, 1, -1])
    return np.asarray(Rotation.from_rotvec(-spin * away * time_s).apply(places * away) * away)


def ball(middle: tuple[float, float] = (0, 0), radius_px: float = RADIUS_PX) -> tuple[Flags, Doubles]:
    """Where a ball is, and its points from its middle, right, down, near (row, col, 3), in radii."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float64)
    x, y = (x - (SHAPE[1] - 1) / 2 - middle[0]) / radius_px, (y - (SHAPE[0] - 1) / 2 - middle[1]) / radius_px
    depth = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    return np.asarray(depth > 0), np.stack([x, y, depth], axis=-1)


def lights() -> list[Light]:
    around = [2 * math.pi * n / COUNT + 0.3 for n in range(COUNT)]
    return [Light(name=f"l{n}", direction=(0.7 * math.cos(a), 0.7 * math.sin(a), 0.71)) for n, a in enumerate(around)]


FAR_M, PIXELS_PER_M = 1.2, 500.0


def near_lights(lamps_m: float) -> list[Light]:
    """As many, so far from the ball's middle: its radius is 0.124 m."""
    middle_m = np.array([0, 0, -FAR_M])
    places_m = [middle_m + lamps_m * np.array(light.direction) for light in lights()]
    return [
        Light(name=light.name, position_m=(float(x), float(y), float(z)), intensity=(0.7 * lamps_m**2,))
        for light, (x, y, z) in zip(lights(), places_m, strict=True)
    ]


def ground() -> Ground:
    """A plane through the ball's middle, of which the picture shows 0.4 m."""
    return Ground(
        depth_m=np.full(SHAPE, FAR_M, np.float32),
        middle_m=np.array([0, 0, -FAR_M]),
        focal_px=(FAR_M * PIXELS_PER_M,) * 2,
        principal_px=((SHAPE[1] - 1) / 2, (SHAPE[0] - 1) / 2),
    )


def towards_near(light: int, points: Doubles, lamps_m: float) -> Doubles:
    """What a near light sends to points (row, col, 3) of a ball in the picture's middle, right, up and near."""
    away_m = np.array(near_lights(lamps_m)[light].position_m) - (points * RADIUS_PX / PIXELS_PER_M - [0, 0, FAR_M])
    return np.asarray(0.7 * lamps_m**2 * away_m / np.linalg.norm(away_m, axis=-1, keepdims=True) ** 3)


SPOTS = cv2.GaussianBlur(np.random.default_rng(5).normal(size=(400, 800)), (0, 0), 4)


def painted(points: Doubles, spin: Doubles, time_s: float) -> Floats:
    """The paint of a ball's points where it turned so long."""
    before = turned(points.reshape(-1, 3), spin, -time_s).reshape(points.shape)
    angle = np.arctan2(before[..., 0], before[..., 2])
    places = ((angle / math.pi + 1) % 2 * 400).astype(np.float32), ((before[..., 1] + 1) * 199).astype(np.float32)
    spots = (SPOTS / SPOTS.std()).astype(np.float32)
    shown = cv2.remap(spots, *places, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
    return np.asarray(np.clip(0.5 + 0.15 * shown, 0.1, 0.9), np.float32)


def seen(light: int, time_s: float, spin: Doubles, *, lamps_m: float | None = None) -> Sketch:
    """A light's sketch of the ball before an even wall; of a light so near, or of a distant one."""
    inside, points = ball()
    direction, normals = np.array(lights()[light].direction), points * [1, -1, 1]
    sent = direction if lamps_m is None else towards_near(light, normals, lamps_m)
    shaded = painted(points, spin, time_s) * np.maximum((normals * sent).sum(axis=-1), 0)
    noise = np.random.default_rng([light, int(1e4 * (time_s + 9))]).normal(0, 0.002, SHAPE)
    image = np.asarray(np.where(inside, shaded, 0.3 * direction[2]) + noise, np.float32)
    return sketched(image, light, time_s)


def pairs(spin: Doubles = TURN, *, lamps_m: float | None = None) -> dict[str, Pair]:
    """Every light's plates before and after the instant 0."""
    return pairs_around(lambda light, time_s: seen(light, time_s, spin, lamps_m=lamps_m), FLASHES_S)


def surface_of(shown: dict[str, Pair], *, lamps_m: float | None = None) -> BySurface:
    given = lights() if lamps_m is None else near_lights(lamps_m)
    lamps = Lamps.of(given, [*shown], None if lamps_m is None else ground())
    by_surface = BySurface.of(lamps, shown, {})
    assert by_surface is not None
    return by_surface
