"""Mirror spheres in rooms that they mirror: random walls, panels, floors, stands, blur and noise, with a known truth.

At its very rim every smooth sphere mirrors what is just behind it; whether its outline shows there depends on the
metal or glass and on the room. What is drawn here is seen and mirrored alike: one room, a function of direction, far
away. Written from the laws of reflection and Fresnel alone (Schlick's approximation); nothing under test is used.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np

from bench.mirror_scene import Ball, Lamp, Lens, unit


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Something bright or dark in the room: where it is, its half sizes (degrees), and its brightness."""

    towards: tuple[float, float, float]
    half_deg: tuple[float, float]
    brightness: float
    soft_deg: float = 2.0


@dataclass(frozen=True, kw_only=True)
class Room:
    """What surrounds a sphere, and how it is filmed.

    The wall behind it has a brightness with a slope across and up, per light (``washes``: factor and slopes). ``step``
    is an edge in the wall, as of a sheet of paper: the direction (degrees) in which it lies, how far from the middle
    (degrees), and the factor beyond it. ``facing`` is the sphere's reflectance seen head on: 0.05 glass, 0.6 chrome.
    ``stand`` is the brightness of a stand that touches the sphere from below, None for a sphere on a string.
    """

    wall: float = 0.1
    washes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0),)
    step: tuple[float, float, float] | None = None
    floor: float = 0.02
    behind_camera: float = 0.01
    panels: tuple[Panel, ...] = field(default=())
    facing: float = 0.6
    stand: float | None = None
    blur_px: float = 0.8
    noise: float = 0.002
    bits: int = 12


def film(
    lens: Lens, ball: Ball, lamps: Sequence[Lamp], room: Room, *, samples: int = 3, seed: int = 0
) -> list[np.ndarray]:
    """Return one linear picture (row, col) per lamp, clipped at 1."""
    totals = np.zeros((len(lamps), lens.height, lens.width))
    for sub in np.ndindex(samples, samples):
        shift = (np.array(sub) + 0.5) / samples - 0.5
        cols, rows = np.meshgrid(np.arange(lens.width) + shift[0], np.arange(lens.height) + shift[1])
        across, down = (cols - lens.middle[0]) / lens.focal, (rows - lens.middle[1]) / lens.focal
        rays = unit(np.stack([across, -down, -np.ones_like(across)], axis=-1))
        totals += _seen(rays, ball, lamps, room)
    rng = np.random.default_rng(seed)
    pictures = []
    for total in totals / samples**2:
        blurred = cv2.GaussianBlur(total, (0, 0), room.blur_px, borderType=cv2.BORDER_REPLICATE)
        noisy = blurred + room.noise * np.sqrt(0.1 + np.clip(blurred, 0, 1)) * rng.standard_normal(total.shape)
        levels = 2**room.bits - 1
        pictures.append((np.round(np.clip(noisy, 0, 1) * levels) / levels).astype(np.float32))
    return pictures


def _seen(rays: np.ndarray, ball: Ball, lamps: Sequence[Lamp], room: Room) -> np.ndarray:
    centre = np.array(ball.centre)
    along = rays @ centre
    gap = along**2 - (centre @ centre - ball.radius_m**2)
    hit = gap > 0
    met = (along[hit] - np.sqrt(gap[hit]))[:, None] * rays[hit]
    normal = (met - centre) / ball.radius_m
    cosine = -(rays[hit] * normal).sum(axis=-1)
    mirrored = rays[hit] + 2 * cosine[:, None] * normal
    reflectance = room.facing + (1 - room.facing) * (1 - cosine) ** 5
    on_stand = _stand(rays, ball) if room.stand is not None else np.zeros_like(hit)
    pictures = []
    for n, lamp in enumerate(lamps):
        wash = room.washes[n % len(room.washes)]
        light = _around(rays, room, wash)
        seen = _around(mirrored, room, wash)
        if lamp.direction is not None:
            angle = np.degrees(np.arccos(np.clip(mirrored @ unit(np.array(lamp.direction)), -1, 1)))
            seen = seen + lamp.strength * np.exp(-((angle / lamp.size_deg) ** 2))
        light[hit] = reflectance * seen
        light[on_stand] = (room.stand or 0.0) * wash[0]
        pictures.append(light)
    return np.stack(pictures)


def _around(directions: np.ndarray, room: Room, wash: tuple[float, float, float]) -> np.ndarray:
    """Return the room's brightness in unit directions (..., 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    level, across, up = wash
    wall = room.wall * level * np.clip(1 + across * x + up * y, 0.05, None)
    if room.step is not None:
        turn, off_deg, factor = room.step
        side = np.degrees(np.arcsin(np.clip(x * np.cos(np.radians(turn)) + y * np.sin(np.radians(turn)), -1, 1)))
        wall = wall * np.where((side > off_deg) & (z < 0), factor, 1.0)
    # the wall ends 50 to 70 degrees off the axis; the rest of the room is darker
    edge = np.clip((-z - np.cos(np.radians(70))) / (np.cos(np.radians(50)) - np.cos(np.radians(70))), 0, 1)
    light = room.behind_camera * level + edge * wall
    down = np.degrees(np.arcsin(np.clip(-y, -1, 1)))
    light = np.where(down > 25, room.floor * level, light)
    for panel in room.panels:
        light = light + panel.brightness * _panel(directions, panel)
    return light


def _panel(directions: np.ndarray, panel: Panel) -> np.ndarray:
    towards = unit(np.array(panel.towards))
    right = unit(np.cross([0.0, 1.0, 0.0], towards))
    above = np.cross(towards, right)
    inside = np.clip((directions @ towards) * 1e3, 0, 1)
    for axis, half in ((right, panel.half_deg[0]), (above, panel.half_deg[1])):
        away = np.abs(np.degrees(np.arcsin(np.clip(directions @ axis, -1, 1))))
        inside = inside * np.clip((half + panel.soft_deg / 2 - away) / panel.soft_deg, 0, 1)
    return np.asarray(inside)


def _stand(rays: np.ndarray, ball: Ball) -> np.ndarray:
    """Return which rays see a stand: a post under the ball, two thirds of its radius wide, that hides its foot."""
    centre = np.array(ball.centre)
    at_depth = rays * (centre[2] / rays[..., 2:3])
    narrow = np.abs(at_depth[..., 0] - centre[0]) < 0.65 * ball.radius_m
    return np.asarray(narrow & (at_depth[..., 1] < centre[1] - 0.86 * ball.radius_m))


def _three(values: Iterable[float]) -> tuple[float, float, float]:
    first, second, third = map(float, values)
    return first, second, third


def random_room(rng: np.random.Generator, *, lights: int) -> Room:
    """Return a room such as people film in: any wall, a sheet of paper or none, windows and furniture, a stand."""
    panels = tuple(
        Panel(
            towards=_three(unit(rng.standard_normal(3) * [1, 0.6, 1])),
            half_deg=(float(rng.uniform(3, 25)), float(rng.uniform(3, 25))),
            brightness=float(10 ** rng.uniform(-2.5, -0.8)),
            soft_deg=float(rng.uniform(1, 8)),
        )
        for _ in range(rng.integers(2, 7))
    )
    step = (float(rng.uniform(0, 360)), float(rng.uniform(-6, 6)), float(10 ** rng.uniform(-0.7, 0.7)))
    return Room(
        wall=float(10 ** rng.uniform(-2.2, -0.3)),
        washes=tuple(_three([rng.uniform(0.2, 1), *rng.uniform(-0.8, 0.8, 2)]) for _ in range(lights)),
        step=step if rng.random() < 0.4 else None,
        floor=float(10 ** rng.uniform(-2.5, -1)),
        behind_camera=float(10 ** rng.uniform(-3, -1.5)),
        panels=panels,
        facing=float(rng.choice([0.05, 0.6, 0.6])),
        stand=float(10 ** rng.uniform(-2, -0.3)) if rng.random() < 0.5 else None,
        blur_px=float(rng.uniform(0.5, 2.2)),
        noise=float(10 ** rng.uniform(-3, -2)),
    )
