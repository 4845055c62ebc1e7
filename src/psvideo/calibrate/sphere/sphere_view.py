"""A mirror sphere as a camera sees it: viewing rays, the sphere that an outline belongs to, and the mirrored ray.

With a known focal length every pixel has its own ray, and a sphere's outline is the cone of rays that touch it: the
pixels whose rays stand at one angle to the ray through the sphere's centre (an ellipse in the picture). Without it all
rays are taken for parallel (orthographic), and the outline for a circle; a sphere off the lens's axis by an angle then
gives directions that are wrong by about that angle.

An outline is five numbers, ``(x, y, radius, stretch, slant)``: where the centre appears in pixels, the radius in pixels
that it would have in the middle of the picture, and, for parallel rays only, by which shares the circle is stretched
along the columns (``cos 2t``) and along the diagonal (``sin 2t``), as an unknown perspective does. Points
are ``(x, y)``: column to the right, row downwards, (0, 0) in the centre of the top left pixel. Vectors are in the
camera frame: x right, y up, z towards the camera.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import UsageError, check_within
from psvideo.model.arrays import Doubles
from psvideo.model.rig import Vector


@dataclass(frozen=True, kw_only=True)
class SphereView:
    """How pixels become rays. ``focal_px`` None: parallel rays; lengths are then in pixels."""

    focal_px: float | None
    principal_px: tuple[float, float]

    @property
    def unknowns(self) -> int:
        """How many of an outline's numbers are to be found: parallel rays leave the stretch open."""
        return 5 if self.focal_px is None else 3

    def rays(self, points: Doubles) -> tuple[Doubles, Doubles]:
        """Return origins and unit directions, both (point, 3), of the viewing rays through points (point, 2)."""
        points = np.asarray(points, np.float64)
        zero = np.zeros(len(points))
        if self.focal_px is None:
            origins = np.stack([points[:, 0], -points[:, 1], zero], axis=1)
            return origins, np.broadcast_to([0.0, 0.0, -1.0], origins.shape)
        across, down = (points - self.principal_px).T / self.focal_px
        return np.zeros((len(points), 3)), _unit(np.stack([across, -down, zero - 1.0], axis=1))

    def sphere(self, outline: Doubles) -> tuple[Doubles, float]:
        """Return centre (3,) and radius of a sphere with this outline; in perspective the radius is taken as 1."""
        x, y, radius_px = outline[:3]
        if self.focal_px is None:
            return np.array([x, -y, -2.0 * radius_px]), float(radius_px)
        _, towards = self.rays(np.array([[x, y]]))
        centre: Doubles = towards[0] / np.sin(np.arctan2(radius_px, self.focal_px))
        return centre, 1.0

    def distance_px(self, points: Doubles, outline: Doubles) -> Doubles:
        """Return how far points (point, 2) lie outside an outline, in pixels; negative inside."""
        x, y, radius_px = outline[:3]
        if self.focal_px is None:
            away = points - outline[:2]
            distance: Doubles = np.hypot(*away.T) - radius_px * _stretch(away, outline)
            return distance
        _, towards = self.rays(np.array([[x, y]]))
        _, rays = self.rays(points)
        angle = np.arctan2(np.linalg.norm(np.cross(rays, towards), axis=1), rays @ towards[0])
        outside: Doubles = (angle - np.arctan2(radius_px, self.focal_px)) * self.focal_px
        return outside

    def through(self, points: Doubles) -> Doubles | None:
        """Return the outline nearest to three or more points in an algebraic sense; None where there is none.

        A cone of half angle a about the unit vector c holds the unit rays d with ``d . c = cos a``, and a circle the
        points with ``p . p = 2 c . p + k``: both are linear in three unknowns.
        """
        if self.focal_px is None:
            middle = points.mean(axis=0)
            near = points - middle
            known = np.column_stack([2 * near, np.ones(len(near))])
            solved = np.linalg.lstsq(known, (near**2).sum(axis=1), rcond=None)[0]
            square = solved[2] + solved[0] ** 2 + solved[1] ** 2
            return None if square <= 0 else np.array([*(solved[:2] + middle), np.sqrt(square), 0.0, 0.0])
        _, rays = self.rays(points)
        axis = np.linalg.lstsq(rays, np.ones(len(rays)), rcond=None)[0]
        length = float(np.linalg.norm(axis))
        if length <= 1.0 or axis[2] >= 0:
            return None
        radius_px = self.focal_px * np.tan(np.arccos(1.0 / length))
        return np.array([*self.project(axis[None])[0], radius_px, 0.0, 0.0])

    def project(self, vectors: NDArray[np.floating]) -> Doubles:
        """Return where vectors (n, 3) from the optical centre (orthographic: points) appear, shape (n, 2)."""
        if self.focal_px is None:
            return np.stack([vectors[:, 0], -vectors[:, 1]], axis=1)
        across, up, back = vectors.T
        seen: Doubles = np.stack([-across / back, up / back], axis=1) * self.focal_px + np.array(self.principal_px)
        return seen

    def curve(self, outline: Doubles, count: int = 360) -> Doubles:
        """Return points (count, 2) along an outline, evenly by angle."""
        turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
        x, y, radius_px = outline[:3]
        if self.focal_px is None:
            ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
            rim: Doubles = outline[:2] + radius_px * _stretch(ring, outline)[:, None] * ring
            return rim
        axis = self.rays(np.array([[x, y]]))[1][0]
        right = _unit(np.cross(axis, [0.0, 1.0, 0.0])[None])[0]
        down = np.cross(axis, right)
        touched = radius_px / self.focal_px * (np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * down)
        return self.project(axis + touched)

    def mirrored(self, outline: Doubles, point: Doubles) -> tuple[Doubles, Doubles] | None:
        """Return where the ray through a point meets the sphere, and the unit direction in which it is mirrored.

        That direction leads to the light whose highlight the point is. None where the ray misses the sphere.
        """
        centre, radius = self.sphere(outline)
        origins, directions = self.rays(self.unstretched(np.asarray(point, np.float64)[None], outline))
        origin, ray = origins[0], directions[0]
        along = float(ray @ (centre - origin))
        gap = radius**2 - float(np.sum((origin + along * ray - centre) ** 2))
        if gap <= 0:
            return None
        met = origin + (along - np.sqrt(gap)) * ray
        normal = (met - centre) / radius
        return met, ray - 2 * (ray @ normal) * normal

    def unstretched(self, points: Doubles, outline: Doubles) -> Doubles:
        """Return where points (point, 2) of an outline's sphere would lie if the outline were a circle: parallel rays
        know no other way in which it is drawn out."""
        if self.focal_px is not None:
            return points
        away = points - outline[:2]
        circular: Doubles = outline[:2] + away / _stretch(away, outline)[:, None]
        return circular

    def off_axis_deg(self, point: Vector | Doubles, focal_px: float | None = None) -> float:
        """Return the angle between the lens's axis and the ray through a point, with this focal length or another."""
        focal = focal_px or self.focal_px
        away = float(np.hypot(point[0] - self.principal_px[0], point[1] - self.principal_px[1]))
        return 0.0 if focal is None else float(np.degrees(np.arctan2(away, focal)))


def _stretch(away: Doubles, outline: Doubles) -> Doubles:
    """Return by what factor an outline is longer than its radius in the directions of vectors (n, 2)."""
    twice = 2 * np.arctan2(away[:, 1], away[:, 0])
    factor: Doubles = 1.0 + outline[3] * np.cos(twice) + outline[4] * np.sin(twice)
    return factor


def _unit(vectors: Doubles) -> Doubles:
    unit: Doubles = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return unit


LONGEST_PX = 1e7
"""No lens is longer: 20 m over pixels of 2 micrometres."""
FARTHEST_PX = 1e6
"""Nothing that a picture shows is further from it."""


@dataclass(frozen=True, kw_only=True)
class Looking:
    """How spheres are looked for: how many a picture holds, or where they are (x, y, radius), found by hand.

    ``focal_px``, or ``focal_widths`` in widths of the picture, and ``principal_px`` give the pixels their rays.
    """

    spheres: int = 1
    circles: tuple[tuple[float, float, float], ...] = ()
    focal_px: float | None = None
    focal_widths: float | None = None
    principal_px: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Raise UsageError where a number cannot be meant."""
        if self.focal_px is not None:
            check_within("focal_px", self.focal_px, 1, LONGEST_PX, unit="pixels")
        for number in self.principal_px or ():
            check_within("principal_px", number, -FARTHEST_PX, FARTHEST_PX, unit="pixels")
        for x, y, radius in self.circles:
            check_within("circle", radius, 0, FARTHEST_PX, unit="pixels of radius")
            for number in (x, y):
                check_within("circle", number, -FARTHEST_PX, FARTHEST_PX, unit="pixels")

    def view(self, *, width_px: int, height_px: int) -> SphereView:
        """Return the view of pictures of this size; the lens's axis goes through their middle unless it is given.

        Raises UsageError where an outline that was found by hand is larger than the picture, or nowhere in it.
        """
        for x, y, radius in self.circles:
            outside = not (-radius < x < width_px + radius and -radius < y < height_px + radius)
            if outside or radius > max(width_px, height_px):
                raise UsageError(
                    f"`circle` {x:g},{y:g},{radius:g}: is {'outside of' if outside else 'larger than'} the picture of "
                    f"{width_px} x {height_px} pixels. Expected a sphere's middle and radius, in pixels from the top "
                    "left."
                )
        middle = ((width_px - 1) / 2, (height_px - 1) / 2)
        focal_px = self.focal_px if self.focal_widths is None else self.focal_widths * width_px
        return SphereView(focal_px=focal_px, principal_px=self.principal_px or middle)
