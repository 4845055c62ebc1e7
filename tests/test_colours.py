"""Flashes of several colours: separated on paper by the model's own sum, and in whole takes against the truth."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest

import psvideo as ps
from psvideo.calibrate.led_colours import measure_led_colours, with_colours
from psvideo.calibrate.light_pictures import LightPictures, light_pictures
from psvideo.calibrate.white_target import Target
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.rig_toml import format_rig, parse_rig, read_rig
from psvideo.model.irradiance.colours import WHITE, Unmixing, unmixing_of
from psvideo.model.irradiance.led_lamps import lamps_of
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig, Vector
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.plates.several_lights.unmixed import slot_names, unmixed, unmixing_note

PLACES: dict[str, Vector] = {"key": (0.6, 0.0, 0.8), "left": (-0.48, 0.36, 0.8), "top": (0.0, -0.6, 0.8)}
COLOURS: dict[str, Vector] = {"red": (1.0, 0.1, 0.02), "green": (0.15, 1.0, 0.2), "blue": (0.02, 0.18, 1.0)}
EXCHANGED = (("red", "green", "blue"), ("green", "blue", "red"), ("blue", "red", "green"))
MakePlan = Callable[..., Plan]


def rig_of(**changed: Vector) -> Rig:
    return Rig(
        lights=tuple(
            Light(name=f"{place}_{name}", direction=at, intensity=(1.1,), colour=changed.get(name, colour))
            for place, at in PLACES.items()
            for name, colour in COLOURS.items()
        )
    )


def plan_of(make_plan: MakePlan, turns: tuple[tuple[str, ...], ...]) -> Plan:
    lit = [
        PlannedFlash(
            lights={f"{place}_{colour}": 1.0 for place, colour in zip(PLACES, turn, strict=True)}, duration_s=0.0008
        )
        for turn in turns
    ]
    return replace(make_plan(dark=False), flashes=(*lit, PlannedFlash(lights={}, duration_s=0.0008)))


def scene(
    rng: np.random.Generator, rows: int = 1, cols: int = 40, spread: float = 0.2
) -> tuple[np.ndarray, np.ndarray]:
    """Return normals that face all lights, and albedos of any colour."""
    normals = np.clip(rng.normal(size=(rows, cols, 3)), -1.5, 1.5) * spread + (0, 0, 1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return normals, rng.uniform(0.02, 0.9, (rows, cols, 3))


def flashed(plan: Plan, rig: Rig, normals: np.ndarray, albedo: np.ndarray) -> Round:
    """Add up what every flash shows, light by light and channel by channel."""
    plates = []
    for slot, name in zip(plan.lit_slots, slot_names(plan), strict=True):
        image = np.zeros_like(albedo)
        for light, power in plan.flashes[slot].lights.items():
            one = rig.select([light])[0]
            shade = np.maximum(normals @ np.array(one.direction), 0)
            image += power * np.array(one.by_channel) * albedo * shade[..., None]
        plates.append(
            LightPlate(
                light=name,
                number=1001,
                time_s=0.01 * slot,
                picture=mixture_of(image.astype(np.float32)),
                seen=np.ones(len(image), np.bool_),
                saturation=10.0,
            )
        )
    return Round(number=1001, plates=tuple(plates), stood=np.ones((1, 1), np.bool_))


def taken_apart(plan: Plan, rig: Rig) -> Unmixing:
    how = unmixing_of(plan, rig, channels=3)
    assert how is not None
    return how


def test_a_rig_file_keeps_colours_of_lights_and_of_the_surface() -> None:
    rig = replace(rig_of(), surface_colour=(0.5, 0.4, 0.3))
    assert parse_rig(format_rig(rig)) == rig


def test_lights_in_one_place_are_a_lamp_named_by_what_their_names_begin_with(make_plan: MakePlan) -> None:
    assert [len(lamp) for lamp in lamps_of(rig_of().lights)] == [3, 3, 3]
    assert taken_apart(plan_of(make_plan, EXCHANGED), rig_of()).shown.lights == ("key", "left", "top")


def test_exchanged_colours_give_each_lamp_alone_on_any_surface(make_plan: MakePlan) -> None:
    plan, rig = plan_of(make_plan, EXCHANGED), rig_of()
    normals, albedo = scene(np.random.default_rng(1))
    shown = unmixed(flashed(plan, rig, normals, albedo), taken_apart(plan, rig))
    assert shown.lights == ("key", "left", "top")
    for plate in shown.plates:
        truth = albedo * (normals @ np.array(PLACES[plate.light]))[..., None]
        np.testing.assert_allclose(plate.image, truth, atol=1e-5)


def test_one_flash_gives_its_lights_where_the_surface_s_colour_is_known(make_plan: MakePlan) -> None:
    plan, rig = plan_of(make_plan, EXCHANGED[:1]), replace(rig_of(), surface_colour=(0.6, 0.3, 0.15))
    normals, _ = scene(np.random.default_rng(2))
    albedo = np.broadcast_to(np.array([0.6, 0.3, 0.15]), normals.shape)
    shown = unmixed(flashed(plan, rig, normals, albedo), taken_apart(plan, rig))
    assert shown.lights == ("key_red", "left_green", "top_blue")
    assert "of the colour that the rig's [surface] gives everywhere: a channel that is off by 10% turns" in (
        unmixing_note(taken_apart(plan, rig))
    )
    for plate in shown.plates:
        truth = albedo * (normals @ np.array(PLACES[plate.light.split("_")[0]]))[..., None]
        np.testing.assert_allclose(plate.image, truth, atol=1e-5)


def test_what_moved_between_flashes_is_had_from_one_by_the_colour_that_its_neighbourhood_shows(
    make_plan: MakePlan,
) -> None:
    """Normals that differ from flash to flash, on a surface of one colour: no flow brings them together."""
    plan, rig = plan_of(make_plan, EXCHANGED), rig_of()
    rng, how = np.random.default_rng(5), taken_apart(plan, rig)
    albedo = np.broadcast_to(np.array([0.7, 0.35, 0.2]), (40, 40, 3))
    views = [scene(rng, 40, 40, spread=0.4)[0] for _ in plan.lit_slots]
    plates = [flashed(plan, rig, view, albedo).plates[n] for n, view in enumerate(views)]
    shown_s = [np.full(40, 0.01 * n) for n in range(3)]
    moved = [replace(plate, time_s=0.02, shown_s=at) for plate, at in zip(plates, shown_s, strict=True)]
    shot = Round(number=1001, plates=tuple(moved))
    off = {}
    for stood in (False, True):
        round_of_lamps = unmixed(replace(shot, stood=np.full((1, 1), stood)), how)
        truth = [albedo * (views[-1] @ np.array(PLACES[one.light]))[..., None] for one in round_of_lamps.plates]
        images = [one.image for one in round_of_lamps.plates]
        off[stood] = np.abs(np.array(images) - truth).mean() / np.mean(truth)
    assert off[False] < 0.02 < 0.08 < off[True]


def test_a_clipped_sample_clips_what_it_counts_in(make_plan: MakePlan) -> None:
    plan, rig = plan_of(make_plan, EXCHANGED), rig_of()
    normals, albedo = scene(np.random.default_rng(3))
    shot = flashed(plan, rig, normals, albedo)
    first = shot.plates[0]
    image = first.image.copy()
    image[0, 7, 1] = first.saturation
    shot = replace(shot, plates=(replace(first, picture=mixture_of(image)), *shot.plates[1:]))
    for plate in unmixed(shot, taken_apart(plan, rig)).plates:
        assert plate.image[0, 7, 1] >= plate.saturation
        assert plate.image[0, 7, 0] < plate.saturation
        assert (np.delete(plate.image, 7, axis=1) < plate.saturation).all()


def test_colours_that_cannot_be_separated_are_refused(make_plan: MakePlan) -> None:
    orange = rig_of(green=(0.97, 0.14, 0.02))
    with pytest.raises(PsvideoError, match=r"condition number of their colours is .* key_red and left_green are most"):
        unmixing_of(plan_of(make_plan, EXCHANGED[:1]), orange, channels=3)
    with pytest.raises(PsvideoError, match=r"monochrome camera cannot tell colours apart"):
        unmixing_of(plan_of(make_plan, EXCHANGED), rig_of(), channels=1)
    plain = rig_of()
    some = replace(plain, lights=(replace(plain.lights[0], colour=None), *plain.lights[1:]))
    with pytest.raises(PsvideoError, match=r"colours to some lights, and none to key_red"):
        unmixing_of(plan_of(make_plan, EXCHANGED), some, channels=3)


def test_a_rig_without_colours_is_left_alone(make_plan: MakePlan) -> None:
    rig = rig_of()
    plain = replace(rig, lights=tuple(replace(light, colour=None) for light in rig.lights))
    assert unmixing_of(plan_of(make_plan, EXCHANGED), plain, channels=3) is None


def test_lights_that_flash_one_by_one_are_apart_whatever_their_colours(make_plan: MakePlan) -> None:
    """Taken apart all the same, they ended in a traceback where something moved."""
    one_by_one = tuple(PlannedFlash(lights={f"{place}_red": 1.0}, duration_s=0.0008) for place in PLACES)
    plan = replace(make_plan(dark=False), flashes=one_by_one)
    assert unmixing_of(plan, rig_of(red=(1.0, 0.9, 0.8)), channels=3) is None


def test_what_moves_under_flashes_that_show_not_every_lamp_is_not_had_from_one(make_plan: MakePlan) -> None:
    pairs = [("key_red", "left_green"), ("left_blue", "top_red"), ("key_green", "top_blue")]
    flashes = [PlannedFlash(lights=dict.fromkeys(pair, 1.0), duration_s=0.0008) for pair in pairs]
    pale: dict[str, Vector] = {"red": (1.0, 0.6, 0.5), "green": (0.6, 1.0, 0.6), "blue": (0.5, 0.6, 1.0)}
    plan, rig = replace(make_plan(dark=False), flashes=tuple(flashes)), rig_of(**pale)
    normals, albedo = scene(np.random.default_rng(1))
    moved = replace(flashed(plan, rig, normals, albedo), stood=np.zeros((1, 1), np.bool_))
    plates = [replace(one, seen=np.zeros(len(one.image), np.bool_)) for one in moved.plates]
    how = taken_apart(plan, rig)
    assert unmixed(replace(moved, plates=tuple(plates)), how).lights == ("key", "left", "top")


def card(rng: np.random.Generator, rig: Rig, *, exposure: float = 0.5) -> LightPictures:
    """Return pictures of a card of albedo 0.9 that faces the camera, under one light at a time."""
    images = []
    for light in rig.lights:
        seen = 0.9 * exposure * np.array(light.direction or WHITE)[2] * np.array(light.by_channel)
        images.append(np.clip(seen + rng.normal(0, 2e-3, (24, 32, 3)), 0, 1).astype(np.float32))
    return light_pictures(rig.names, images)


TARGET = Target(albedo=0.45, normal=np.array([0.0, 0.0, 1.0]), rows=slice(0, 24), cols=slice(0, 32))
"""Half the card's albedo: the pictures were exposed for half."""


def test_a_white_card_gives_colours_and_intensities_with_their_errors() -> None:
    rig = rig_of()
    bare = replace(rig, lights=tuple(replace(light, colour=None, intensity=(1.0,)) for light in rig.lights))
    found = measure_led_colours(card(np.random.default_rng(1), rig), bare, TARGET)
    for measured, light in zip(with_colours(bare, found).lights, rig.lights, strict=True):
        np.testing.assert_allclose(measured.by_channel, light.by_channel, atol=2e-3)
    assert found.error.max() < 1e-3
    assert 1.2 < found.condition < 1.6


def test_a_card_that_clips_and_colours_that_are_alike_are_refused() -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(PsvideoError, match=r"'key_red': 100% of the white target is saturated .* at most 2% may be"):
        measure_led_colours(card(rng, rig_of(), exposure=2.0), rig_of(), TARGET)
    alike = rig_of(green=(0.99, 0.12, 0.02))
    with pytest.raises(PsvideoError, match=r"condition number is .*, and (key|left|top)_red and \1_green are most"):
        measure_led_colours(card(rng, alike), alike, TARGET)
    grey = light_pictures(("key_red",), [np.full((24, 32), 0.3, np.float32)])
    with pytest.raises(PsvideoError, match=r"monochrome camera cannot tell colours apart"):
        measure_led_colours(grey, rig_of(), TARGET)


def lone_leds(*names: str) -> Rig:
    """Return LEDs of these colours, each in a place of its own."""
    turns = np.arange(len(names))
    places = np.stack([0.6 * np.cos(turns), 0.6 * np.sin(turns), np.full(len(names), 0.8)], axis=1).tolist()
    return Rig(
        lights=tuple(
            Light(name=f"L{n}", direction=(x, y, z), intensity=(1.1,), colour=COLOURS[name])
            for n, (name, (x, y, z)) in enumerate(zip(names, places, strict=True))
        )
    )


@pytest.mark.parametrize("names", [("red", "red", "green", "green", "blue", "blue"), ("red", "green", "blue", "red")])
def test_colours_of_lone_leds_are_measured_in_any_order_and_the_most_alike_are_named(names: tuple[str, ...]) -> None:
    rig = lone_leds(*names)
    found = measure_led_colours(card(np.random.default_rng(1), rig), rig, TARGET)
    one, other = found.together
    assert names[int(one[1:])] == names[int(other[1:])]
    assert not found.known
    for measured, light in zip(with_colours(rig, found).lights, rig.lights, strict=True):
        np.testing.assert_allclose(measured.by_channel, light.by_channel, atol=2e-3)


def test_a_plan_says_which_colours_must_differ(make_plan: MakePlan) -> None:
    rig = lone_leds("red", "red", "green", "green", "blue", "blue")
    pictures = card(np.random.default_rng(1), rig)

    def plan(*flashes: str) -> Plan:
        lit = [PlannedFlash(lights={f"L{n}": 1.0 for n in one}, duration_s=0.0008) for one in flashes]
        return replace(make_plan(dark=False), flashes=tuple(lit))

    found = measure_led_colours(pictures, rig, TARGET, plan=plan("024", "135"))
    assert found.known
    assert found.condition < 1.6
    with pytest.raises(PsvideoError, match="Flash 1 of the plan lights L0, L1, L2 together, and their colours cannot"):
        measure_led_colours(pictures, rig, TARGET, plan=plan("012", "345"))
    assert not measure_led_colours(pictures, rig, TARGET, plan=plan(*"012345")).known


def test_calibrate_colours_writes_a_rig_that_takes_flashes_apart(tmp_path: Path) -> None:
    rig, folder = rig_of(), tmp_path / "card"
    folder.mkdir()
    pictures = card(np.random.default_rng(1), rig)
    for name, image in zip(pictures.names, pictures.images, strict=True):
        cv2.imwrite(str(folder / f"{name}.png"), np.round(image[..., ::-1] * 65535).astype(np.uint16))
    bare = replace(rig, lights=tuple(replace(light, colour=None) for light in rig.lights))
    (tmp_path / "rig.toml").write_text(format_rig(bare))
    words = ["calibrate", "colours", str(folder), "--rig", str(tmp_path / "rig.toml"), "--albedo", "0.45"]
    assert main([*words, "-o", str(tmp_path / "measured.toml"), "-q"]) == 0
    for measured, light in zip(read_rig(tmp_path / "measured.toml").lights, rig.lights, strict=True):
        np.testing.assert_allclose(measured.by_channel, light.by_channel, atol=2e-3)


SCENE = """
schema = "psvideo-scene/1"
name = "ball"
frames = 14
seed = 3
[camera]
width_px = 80
height_px = 64
fps = 120
shutter_deg = 360.0
readout_s = 0.0081
width_m = 0.5
full_well_e = 30000.0
read_e = 3.0
[strobe]
flash = [
  { lights = { key_red = 1.0, left_green = 1.0, top_blue = 1.0 }, duration_s = 0.0008 },
  { lights = { key_green = 1.0, left_blue = 1.0, top_red = 1.0 }, duration_s = 0.0008 },
  { lights = { key_blue = 1.0, left_red = 1.0, top_green = 1.0 }, duration_s = 0.0008 },
  { lights = {}, duration_s = 0.0008 },
]
[ambient]
level = 0.02
[[object]]
mesh = "sphere"
height_m = 0.4
albedo = { pattern = "noise", colour = [0.7, 0.12, 0.1], second = [0.1, 0.3, 0.7], size_m = 0.08 }
"""


def scene_file(folder: Path) -> Path:
    """Write the scene with its nine LEDs."""
    lights = "".join(
        f'[[light]]\nname = "{place}_{name}"\ndirection = {list(at)}\nintensity = 1.0\ncolour = {list(colour)}\n'
        for place, at in PLACES.items()
        for name, colour in COLOURS.items()
    )
    path = folder / "ball.toml"
    path.write_text(SCENE + lights)
    return path


def picture(path: Path) -> np.ndarray:
    return np.asarray(next(iter(OpenEXR.File(str(path)).channels().values())).pixels, np.float32)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("colours")
    return ps.shoot(scene_file(folder), folder / "clip").path


def test_a_coloured_surface_under_exchanged_colours_gives_its_normals_and_albedo(filmed: Path, tmp_path: Path) -> None:
    report = ps.normals(filmed, rig=filmed / "rig.toml", out=tmp_path / "out", plates=True)
    normals = picture(sorted((tmp_path / "out" / "normals").iterdir())[0])
    valid = picture(sorted((tmp_path / "out" / "valid").iterdir())[0]) > 0
    albedo = picture(sorted((tmp_path / "out" / "albedo").iterdir())[0])
    cosine = (normals * picture(filmed / "truth" / "normals.exr")).sum(-1)
    assert np.degrees(np.arccos(np.clip(cosine[valid], -1, 1))).mean() < 1.5
    assert np.median(np.abs(albedo - picture(filmed / "truth" / "albedo.exr"))[valid]) < 0.01
    assert sorted(path.name for path in (tmp_path / "out" / "plates").iterdir())[-3:] == ["key", "left", "top"]
    assert len(report.lights) == 3
    assert "exchanged between flashes: plates are those of the lamps under white light" in report.trust
    assert not any("as where nobody measured it" in one.found for one in report.judgements)  # colours were measured


def test_split_takes_colours_apart_by_the_rig_and_asks_for_it(filmed: Path, tmp_path: Path) -> None:
    with pytest.raises(PsvideoError, match=r"give each its `colour` there: psvideo calibrate colours"):
        ps.split(filmed, out=tmp_path / "none")
    ps.split(filmed, rig=filmed / "rig.toml", out=tmp_path / "plates")
    assert {"key", "left", "top", "ambient"} <= {path.name for path in (tmp_path / "plates").iterdir()}
