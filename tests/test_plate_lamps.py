"""Near lights are as distant ones once what they send to every place is evened out: one surface explains their plates
where it explains those of distant lights."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.ground import Ground, every_ray
from psvideo.model.rig import Light
from psvideo.plates.align.plate_lamps import Lamps

SHAPE, FOCAL_PX, FAR_M = (48, 64), 80.0, 1.0
NAMES = tuple(f"l{n}" for n in range(5))


def ground(tilt: float = 0.0) -> Ground:
    """A plane a metre away, of which the picture is 0.8 m wide; tilted, it is nearer on the right."""
    x, _ = every_ray((FOCAL_PX, FOCAL_PX), (31.5, 23.5), *SHAPE)
    depth_m = np.broadcast_to(FAR_M - tilt * x, SHAPE).astype(np.float32)
    return Ground(
        depth_m=depth_m, middle_m=np.array([0, 0, -FAR_M]), focal_px=(FOCAL_PX,) * 2, principal_px=(31.5, 23.5)
    )


def near_lights(seed: int, *, apart_m: float = 0.0, cone: float = 0.0) -> list[Light]:
    """Five lights around the picture's middle in a plane that is tilted, or so far from it."""
    rng = np.random.default_rng(seed)
    around = 2 * np.pi * (np.arange(5) + rng.uniform(-0.2, 0.2, 5)) / 5
    out = rng.uniform(0.4, 0.7, 5)
    x, y = out * np.cos(around), out * np.sin(around)
    z = -0.4 + 0.2 * x - 0.1 * y + apart_m * rng.choice([-1, 1], 5)
    places = [(float(a), float(b), float(c)) for a, b, c in zip(x, y, z, strict=True)]
    axes = [
        None if not cone else tuple(np.array([-a, -b, -1 - c]) / np.linalg.norm([a, b, 1 + c])) for a, b, c in places
    ]
    return [
        Light(name=name, position_m=place, intensity=(float(rng.uniform(0.5, 2)),), axis=axis, anisotropy=cone or None)
        for name, place, axis in zip(NAMES, places, axes, strict=True)
    ]


def light_of(lights: list[Light], place_m: Doubles, normal: Doubles) -> Doubles:
    """What a place with a normal shows under each light: the law of the inverse square, its cone and the cosine."""
    shown = []
    for light in lights:
        away = np.array(light.position_m) - place_m
        far = np.linalg.norm(away)
        cone = (
            1.0 if light.axis is None else max(-(away / far) @ np.array(light.axis), 0) ** float(light.anisotropy or 0)
        )
        shown.append(float(np.mean(light.by_channel)) * cone * (away / far) @ normal / far**2)
    return np.array(shown)


def unexplained(lamps: Lamps, shown: Doubles) -> float:
    """What no normal explains of light, as a share of it."""
    left = shown - lamps.matrix @ np.linalg.lstsq(lamps.matrix, shown, rcond=None)[0]
    return float(np.linalg.norm(left) / np.linalg.norm(shown))


places = st.tuples(st.integers(0, SHAPE[0] - 1), st.integers(0, SHAPE[1] - 1))
slopes = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))


def shown_at(
    lights: list[Light], lamps: Lamps, place: tuple[int, int], slope: tuple[float, float], tilt: float
) -> Doubles:
    """What the lights show at a pixel, evened out."""
    on = ground(tilt)
    x, y = every_ray(on.focal_px, on.principal_px, *SHAPE)
    depth_m = float(on.depth_m[place])
    point_m = depth_m * np.array([x[0, place[1]], y[place[0], 0], -1])
    normal = np.array([*slope, 1]) / np.linalg.norm([*slope, 1])
    return light_of(lights, point_m, normal) * lamps.evenings(SHAPE)[:, place[0], place[1]]


@settings(deadline=None)
@given(seed=st.integers(0, 50), place=places, slope=slopes, tilt=st.floats(-0.3, 0.3), cone=st.sampled_from([0.0, 1.5]))
def test_of_near_lights_in_a_plane_one_normal_explains_every_pixel(
    seed: int, place: tuple[int, int], slope: tuple[float, float], tilt: float, cone: float
) -> None:
    lights = near_lights(seed, cone=cone)
    lamps = Lamps.of(lights, NAMES, ground(tilt))
    assert lamps is not None
    assert unexplained(lamps, shown_at(lights, lamps, place, slope, tilt)) < 0.003


@pytest.mark.parametrize("seed", range(5))
def test_of_lights_that_stand_apart_little_is_left(seed: int) -> None:
    lights = near_lights(seed, apart_m=0.05)
    lamps = Lamps.of(lights, NAMES, ground())
    assert lamps is not None
    for place in ((4, 6), (40, 20), (10, 58)):
        even = shown_at(lights, lamps, place, (0.2, -0.1), 0.0)
        uneven = even / lamps.evenings(SHAPE)[:, place[0], place[1]]
        assert unexplained(lamps, even) < min(0.04, unexplained(lamps, uneven) / 3)


def test_in_the_middle_lamps_shine_as_they_do_there_and_evening_changes_nothing() -> None:
    lights = near_lights(3, cone=1.2)
    lamps = Lamps.of(lights, NAMES, ground())
    assert lamps is not None
    normal = np.array([0.3, -0.2, np.sqrt(0.87)])
    np.testing.assert_allclose(lamps.matrix @ normal, light_of(lights, np.array([0, 0, -FAR_M]), normal), rtol=1e-6)
    np.testing.assert_allclose(lamps.evenings((480, 640))[:, 240, 320], 1, atol=5e-3)


def test_distant_lights_are_even_alone_and_beside_near_ones() -> None:
    distant = [
        Light(name=name, direction=(0.1 * n, 0.3, float(np.sqrt(0.91 - 0.01 * n * n))), intensity=(0.5,))
        for n, name in enumerate(NAMES)
    ]
    lamps = Lamps.of(distant, NAMES)
    assert lamps is not None
    assert lamps.evenings(SHAPE).tolist() == [[[1.0]]] * 5
    mixed = Lamps.of([*distant[:2], *near_lights(1)[2:]], NAMES, ground())
    assert mixed is not None
    both = mixed.evenings(SHAPE)
    assert (both[:2] == 1).all()
    assert (both[2:].max(axis=(1, 2)) > 1.5).all()
    np.testing.assert_allclose(mixed.matrix[:2], lamps.matrix[:2], rtol=1e-12)


def test_lamps_are_none_where_nobody_knows_how_they_shine_or_they_are_too_few() -> None:
    near, names = near_lights(0), list(NAMES)
    assert Lamps.of(near, names) is None, "near lights, and nothing that they shine on"
    assert Lamps.of(near, [*names[:4], "other"], ground()) is None
    assert Lamps.of(near, names[:2], ground()) is None
    three, four = (Lamps.of(near, names[:count], ground()) for count in (3, 4))
    assert three is not None
    assert four is not None
    assert (three.checked, four.checked) == (False, True)
