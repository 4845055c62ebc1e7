"""Near lights: every pixel has lights of its own, and their normals are as exact as the surface's place is known."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from near_room import (
    FAR_M,
    FOCAL_PX,
    MIDDLE,
    SIZE,
    WIDTH_M,
    Array,
    filmed,
    lit_by,
    mean_error_deg,
    rays,
    relief,
    ring_rig,
    surface,
)

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Floats
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.irradiance.near_light import near_field, near_vectors
from psvideo.model.rig import Light, Rig
from psvideo.solve import near_surface
from psvideo.solve.depth import Shaping, View
from psvideo.solve.falloff_costs import around
from psvideo.solve.near_surface import NearSurface, solve_near
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.loops.near_kernel import place_lights
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.task import Near
from psvideo.solve.pixels_of_points import for_pixels


def bulge(u: Array, v: Array) -> Array:
    """Depth of a ball as far as 50 degrees from its middle, as wide as the picture; its rim lies in the plane."""
    reach = np.radians(50)
    radius_m = 0.5 * WIDTH_M / np.sin(reach)
    centre = np.array([0, 0, -FAR_M - radius_m * np.cos(reach)])
    ray = rays(u, v)
    a, b = (ray * ray).sum(axis=-1), ray @ centre
    root = b * b - a * (centre @ centre - radius_m**2)
    depth: Array = np.where(root > 0, (b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
    return np.minimum(depth, FAR_M)


@pytest.mark.parametrize("solver", [woodham1980, huber1981], ids=["least squares", "robust"])
@pytest.mark.parametrize("lights", [3, 4, 8])
def test_where_the_plane_is_the_surface_normals_and_albedo_are_exact(lights: int, solver: ModuleType) -> None:
    rig = ring_rig(lights, 1.5)
    tilted = Rig(lights=rig.lights, focal_px=rig.focal_px, principal_px=rig.principal_px, plane=(0.1, -0.2, 1.0, FAR_M))
    toward = np.array([0.1, -0.2, 1.0])
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    points = rays(u, v) * (-FAR_M / (rays(u, v) @ toward))[..., None]
    normals = np.broadcast_to(toward / np.linalg.norm(toward), points.shape)
    found = solver.solve(LitPlates(filmed(tilted, points, normals), lit_by(tilted)))
    assert found.valid.all()
    assert mean_error_deg(found, normals) < 2e-3
    np.testing.assert_allclose(found.albedo, 0.43, rtol=2e-4)


# lights' distance in subject widths, mean error when taken for distant at least, with the right plane at most, and
# with the plane off by a tenth (0.4 subject widths) at most
PHYSICS = [(2, 16.6, 0.4, 7.0), (3, 11.6, 0.36, 3.5), (5, 7.2, 0.2, 2.0), (10, 3.7, 0.1, 1.0)]


@pytest.mark.parametrize(("widths", "distant_deg", "near_deg", "off_deg"), PHYSICS)
def test_directions_from_the_plane_undo_what_taking_lights_for_distant_costs(
    widths: float, distant_deg: float, near_deg: float, off_deg: float
) -> None:
    points, normals = surface(relief)
    rig = ring_rig(3, widths)
    plates, near = filmed(rig, points, normals), lit_by(rig)
    distant = Illumination(directions=near.directions, intensities=near.intensities)
    assert mean_error_deg(woodham1980.solve(LitPlates(plates, distant)), normals) > distant_deg
    assert mean_error_deg(woodham1980.solve(LitPlates(plates, near)), normals) < near_deg
    for share in (0.9, 1.1):
        off = lit_by(ring_rig(3, widths, plane_m=share * FAR_M))
        assert mean_error_deg(woodham1980.solve(LitPlates(plates, off)), normals) < off_deg


@pytest.mark.parametrize("widths", [2, 3])
def test_alternating_with_integrated_depth_takes_off_what_a_plane_cannot_know(
    widths: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    points, normals = surface(bulge)
    inside = -points[..., 2] < FAR_M - 1e-6
    rig = ring_rig(8, widths, plane_m=float(np.median(-points[..., 2][inside])))
    plates = filmed(rig, points, normals)
    shaping = Shaping(view=View(focal_px=rig.focal_px, principal_px=rig.principal_px), plane=rig.plane)

    def error_deg(iterations: int) -> float:
        near = NearSurface(ground=ground_of(rig, height_px=SIZE, width_px=SIZE), shaping=shaping, iterations=iterations)
        found = solve_near(
            near,
            lambda ground: illumination(rig.lights, channels=1, ground=ground),
            lambda lit: woodham1980.solve(LitPlates(plates, lit, mask=inside)),
        )
        return mean_error_deg(found, normals, inside)

    with_plane = error_deg(0)
    assert with_plane > 0.5
    assert error_deg(1) < 0.12 * with_plane
    monkeypatch.setattr(near_surface, "ROUGH_PX", 32)  # large pictures are integrated on rough pixels
    assert error_deg(1) < 0.2 * with_plane


def test_distant_lights_may_stand_among_near_ones_and_a_far_light_is_a_distant_one() -> None:
    points, normals = surface(relief)
    near = ring_rig(4, 2)
    mixed = Rig(
        lights=(*near.lights, Light(name="sun", direction=(0.3, 0.5, np.sqrt(1 - 0.34)), intensity=(0.8,))),
        focal_px=near.focal_px, principal_px=near.principal_px, plane=near.plane,
    )  # fmt: skip
    assert mean_error_deg(woodham1980.solve(LitPlates(filmed(mixed, points, normals), lit_by(mixed))), normals) < 0.2
    far = Rig(
        lights=tuple(
            Light(name=light.name, position_m=tuple(45 * np.array(way)), intensity=(45.0**2,))
            for light, way in zip(near.lights, lit_by(near).directions, strict=True)
        ),
        focal_px=near.focal_px, principal_px=near.principal_px, plane=near.plane,
    )  # fmt: skip
    distant = illumination(
        [Light(name=str(n), direction=tuple(way)) for n, way in enumerate(lit_by(far).directions)], channels=1
    )
    plates = filmed(far, points, normals)
    one, other = woodham1980.solve(LitPlates(plates, lit_by(far))), woodham1980.solve(LitPlates(plates, distant))
    assert np.abs(one.normals - other.normals).max() < 0.02
    assert (one.valid == other.valid).all()


@EXACT.kept
def _placed(matrix: Floats, per_strength: Floats, near: Near, row: int, n: int) -> None:
    place_lights(matrix, per_strength, near, row, 0, n)


@pytest.mark.parametrize("anisotropy", [0.0, 1.0, 2.5])
def test_the_compiled_lights_are_those_of_the_model(anisotropy: float) -> None:
    rig = replace(
        ring_rig(4, 3.0),
        lights=tuple(replace(light, anisotropy=anisotropy) for light in ring_rig(4, 3.0).lights),
    )
    ground = ground_of(rig, height_px=SIZE, width_px=SIZE)
    ground = ground.with_depth(relief(*np.mgrid[:SIZE, :SIZE][::-1].astype(float)))
    field = near_field(rig.lights, ground)
    short = np.float32
    near = Near(
        positions=field.positions_m.astype(short), is_near=field.is_near.astype(np.uint8),
        axes=field.axes.astype(short), anisotropy=field.anisotropy.astype(short),
        strengths=np.ones(4, short), depth=ground.depth_m,
        pinhole=np.array([1 / FOCAL_PX, 1 / FOCAL_PX, MIDDLE, MIDDLE], short),
    )  # fmt: skip
    row = 17
    matrix, per = np.zeros((4, 3, SIZE), short), np.zeros((4, SIZE), short)
    _placed(matrix, per, near, row, SIZE)
    col = np.arange(SIZE, dtype=float)
    points = rays(col, np.full(SIZE, float(row))) * ground.depth_m[row][:, None].astype(float)
    for light in range(4):
        wanted = near_vectors(points, field.positions_m[light], axis=field.axes[light], anisotropy=anisotropy)
        np.testing.assert_allclose(matrix[light].T, wanted, rtol=2e-5)
        np.testing.assert_allclose(1 / per[light], np.linalg.norm(wanted, axis=1), rtol=2e-5)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("size", [(17, 23), (20, 20)])
def test_a_point_stands_for_the_pixels_that_it_is_the_mean_of(count: int, size: tuple[int, int]) -> None:
    rows, cols = size
    light = np.zeros((*size, 1))
    light[..., 0] = np.arange(rows)[:, None] * 1000 + np.arange(cols)
    points = np.arange(-(-rows // count) * -(-cols // count)).reshape(-(-rows // count), -(-cols // count))
    of = for_pixels(points, count, size)
    assert of.shape == size
    means = around(light, count)[..., 0]
    inner = means[:-1, :-1]  # at the far border a point stands for what is beyond its own square, too
    for (row, col), mean in np.ndenumerate(inner):
        assert light[of == points[row, col]].mean() == pytest.approx(mean)
