"""Near lights: every pixel has lights of its own, and their normals are as exact as the surface's place is known."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray
from scipy.io import loadmat  # type: ignore[attr-defined]

import psvideo as ps
from psvideo.cli.app import main
from psvideo.compute.compiled import EXACT
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Floats
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.irradiance.near_light import near_field, near_vectors
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Misfit, Surface
from psvideo.solve import near_surface
from psvideo.solve.depth import Shaping, View
from psvideo.solve.falloff_costs import around, falloff_costs, for_pixels
from psvideo.solve.near_surface import NearSurface, solve_near
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.loops.near_kernel import place_lights
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.task import Near
from psvideo.solve.normals.trust.judging import Judging
from psvideo.solve.normals.trust.judging import _typical as typical
from psvideo.solve.normals.trust.near_spread import NearSpread, near_spread
from psvideo.solve.normals.trust.thin_surface import ThinSurface
from psvideo.solve.sweeping import RATIOS, swept
from psvideo.solve.sweeping import _costs as swept_costs
from psvideo.solve.sweeping import _unsure as doubted

Array = NDArray[np.float64]
SIZE, WIDTH_M, FAR_M = 96, 0.4, 1.6
FOCAL_PX, MIDDLE = SIZE * FAR_M / WIDTH_M, (SIZE - 1) / 2


def rays(u: Array, v: Array) -> Array:
    return np.stack([(u - MIDDLE) / FOCAL_PX, -(v - MIDDLE) / FOCAL_PX, -np.ones_like(u)], axis=-1)


def relief(u: Array, v: Array) -> Array:
    """Depth of waves that tilt by 16 degrees in the mean."""
    return FAR_M + 0.024 * WIDTH_M * np.sin(6 * np.pi * u / SIZE) * np.cos(5 * np.pi * v / SIZE)


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


def surface(depth: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
    """Points and normals of every pixel, by fine differences."""
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)

    def at(u: Array, v: Array) -> Array:
        return depth(u, v)[..., None] * rays(u, v)

    step = 1e-3
    normals = np.cross(at(u, v + step) - at(u, v - step), at(u + step, v) - at(u - step, v))
    return at(u, v), normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def ring_rig(lights: int, widths: float, *, distance_m: float = FAR_M, plane_m: float | None = None) -> Rig:
    """Lights 35 degrees off the axis, so many subject widths from the point ``distance_m`` before the lens."""
    around, slant = 0.3 + np.arange(lights) * 2 * np.pi / lights, np.radians(35)
    way = np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.full(lights, np.cos(slant))], 1)
    positions = np.array([0, 0, -distance_m]) + widths * WIDTH_M * way
    strength = ((widths * WIDTH_M) ** 2,)
    return Rig(
        lights=tuple(Light(name=f"L{n}", position_m=tuple(p), intensity=strength) for n, p in enumerate(positions)),
        focal_px=(FOCAL_PX, FOCAL_PX),
        principal_px=(MIDDLE, MIDDLE),
        plane=(0.0, 0.0, 1.0, plane_m or distance_m),
    )


def filmed(rig: Rig, points: Array, normals: Array, albedo: float = 0.43) -> list[NDArray[np.float32]]:
    """A plate per light by the law of an LED: cos^mu about its axis, and the inverse square."""
    plates = []
    for light in rig.lights:
        if light.direction is not None:
            way, sent = np.array(light.direction), 1.0
        else:
            away = np.array(light.position_m) - points
            distance = np.linalg.norm(away, axis=-1, keepdims=True)
            way, sent = away / distance, 1 / distance[..., 0] ** 2
            if light.axis is not None:
                sent = sent * np.maximum(-(way @ np.array(light.axis)), 0) ** light.anisotropy
        shade = np.maximum((way * normals).sum(axis=-1), 0) * sent
        strengths = np.array(light.intensity)
        picture = albedo * shade[..., None] * strengths
        plates.append((picture[..., 0] if len(strengths) == 1 else picture).astype(np.float32))
    return plates


def lit_by(rig: Rig, channels: int = 1) -> Illumination:
    return illumination(rig.lights, channels=channels, ground=ground_of(rig, height_px=SIZE, width_px=SIZE))


def mean_error_deg(found: Surface, normals: Array, where: NDArray[np.bool_] | None = None) -> float:
    both = found.valid if where is None else found.valid & where
    assert both.mean() > 0.5
    apart = np.linalg.norm(found.normals[both] - normals[both], axis=-1)
    return float(np.degrees(2 * np.arcsin(apart / 2)).mean())


@pytest.mark.parametrize("solver", [woodham1980, huber1981], ids=["least squares", "robust"])
@pytest.mark.parametrize("lights", [3, 4, 8])
def test_where_the_plane_is_the_surface_normals_and_albedo_are_exact(lights: int, solver: ModuleType) -> None:
    rig = ring_rig(lights, 1.5)
    tilted = Rig(lights=rig.lights, focal_px=rig.focal_px, principal_px=rig.principal_px, plane=(0.1, -0.2, 1.0, FAR_M))
    toward = np.array([0.1, -0.2, 1.0])
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    points = rays(u, v) * (-FAR_M / (rays(u, v) @ toward))[..., None]
    normals = np.broadcast_to(toward / np.linalg.norm(toward), points.shape)
    found = solver.solve(filmed(tilted, points, normals), lit_by(tilted))
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
    assert mean_error_deg(woodham1980.solve(plates, distant), normals) > distant_deg
    assert mean_error_deg(woodham1980.solve(plates, near), normals) < near_deg
    for share in (0.9, 1.1):
        off = lit_by(ring_rig(3, widths, plane_m=share * FAR_M))
        assert mean_error_deg(woodham1980.solve(plates, off), normals) < off_deg


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
            lambda lit: woodham1980.solve(plates, lit, mask=inside),
        )
        return mean_error_deg(found, normals, inside)

    with_plane = error_deg(0)
    assert with_plane > 0.5
    assert error_deg(1) < 0.12 * with_plane
    monkeypatch.setattr(near_surface, "ROUGH_PX", 32)  # large pictures are integrated on rough pixels
    assert error_deg(1) < 0.2 * with_plane


def room(u: Array, v: Array) -> Array:
    """A relief before a wall that leans."""
    return np.where(np.abs(u - MIDDLE) < 0.25 * SIZE, relief(u, v), 1.5 * FAR_M + 0.3 * (v - MIDDLE) / SIZE)


def test_an_outline_is_drawn_by_the_light_of_single_pixels() -> None:
    points, normals = surface(room)
    rig = ring_rig(8, 2)
    rng = np.random.default_rng(4)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    found = ps.solve_images(np.stack(plates), rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    from_edge = np.abs(np.abs(np.arange(SIZE) - MIDDLE) - 0.25 * SIZE)
    beside = np.broadcast_to((from_edge > 1) & (from_edge < 0.12 * SIZE), (SIZE, SIZE))
    assert np.mean(apart[beside] > 5) < 0.01, "a third, where distances are those of squares of pixels"


def test_noise_turns_normals_by_the_light_that_their_place_gets() -> None:
    rig = ring_rig(8, 2)
    depth_m = np.full((SIZE, SIZE), FAR_M, np.float32)
    depth_m[:, : SIZE // 4] = 1.6 * FAR_M
    ground = ground_of(rig, height_px=SIZE, width_px=SIZE).with_depth(depth_m)
    found = near_spread(illumination(rig.lights, channels=1, ground=ground), (SIZE, SIZE))
    rng = np.random.default_rng(6)

    def turned(row: int, col: int) -> float:
        """The typical angle that noise makes of a normal that faces the camera, tried a thousand times."""
        point = depth_m[row, col] * rays(np.array(float(col)), np.array(float(row)))
        shown = [filmed(rig, point[None], np.array([axis]), 1.0) for axis in (*np.eye(3), *-np.eye(3))]
        vectors = np.array([[float(plate[0]) for plate in plates] for plates in shown])
        lamps = (vectors[:3] - vectors[3:]).T  # what each axis is lit by from either side
        noisy = lamps[:, 2] + rng.normal(0, 1e-4, (1000, len(lamps)))
        g = noisy @ np.linalg.pinv(lamps).T
        return float(np.sqrt(np.mean((g[:, 0] ** 2 + g[:, 1] ** 2) / g[:, 2] ** 2)))

    middle, wall = (SIZE // 2, SIZE // 2), (SIZE // 2, SIZE // 10)
    predicted = np.sqrt(found.wider[wall]) / found.dim[wall] / (np.sqrt(found.wider[middle]) / found.dim[middle])
    assert predicted > 2
    assert predicted == pytest.approx(turned(*wall) / turned(*middle), rel=0.1)


@pytest.mark.parametrize("noise", [0.001, 0.003, 0.006])
def test_what_is_far_and_dim_is_in_doubt_and_never_a_confident_wrong_answer(noise: float) -> None:
    """At the most noise nothing says how far the wall is, and normals are off by nine degrees."""
    points, normals = surface(room)
    rig = ring_rig(8, 2)
    rng = np.random.default_rng(5)
    plates = [plate + rng.normal(0, noise, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    found = ps.solve_images(np.stack(plates), rig)
    wall = np.broadcast_to(np.abs(np.arange(SIZE) - MIDDLE) > 0.32 * SIZE, (SIZE, SIZE))
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    assert found.error_deg is not None
    assert np.mean(apart[wall] < found.error_deg[wall]) > 0.68
    assert np.mean(apart[found.valid] > 10) < 0.03


def test_a_distance_may_be_off_by_how_far_others_lie_that_explain_the_light_too() -> None:
    logs, shape = np.log(RATIOS)[:, None, None], (6, 8)
    wall = np.broadcast_to(np.arange(shape[1]) < shape[1] // 2, shape)
    far, reached = float(np.log(2.2)), np.ones(shape, np.bool_)
    found, nothing_told = np.where(wall, far, 0.0), np.zeros((len(RATIOS), *shape))
    either = doubted(nothing_told, 5, found, reached)
    np.testing.assert_allclose(either, np.sqrt(0.5) * far, rtol=0.25)  # half of the picture is where this is not
    assert doubted(nothing_told, 5, np.zeros(shape), reached).max() < 0.4 * either.min()
    told = (
        16 * (logs - far) ** 2 * np.ones(shape)
    )  # by a standard error of a twentieth, were five points of five lights
    doubt = doubted(told, 5, found, reached)
    np.testing.assert_allclose(doubt[wall], 0.05, rtol=0.3)
    np.testing.assert_allclose(
        doubt[~wall], far, rtol=0.05, err_msg="what was taken is wrong, however sure the light is"
    )


def test_a_wall_behind_the_subject_is_found_by_how_light_falls_off() -> None:
    points, normals = surface(room)
    rig = ring_rig(8, 2)
    rng = np.random.default_rng(4)
    plates = [plate + rng.normal(0, 0.0003, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    cols = np.arange(SIZE)
    wall = np.broadcast_to(np.abs(cols - MIDDLE) > 0.32 * SIZE, (SIZE, SIZE))
    subject = np.broadcast_to(np.abs(cols - MIDDLE) < 0.2 * SIZE, (SIZE, SIZE))
    found = ps.solve_images(np.stack(plates), rig)
    apart = np.degrees(np.linalg.norm(found.normals - normals, axis=-1))
    assert np.median(apart[wall]) < 1, "on the plane they would be off by more than ten degrees"
    assert np.median(apart[subject]) < 0.3
    near = near_surface.near_surface_of(rig, rig.lights, height_px=SIZE, width_px=SIZE)
    assert near is not None
    depth_m = swept(near, rig.lights, plates).ground.depth_m
    assert np.median(np.abs(depth_m / -points[..., 2] - 1)[wall]) < 0.04
    few = replace(rig, lights=rig.lights[:4])
    assert swept(near, few.lights, plates[:4]) is near, "four lights do not tell distance from normal"


def test_one_clipped_channel_says_nothing_of_how_light_falls_off() -> None:
    """A red wall on the plane whose red clips before each lamp, where its channels' mean is half of saturation."""
    ways = [(0.5 * np.cos(a), 0.5 * np.sin(a), 0.05) for a in np.arange(6) * np.pi / 3]
    lights = tuple(Light(name=f"L{n}", position_m=at, intensity=(1.5,)) for n, at in enumerate(ways))
    rig = Rig(lights=lights, focal_px=(80.0, 80.0), principal_px=(39.5, 29.5), plane=(0.0, 0.0, 1.0, 1.0))
    x, y = np.meshgrid((np.arange(80) - 39.5) / 80, (29.5 - np.arange(60)) / 80)
    points, normal = np.stack([x, y, -np.ones_like(x)], axis=-1), np.array([0.0, 0.0, 1.0])
    grey = np.stack(filmed(rig, points, normal, albedo=1.0))
    red = np.minimum(grey[..., None] * np.array([0.9, 0.3, 0.2], np.float32), 1)
    assert (red[..., 0] == 1).mean() > 0.25
    assert red.mean(axis=-1).max() < 0.6
    found = ps.solve_images(red, rig)
    assert np.degrees(np.linalg.norm(found.normals - normal, axis=-1)).max() < 0.1
    assert found.valid.mean() > 0.7


def test_distant_lights_may_stand_among_near_ones_and_a_far_light_is_a_distant_one() -> None:
    points, normals = surface(relief)
    near = ring_rig(4, 2)
    mixed = Rig(
        lights=(*near.lights, Light(name="sun", direction=(0.3, 0.5, np.sqrt(1 - 0.34)), intensity=(0.8,))),
        focal_px=near.focal_px, principal_px=near.principal_px, plane=near.plane,
    )  # fmt: skip
    assert mean_error_deg(woodham1980.solve(filmed(mixed, points, normals), lit_by(mixed)), normals) < 0.2
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
    one, other = woodham1980.solve(plates, lit_by(far)), woodham1980.solve(plates, distant)
    assert np.abs(one.normals - other.normals).max() < 0.02
    assert (one.valid == other.valid).all()


def led_rig(folder: Path) -> Rig:
    """The real rig of eight LEDs in our axes (it has x right, y down, z forward, mm), its surface 0.75 m away."""
    lights: Any = loadmat(folder / "light.mat")  # type: ignore[no-untyped-call]
    ours = np.array([1.0, -1.0, -1.0])
    strengths = 0.06 * lights["Phi"] / lights["Phi"].mean()
    return Rig(
        lights=tuple(
            Light(
                name=f"led{n}",
                position_m=tuple(1e-3 * lights["S"][n] * ours),
                axis=tuple(lights["Dir"][n] * ours / np.linalg.norm(lights["Dir"][n])),
                anisotropy=float(lights["mu"][n, 0]),
                intensity=tuple(strengths[n]),
            )
            for n in range(8)
        ),
        focal_px=(FOCAL_PX, FOCAL_PX),
        principal_px=(MIDDLE, MIDDLE),
        plane=(0.0, 0.0, 1.0, FAR_M),
    )


def test_a_real_rig_of_leds_with_axes_and_unequal_strengths(shared_data: Path) -> None:
    rig = led_rig(shared_data / "led_rig_near_light")
    shift = FAR_M - 0.75  # the same waves, nearer: what is seen is then half as wide
    points, normals = surface(lambda u, v: relief(u, v) - shift)
    rig = Rig(lights=rig.lights, focal_px=rig.focal_px, principal_px=rig.principal_px, plane=(0.0, 0.0, 1.0, 0.75))
    plates, near = filmed(rig, points, normals), lit_by(rig, channels=3)
    assert max(plate.max() for plate in plates) < 1
    distant = Illumination(directions=near.directions, intensities=near.intensities)
    before = mean_error_deg(woodham1980.solve(plates, distant), normals)
    for solver in (woodham1980, huber1981):
        assert mean_error_deg(solver.solve(plates, near), normals) < min(0.6, 0.1 * before)


@pytest.mark.parametrize("mu", [0.5, 1.0, 2.5])
def test_an_led_without_an_axis_shines_at_the_surface_s_middle(mu: float) -> None:
    points, normals = surface(relief)
    bare = ring_rig(4, 2)
    near = lit_by(bare).near
    assert near is not None
    middle = near.ground.middle_m
    aimed, unaimed = [], []
    for light in bare.lights:
        axis = middle - np.array(light.position_m)
        common: dict[str, Any] = {
            "name": light.name,
            "position_m": light.position_m,
            "intensity": light.intensity,
            "anisotropy": mu,
        }
        aimed.append(Light(**common, axis=tuple(axis / np.linalg.norm(axis))))
        unaimed.append(Light(**common))
    view: dict[str, Any] = {"focal_px": bare.focal_px, "principal_px": bare.principal_px, "plane": bare.plane}
    found = woodham1980.solve(
        filmed(Rig(lights=tuple(aimed), **view), points, normals), lit_by(Rig(lights=tuple(unaimed), **view))
    )
    assert mean_error_deg(found, normals) < 0.25


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"plane": None}, r"\[surface\] plane = "),
        ({"focal_px": None}, r"\[camera\] focal_px = "),
        ({"principal_px": None}, r"principal_px = \[47.5, 47.5\]"),
        ({"plane": (0.0, 0.0, 1.0, 1600.0)}, "looks like millimetres"),
        ({"plane": (0.0, 0.0, 1.0, -1.6)}, "lies nowhere before the camera"),
    ],
)
def test_a_rig_that_does_not_say_where_the_surface_is_is_refused_with_what_to_add(
    change: dict[str, Any], words: str
) -> None:
    rig = ring_rig(3, 2)
    known: dict[str, Any] = {"focal_px": rig.focal_px, "principal_px": rig.principal_px, "plane": rig.plane} | change
    with pytest.raises(PsvideoError, match=words):
        ground_of(Rig(lights=rig.lights, **known), height_px=SIZE, width_px=SIZE)


@pytest.mark.parametrize(
    ("position_m", "words"),
    [
        ((-200.0, 150.0, 100.0), "looks like millimetres"),
        ((0.0, 0.0, -FAR_M), "in the surface itself"),
        ((0.3, 0.0, -2 * FAR_M), "behind the surface"),
    ],
)
def test_a_light_that_cannot_stand_where_it_is_said_to_is_refused(
    position_m: tuple[float, float, float], words: str
) -> None:
    rig = ring_rig(3, 2)
    wrong = (*rig.lights[:2], Light(name="odd", position_m=position_m))
    with pytest.raises(PsvideoError, match=f"'odd'.*{words}"):
        illumination(wrong, channels=1, ground=ground_of(rig, height_px=SIZE, width_px=SIZE))


SCENE = """schema = "psvideo-scene/1"
name = "near"
frames = {frames}
seed = 3
[camera]
width_px = 200
height_px = 150
fps = 100
shutter_deg = 360.0
readout_s = 0.01
view = "perspective"
focal_px = 300.0
[strobe]
flash_s = 0.001
{lights}
[[object]]
mesh = "sphere"
height_m = 0.3
position_m = [0.02, 0.0, -0.85]
albedo = 0.8
"""


def test_a_clip_lit_by_a_real_rig_of_leds_becomes_normals(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lights = ""
    for light in led_rig(shared_data / "led_rig_near_light").lights:
        numbers = {name: [float(x) for x in getattr(light, name)] for name in ("position_m", "axis", "intensity")}
        lights += f'[[light]]\nname = "{light.name}"\nanisotropy = {light.anisotropy}\n'
        lights += "".join(f"{name} = {values}\n" for name, values in numbers.items())
    (tmp_path / "scene.toml").write_text(SCENE.format(frames=26, lights=lights))
    clip, out = tmp_path / "clip", tmp_path / "out"
    assert main(["synth", str(tmp_path / "scene.toml"), "-o", str(clip), "-q"]) == 0
    command = ["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(out)]
    whole = (clip / "rig.toml").read_text()
    (clip / "rig.toml").write_text(re.sub(r"\[surface\]\n.*\n", "", whole))
    assert main(command) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"psvideo: {clip / 'rig.toml'}: Light ")
    assert "[surface] plane" in said
    (clip / "rig.toml").write_text(whole)
    assert main(command) == 0, "what synth writes is what normals reads"
    assert "The lights are near" in (out / "report.json").read_text()
    found, valid = picture(next((out / "normals").iterdir())), picture(next((out / "valid").iterdir())) > 0
    true, inside = picture(clip / "truth" / "normals.exr"), picture(clip / "truth" / "mask.exr") > 0.5
    assert (valid & inside).sum() > 0.7 * inside.sum()
    apart = np.linalg.norm(found - true, axis=-1)[valid & inside]
    assert np.degrees(2 * np.arcsin(np.minimum(apart / 2, 1))).mean() < 0.6


def test_a_virtual_crew_measures_how_far_the_subject_is_where_lights_are_near(tmp_path: Path) -> None:
    """Its ball of 0.3 m at 0.85 m: the nearest point is 0.7 m away, the rim 0.85."""
    near = '[[light]]\nname = "a"\nposition_m = [0.3, 0.0, 0.0]\n'
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(frames=2, lights=near))
    ps.shoot(scene, tmp_path / "clip")
    plane = ps.read_rig(tmp_path / "clip" / "rig.toml").plane
    assert plane is not None
    assert plane[:3] == (0.0, 0.0, 1.0)
    assert 0.72 < plane[3] < 0.78
    scene.write_text(SCENE.format(frames=2, lights=near.replace("position_m", "direction").replace("0.0]", "1.0]")))
    ps.shoot(scene, tmp_path / "distant")
    assert ps.read_rig(tmp_path / "distant" / "rig.toml").plane is None
    flat = SCENE.replace('view = "perspective"\nfocal_px = 300.0', "width_m = 0.6")
    scene.write_text(flat.format(frames=2, lights=near))
    assert "view = 'perspective'" in ps.shoot(scene, tmp_path / "flat").warnings[0]


def picture(path: Path) -> NDArray[np.float32]:
    channels = OpenEXR.File(str(path)).channels()
    planes = channels["RGB"].pixels if "RGB" in channels else next(iter(channels.values())).pixels
    values: NDArray[np.float32] = planes.astype(np.float32)
    return values


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


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_distances_do_not_hang_on_the_unit_of_the_lamps_strengths(scale: float) -> None:
    """Calibration on a mirror gives every lamp a strength of 1, whatever it sends."""
    ways = [(2 * np.cos(a), 2 * np.sin(a), 0.3) for a in np.linspace(0, 2 * np.pi, 6, endpoint=False)]
    plane = (0.0, 0.0, 1.0, 1.5)
    lights = tuple(Light(name=f"l{n}", position_m=at, intensity=(scale,)) for n, at in enumerate(ways))
    rig = Rig(lights=lights, focal_px=(60.0, 60.0), principal_px=(15.5, 11.5), plane=plane)
    ground = ground_of(rig, height_px=24, width_px=32)
    x, y = (np.arange(32) - 15.5) / 60, (11.5 - np.arange(24)) / 60
    points = 2.2 * np.stack([*np.meshgrid(x, y), -np.ones((24, 32))], axis=-1)  # a wall 2.2 m away
    seen = []
    for at in ways:
        towards = np.array(at) - points
        away = np.linalg.norm(towards, axis=-1)
        seen.append(towards[..., 2] / away**3)
    light = np.stack(seen, axis=-1)
    light *= 0.5 / light.max()
    costs = falloff_costs(ground, lights, light, ground.depth_m.astype(np.float64), RATIOS,
                          at=np.ones((24, 32), np.bool_), step=1, noise=1e-3)  # fmt: skip
    best = RATIOS[np.argmin(costs.mean(axis=1))]
    assert best == pytest.approx(2.2 / 1.5, rel=0.05)
    assert costs.mean(axis=1).max() > 10 * costs.mean(axis=1).min(), "other distances do not explain it"


def test_the_error_of_a_far_wall_does_not_hang_on_what_stands_in_the_middle_of_the_picture() -> None:
    """What lights and lenses are off by is a share of the light that a place gets: as shares of albedo, whose unit is
    the middle's light, residuals of a dim wall claimed what they would of a bright one."""
    rig, far = ring_rig(6, 2), np.full((SIZE, SIZE), 1.8 * FAR_M, np.float32)
    before = far.copy()
    before[SIZE // 3 : -SIZE // 3, SIZE // 3 : -SIZE // 3] = 0.7 * FAR_M
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    noise = PlateNoise(read=1e-8, photon=0.0)

    def claimed_deg(depth_m: NDArray[np.float32]) -> float:
        points = far.astype(float)[..., None] * rays(u, v)
        plates = filmed(rig, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
        ground = ground_of(rig, height_px=SIZE, width_px=SIZE).with_depth(depth_m)
        found = huber1981.solve(plates, illumination(rig.lights, channels=1, ground=ground), plate_noise=noise)
        assert found.error_deg is not None
        return float(np.median(found.error_deg[: SIZE // 4]))

    assert claimed_deg(before) == pytest.approx(claimed_deg(far), rel=0.02)


@pytest.mark.parametrize(("noise", "least", "most"), [(0.0003, 0.0, 0.1), (0.003, 0.3, 0.7)])
def test_a_distance_that_nobody_knows_is_not_laid_upon_a_matte_surface(noise: float, least: float, most: float) -> None:
    points, normals = surface(room)
    rig, rng = ring_rig(8, 2), np.random.default_rng(5)
    plates = [plate + rng.normal(0, noise, plate.shape).astype(np.float32) for plate in filmed(rig, points, normals)]
    found = ps.solve_images(np.stack(plates), rig).misfit
    assert found is not None
    assert least < found.distance_share + 1e-6 < most
    assert found.error_deg < 1


def test_what_is_typical_is_that_of_places_whose_distance_is_known() -> None:
    whole, none = np.ones((8, 10), np.float32), np.zeros((8, 10), np.float32)
    normals = np.broadcast_to(np.array([0, 0, 1], np.float32), (8, 10, 3))
    one = Surface(normals=normals, albedo=whole, valid=whole > 0)
    points = ThinSurface(step=1, surface=one, noise_deg=none, fit_deg=none, fit_of_noise_deg=none)
    doubt_deg, errors_deg = none.copy(), whole.copy()
    doubt_deg[:, :4], errors_deg[:, :4] = 6, 20

    def found(limit_deg: float) -> Misfit:
        near, how = NearSpread(dim=whole, wider=whole, doubt_deg=doubt_deg), Judging(most_error_deg=limit_deg)
        return typical(Misfit(share=0.01, error_deg=9.0), points, errors_deg, none, near, how)

    assert (found(5).error_deg, found(5).distance_share) == pytest.approx((1.0, 0.4))
    assert (found(7).error_deg, found(7).distance_share) == pytest.approx((0.4 * 20 + 0.6, 0.0))


def test_where_a_shadow_ends_says_little_of_the_distance_around_it() -> None:
    """Half of a light's own light is explained by no distance, and drowned what the points beside it say."""
    rig = ring_rig(6, 2)
    v, u = np.mgrid[:SIZE, :SIZE].astype(float)
    points = np.full((SIZE, SIZE, 1), 1.3 * FAR_M) * rays(u, v)
    light = np.stack(filmed(rig, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape)), axis=-1).astype(np.float64)
    light[:, SIZE // 2, 0] /= 2
    ground = ground_of(rig, height_px=SIZE, width_px=SIZE)
    costs, _ = swept_costs(ground, rig.lights, light, ground.depth_m.astype(np.float64), 1, noise=1e-4)
    beside, away = (costs[:, SIZE // 4, col].min() for col in (SIZE // 2 + 1, SIZE // 4))
    assert beside < away + 0.1


@pytest.mark.parametrize("focal", ["[0, 0]", "[0.0, 500.0]", "[500.0, -500.0]"])
def test_a_focal_length_that_is_none_is_refused(focal: str, tmp_path: Path) -> None:
    """Of 0 it was divided by, and a negative one turns the picture over."""
    path = tmp_path / "rig.toml"
    light = '[[light]]\nname = "a"\nposition_m = [0.1, 0.0, 0.0]\n'
    view = f"[camera]\nfocal_px = {focal}\nprincipal_px = [9.5, 9.5]\n"
    path.write_text(f'schema = "psvideo-rig/1"\n{light}{view}')
    with pytest.raises(PsvideoError, match=r"rig\.toml: key 'camera\.focal_px\[\d\]' is .*: expected greater than 0"):
        ps.read_rig(path)
