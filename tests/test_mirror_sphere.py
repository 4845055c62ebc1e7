"""Lights measured on mirror spheres: real photographs against published directions, virtual ones against the truth."""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from bench.mirror_scene import Ball, Lamp, Lens, photograph, unit
from numpy.typing import NDArray
from picture_file import read_picture

from psvideo.calibrate.light_pictures import LightPictures, light_pictures, mean_of_sets
from psvideo.calibrate.mirror.highlights import FoundHighlight, find_highlights
from psvideo.calibrate.mirror.lights import calibrate_lights, check_enough
from psvideo.calibrate.mirror.measured import MirrorCalibration
from psvideo.calibrate.mirror.sighting import Sighting, SphereNotFoundError, sight_spheres
from psvideo.calibrate.sphere.outline import find_outlines, given_outline
from psvideo.calibrate.sphere.sphere_view import Looking, SphereView
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.rig_toml import parse_rig, read_rig
from psvideo.runs.calibrate.mirror_sphere import mirror_sphere
from psvideo.runs.photographs.light_sets import open_light_sets
from psvideo.runs.steps.caller import Caller

DIRECTIONS = {"key": (0.3, 0.4, 0.87), "left": (-0.5, 0.2, 0.84), "low": (0.1, -0.4, 0.9), "rim": (0.7, 0.3, 0.4)}
DISTANT = {name: Lamp(direction=vector) for name, vector in DIRECTIONS.items()}
NEAR = {"a": (0.4, 0.3, 0.1), "b": (-0.5, 0.1, 0.0), "c": (0.1, -0.4, 0.2)}
OFF = Lamp(direction=(0.0, 0.0, 1.0), strength=0.0)
PSBOX_CIRCLE = (535.9, 478.0, 421.13)
WIDE = Lens(width=480, height=300, focal=600.0)


def shoot(lens: Lens, balls: list[Ball], lamps: Mapping[str, Lamp], *, noise: float = 0.003) -> LightPictures:
    return light_pictures(
        list(lamps), [photograph(lens, balls, [lamp], noise=noise, seed=n) for n, lamp in enumerate(lamps.values())]
    )


def angle_deg(one: object, other: object) -> float:
    return float(np.degrees(np.arccos(np.clip(unit(np.asarray(one)) @ unit(np.asarray(other)), -1, 1))))


def ball_at(off_axis_deg: float, *, radius_m: float = 0.05) -> Ball:
    return Ball(centre=(0.45 * np.tan(np.radians(off_axis_deg)), 0.0, -0.45), radius_m=radius_m)


@cache
def calibrated(off_axis_deg: float, noise: float, focal: float | None) -> MirrorCalibration:
    pictures = shoot(WIDE, [ball_at(off_axis_deg)], DISTANT, noise=noise)
    return calibrate_lights(sight_spheres([pictures], Looking(focal_px=focal), where="ball"))


@pytest.mark.parametrize(("off_axis_deg", "noise"), [(0.0, 0.0), (10.0, 0.0), (10.0, 0.003)])
def test_with_the_focal_length_a_sphere_off_the_axis_shows_directions(off_axis_deg: float, noise: float) -> None:
    found = calibrated(off_axis_deg, noise, WIDE.focal)
    outline = found.sightings[0].outline
    x = WIDE.middle[0] + WIDE.focal * np.tan(np.radians(off_axis_deg))
    assert outline.place[:2] == pytest.approx([x, WIDE.middle[1]], abs=0.1), "the ray to the centre"
    assert outline.coverage > 0.9
    errors = {light.name: angle_deg(light.direction, DIRECTIONS[light.name]) for light in found.lights}
    assert np.mean(list(errors.values())) < 0.2
    assert all(errors[light.name] < light.error_deg for light in found.lights)


def test_without_it_the_bias_is_as_large_as_the_angle_off_the_axis_and_is_said() -> None:
    found = calibrated(10.0, 0.0, None)
    errors = [angle_deg(light.direction, DIRECTIONS[light.name]) for light in found.lights]
    assert 5 < np.mean(errors) < 12
    assert any("orthographic" in warning and "off the axis" in warning for warning in found.warnings)
    assert not any("orthographic" in warning for warning in calibrated(10.0, 0.0, WIDE.focal).warnings)


def test_two_spheres_show_where_near_lights_are() -> None:
    lens = Lens(width=480, height=220, focal=800.0)
    balls = [Ball(centre=(-0.12, 0.0, -0.6), radius_m=0.04), Ball(centre=(0.1, 0.01, -0.55), radius_m=0.04)]
    pictures = shoot(lens, balls, {name: Lamp(position=place) for name, place in NEAR.items()})
    sightings = sight_spheres([pictures], Looking(focal_px=lens.focal, spheres=2), where="two")
    found = calibrate_lights(sightings, radius_m=0.04)
    for light in found.lights:
        assert light.position_m is not None
        miss_m = np.linalg.norm(light.position_m - NEAR[light.name])
        assert miss_m < 0.02
        assert miss_m < light.position_error_m < 0.12
    rig = found.rig
    assert rig.focal_px == (lens.focal, lens.focal)
    assert all(light.position_m and light.direction is None for light in rig.lights)
    with pytest.raises(PsvideoError, match="the light is near"):
        calibrate_lights(sightings)


def test_crops_of_several_sizes_place_no_light_and_say_why() -> None:
    """A crop has its middle elsewhere than the lens's axis: what rests on it is placed wrongly."""
    lens = Lens(width=480, height=220, focal=800.0)
    looking = Looking(focal_px=lens.focal)
    near = {name: Lamp(position=place) for name, place in NEAR.items()}

    def sighted(lamps: Mapping[str, Lamp], crop: slice) -> list[Sighting]:
        found = []
        for place, part in (((-0.12, 0.0, -0.6), slice(None)), ((0.1, 0.01, -0.55), crop)):
            grey = shoot(lens, [Ball(centre=place, radius_m=0.04)], lamps).grey
            pictures = light_pictures(list(lamps), [picture[:, part] for picture in grey])
            found += sight_spheres([pictures], looking, where="ball")
        return found

    whole = calibrate_lights(sighted(near, slice(None)), radius_m=0.04)
    assert all(light.position_m is not None for light in whole.lights)
    assert not any("cropped" in warning for warning in whole.warnings)
    with pytest.raises(PsvideoError, match="give pictures that are not cropped for its position"):
        calibrate_lights(sighted(near, slice(40, None)), radius_m=0.04)
    distant = calibrate_lights(sighted(DISTANT, slice(10, None)), radius_m=0.04)
    said = " ".join(distant.warnings)
    assert "the pictures of the spheres are 480 x 220 and 470 x 220 pixels, so they were cropped" in said
    assert "`radius_mm`" not in said, "it was given"


def test_what_an_unknown_lens_costs_is_reckoned_by_the_pictures_width_wherever_its_axis_is() -> None:
    said = []
    pictures = shoot(WIDE, [ball_at(0.0)], DISTANT)
    for middle in (WIDE.middle[0], WIDE.middle[0] - 100.0):
        looking = Looking(principal_px=(middle, WIDE.middle[1]))
        found = calibrate_lights(sight_spheres([pictures], looking, where="ball"))
        said.append(next(warning for warning in found.warnings if "orthographic" in warning))
    off_deg = np.degrees(np.arctan(100 / (WIDE.width / 2 / np.tan(np.radians(12.5)))))
    assert f"{off_deg:.1f} degrees with a lens of 25" in said[1]
    assert "0.0 degrees with a lens of 25" in said[0]


def test_a_second_reflection_is_found_by_its_strength_or_the_light_is_left_out() -> None:
    def with_second(strength: float) -> MirrorCalibration:
        lens, second = Lens(width=300, height=300, focal=900.0), Lamp(direction=(-0.6, -0.3, 0.7), strength=strength)
        images = [
            photograph(lens, [ball_at(0)], [lamp, *([second] if name == "key" else [])])
            for name, lamp in DISTANT.items()
        ]
        pictures = light_pictures(list(DISTANT), images)
        return calibrate_lights(sight_spheres([pictures], Looking(focal_px=lens.focal), where="ball"))

    weak = with_second(0.6)
    assert angle_deg(weak.lights[0].direction, DIRECTIONS["key"]) < 0.5
    alike = with_second(3.0)
    assert "several bright spots" in alike.lights[0].fault
    assert [light.name for light in alike.rig.lights] == ["left", "low", "rim"]
    assert any("'key'" in warning for warning in alike.warnings)


def test_a_light_that_is_off_is_named_and_the_others_are_measured() -> None:
    pictures = shoot(
        Lens(width=300, height=300), [ball_at(0)], {**DISTANT, "key": Lamp(direction=(0, 0, 1), strength=0)}
    )
    found = calibrate_lights(sight_spheres([pictures], Looking(), where="ball"))
    assert "no highlight" in found.lights[0].fault
    assert len(found.rig.lights) == 3


@pytest.mark.parametrize(("odd", "is_sure"), [((), True), ((0,), True), ((2,), True), ((4,), True), ((0, 2, 4), False)])
def test_a_reflection_in_one_set_of_several_leaves_no_light_out(odd: tuple[int, ...], is_sure: bool) -> None:
    """A second spot nearly as bright makes a light doubtful where most of the sets show it."""
    y, x = np.mgrid[:180, :240]
    rng = np.random.default_rng(0)

    def picture(*spots: tuple[int, int]) -> NDArray[np.float32]:
        shown = np.where(np.hypot(x - 120, y - 90) < 60, 0.02, 0.10) + rng.normal(0, 0.002, (180, 240))
        for strength, (across, down) in zip((0.9, 0.72), spots, strict=False):
            shown += strength * np.exp(-((x - across) ** 2 + (y - down) ** 2) / 2 / 1.6**2)
        return np.clip(shown, 0, 1).astype(np.float32)

    first, *others = (135, 85), (105, 80), (120, 110)
    sets = [
        light_pictures("abc", [picture(first, *[(140, 110)] * (n in odd)), *map(picture, others)]) for n in range(5)
    ]
    looking = Looking(circles=((120.0, 90.0, 60.0),), focal_px=400.0)
    found = calibrate_lights(sight_spheres(sets, looking, where="ball"))
    assert [not light.fault for light in found.lights] == [is_sure, True, True]
    assert is_sure or "several bright spots could be its highlight" in found.lights[0].fault


def test_pictures_in_which_the_ball_is_saturated_say_so_and_spoil_no_others() -> None:
    pictures = shoot(Lens(width=200, height=200, focal=600.0), [ball_at(0)], DISTANT)
    images = [np.ones_like(pictures.images[0]), *pictures.images[1:]]
    looking = Looking(focal_px=600.0, circles=((99.5, 99.5, 600 * np.tan(np.arcsin(0.05 / 0.45))),))
    found = calibrate_lights(sight_spheres([light_pictures(pictures.names, images)], looking, where="ball"))
    assert "100% of the sphere is saturated in all channels" in found.lights[0].fault
    assert all(angle_deg(light.direction, DIRECTIONS[light.name]) < 1 for light in found.lights[1:])
    with pytest.raises(PsvideoError, match="saturated in all channels"):
        calibrate_lights(sight_spheres([light_pictures("ab", [images[0], images[0]])], looking, where="ball"))


def test_lights_in_one_plane_are_warned_of() -> None:
    flat = {name: Lamp(direction=(x, 0.0, np.sqrt(1 - x * x))) for name, x in (("a", -0.5), ("b", 0.1), ("c", 0.6))}
    pictures = shoot(Lens(width=300, height=300), [ball_at(0)], flat)
    found = calibrate_lights(sight_spheres([pictures], Looking(focal_px=900.0), where="ball"))
    assert any("one plane" in warning for warning in found.warnings)


def test_no_sphere_or_half_a_sphere_is_refused() -> None:
    noise = np.random.default_rng(0).normal(0.1, 0.01, (3, 50, 75)).astype(np.float32)
    with pytest.raises(SphereNotFoundError, match="no sphere found"):
        sight_spheres([light_pictures("abc", list(noise))], Looking(), where="wall")
    cut = shoot(Lens(width=200, height=200, focal=600.0), [Ball(centre=(-0.085, 0.0, -0.5))], DISTANT)
    with pytest.raises(SphereNotFoundError, match=r"cut by the frame|no sphere found"):
        sight_spheres([cut], Looking(), where="cut")
    with pytest.raises(SphereNotFoundError, match="cut by the frame"):
        sight_spheres([cut], Looking(circles=((0.0, 100.0, 60.0),)), where="cut")


def test_a_matte_sphere_is_refused_with_what_to_do() -> None:
    rows, cols = np.mgrid[:240, :240]
    across, up = (cols - 119.5) / 90, -(rows - 119.5) / 90
    inside = across**2 + up**2 < 1
    normals = np.stack([across, up, np.sqrt(np.maximum(1 - across**2 - up**2, 0))])
    images = []
    for vector in DIRECTIONS.values():
        shade = np.maximum(np.tensordot(unit(np.array(vector)), normals, 1), 0)
        images.append(np.where(inside, 0.6 * shade, 0.02).astype(np.float32))
    sightings = sight_spheres([light_pictures(list(DIRECTIONS), images)], Looking(), where="ball")
    with pytest.raises(PsvideoError, match="matte-sphere"):
        calibrate_lights(sightings)


@pytest.mark.parametrize(("lights", "lit", "refused"), [(4, 2, True), (4, 3, False), (3, 1, True), (2, 1, False)])
@pytest.mark.campaign
def test_a_sphere_on_which_few_of_the_lights_show_gives_no_rig(lights: int, lit: int, refused: bool) -> None:
    lamps = {name: lamp if n < lit else OFF for n, (name, lamp) in enumerate(list(DISTANT.items())[:lights])}
    sightings = sight_spheres([shoot(Lens(width=300, height=300), [ball_at(0)], lamps)], Looking(), where="ball")
    found = calibrate_lights(sightings)
    assert len(found.rig.lights) == lit
    if not refused:
        check_enough(found)
        return
    with pytest.raises(PsvideoError, match=rf"only {lit} of {lights} lights .*no highlight.*matte-sphere"):
        check_enough(found)


def test_the_command_writes_no_rig_of_one_light_of_three_and_a_picture_of_what_was_looked_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = tmp_path / "stills", tmp_path / "rig.toml"
    folder.mkdir()
    for n, (name, lamp) in enumerate(list(DISTANT.items())[:3]):
        lit = [] if n else [lamp]
        picture = photograph(Lens(width=300, height=300), [ball_at(0)], lit or [OFF], noise=0.002, seed=n)
        cv2.imwrite(str(folder / f"{name}.png"), np.round(picture * 65535).astype(np.uint16))
    assert (
        main(["calibrate", "mirror-sphere", str(folder), "-o", str(out), "--focal-mm", "54", "--sensor-mm", "18"]) == 1
    )
    assert "only 1 of 3 lights" in capsys.readouterr().err
    assert [path.suffix for path in tmp_path.iterdir() if path.is_file()] == [".png"]


@pytest.fixture(scope="module")
def psbox(shared_data: Path) -> Path:
    return shared_data / "psbox_sphere" / "LightProbe-1"


@pytest.fixture(scope="module")
def psbox_measured(psbox: Path, tmp_path_factory: pytest.TempPathFactory) -> MirrorCalibration:
    return mirror_sphere([psbox], out=tmp_path_factory.mktemp("psbox") / "rig.toml")


def _psbox_errors(psbox: Path, found: MirrorCalibration) -> tuple[np.ndarray, np.ndarray]:
    truth = np.loadtxt(psbox / "light_directions.txt").T
    lights = found.rig.lights
    errors = [angle_deg(light.direction, vector) for light, vector in zip(lights, truth, strict=True)]
    return np.array(errors), np.array([light.error_deg for light in lights])


def test_the_psbox_sphere_shows_its_lights_in_its_hand_made_circle_which_is_believed(
    psbox: Path, tmp_path: Path
) -> None:
    said: list[str] = []
    out = tmp_path / "rig.toml"
    found = mirror_sphere([psbox], out=out, circle=[PSBOX_CIRCLE], caller=Caller(warn=said.append))
    assert not [one for one in said if "`circle`" in one]
    errors, own = _psbox_errors(psbox, found)
    assert (errors < 0.5).all()
    assert np.sqrt((errors**2).mean()) < np.sqrt((own**2).mean())
    assert (errors < 2 * own).all()


@pytest.mark.campaign
def test_the_psbox_outline_is_the_same_under_room_light_and_leds_and_its_errors_are_owned(
    psbox: Path, psbox_measured: MirrorCalibration
) -> None:
    errors, own = _psbox_errors(psbox, psbox_measured)
    assert errors.mean() < 0.5
    assert (errors < 2.5 * own).all()
    opened = open_light_sets(psbox)
    pictures, under_leds = mean_of_sets(opened.sets), psbox_measured.sightings[0].outline
    view = SphereView(focal_px=None, principal_px=(549.5, 499.5))
    assert opened.room is not None
    room = replace(pictures, names=("room",), images=opened.room[None], seen=pictures.seen[:1])
    under_room_light = find_outlines(replace(room, saturated=room.images >= 1), view)[0]
    away = (under_leds.place - under_room_light.place)[:3]
    own = np.sqrt(np.diag(under_leds.covariance + under_room_light.covariance)[:3])
    assert np.abs(away).max() < 1.5
    assert (np.abs(away) < 2.5 * own).all()


def test_the_psbox_outline_lies_where_the_ball_ends_before_white_paper(
    psbox: Path, psbox_measured: MirrorCalibration
) -> None:
    """A dark ball before bright paper: half-way between their brightness is just inside its rim."""
    room, view = open_light_sets(psbox).room, SphereView(focal_px=None, principal_px=(549.5, 499.5))
    assert room is not None
    picture, outline = room.mean(axis=2), psbox_measured.sightings[0].outline
    supplied = given_outline(view, PSBOX_CIRCLE)
    inside = {}
    for name, one in (("found", outline), ("supplied", supplied)):
        away = []
        for x, y in view.curve(one.place, 360)[125:235:5]:
            outward = np.array([x, y]) - one.place[:2]
            outward /= np.linalg.norm(outward)
            steps = np.arange(-12, 12, 0.25)
            cols, rows = (np.array([x, y])[:, None] + outward[:, None] * steps).astype(np.float32)
            values = cv2.remap(picture, cols[None], rows[None], cv2.INTER_LINEAR)[0]
            middle = (values[:8].mean() + values[-8:].mean()) / 2
            away.append(float(np.interp(middle, values[20:-20], steps[20:-20])))
        inside[name] = -np.median(away)
    assert 0 < inside["found"] < 1.5
    assert inside["supplied"] < -1.0, "the supplied circle lies inside the dark ball"


@pytest.mark.parametrize("wrong", [(0, 44, 0), (0, 0, -40)])
@pytest.mark.campaign
def test_a_circle_that_the_picture_contradicts_is_named_and_costs_its_error(
    psbox: Path, tmp_path: Path, wrong: tuple[float, float, float]
) -> None:
    """The psbox picture is 1000 rows high: 44 pixels lower is where a circle counted from the bottom would lie."""
    said: list[str] = []
    x, y, radius = (one + off for one, off in zip(PSBOX_CIRCLE, wrong, strict=True))
    out = tmp_path / "rig.toml"
    found = mirror_sphere([psbox], out=out, circle=[(x, y, radius)], caller=Caller(warn=said.append))
    errors, own = _errors_of_named(psbox, found)
    assert any(f"the `circle` {x:.0f},{y:.0f},{radius:.0f} lies" in one for one in said)
    assert errors.mean() > 1.5
    assert (errors < 2.5 * own).all()


@pytest.mark.campaign
def test_a_circle_within_the_ball_is_named_and_gives_no_rig(psbox: Path, tmp_path: Path) -> None:
    """Its claims were of 90 degrees and more."""
    x, y, radius = PSBOX_CIRCLE
    out = tmp_path / "rig.toml"
    with pytest.raises(PsvideoError, match=r"the `circle` 666,608,291 lies 183 pixels from the outline that the pict"):
        mirror_sphere([psbox], out=out, circle=[(x + 130, y + 130, radius - 130)])
    assert not out.exists()


def _errors_of_named(psbox: Path, found: MirrorCalibration) -> tuple[np.ndarray, np.ndarray]:
    truth = np.loadtxt(psbox / "light_directions.txt").T
    pairs = [(light, vector) for light, vector in zip(found.lights, truth, strict=True) if not light.fault]
    errors = [angle_deg(light.direction, vector) for light, vector in pairs]
    return np.array(errors), np.array([light.error_deg for light, _ in pairs])


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["frog/LightProbe-1", "hippo/LightProbe-2", "cat/LightProbe-2"])
def test_circles_of_large_photographs_are_believed_too(name: str, shared_data: Path, tmp_path: Path) -> None:
    """The authors' own circles, counted from the bottom left, from 1."""
    said: list[str] = []
    folder = shared_data / "harvard_ps" / name
    x, y, radius = np.loadtxt(folder / "circle_data.txt")
    high = read_picture(folder / "ref.JPG").shape[0]
    mirror_sphere(
        [folder], out=tmp_path / "a.toml", circle=[(x - 1, high - y, radius)], caller=Caller(warn=said.append)
    )
    assert not [one for one in said if "`circle`" in one]


def test_a_ball_beside_the_circle_is_named_unless_it_has_a_circle_of_its_own() -> None:
    """Two balls, one of them lost in its background: that is what circles are for."""
    lens = Lens(width=500, height=260, focal=900.0)
    pictures = shoot(lens, [Ball(centre=(-0.06, 0.0, -0.5))], DISTANT)
    seen, lost = (141.5, 129.5, 90.0), (400.0, 129.5, 60.0)
    alone = sight_spheres([pictures], Looking(focal_px=900.0, circles=(lost,)), where="ball")
    assert "no round outline shows at the `circle` 399,130,59, but one at 142,130,90" in alone[0].doubt
    both = sight_spheres([pictures], Looking(focal_px=900.0, circles=(lost, seen)), where="ball")
    assert [one.doubt for one in both] == ["", ""]


@pytest.mark.parametrize(
    "circle",
    [(161.0, 130.0, 90.0), pytest.param((221.0, 130.0, 90.0), marks=pytest.mark.campaign), (141.0, 130.0, 30.0)],
)
def test_a_circle_that_is_far_off_the_ball_gives_no_rig(circle: tuple[float, float, float]) -> None:
    """Lights were 25 to 150 degrees off, and the rig claimed up to 500 degrees."""
    lens = Lens(width=500, height=260, focal=900.0)
    pictures = shoot(lens, [Ball(centre=(-0.06, 0.0, -0.5))], DISTANT)
    looking = Looking(focal_px=900.0, circles=(circle,))
    with pytest.raises(
        PsvideoError, match=r"no light could be measured on the sphere \(the `circle` .* lies .* pixels"
    ):
        calibrate_lights(sight_spheres([pictures], looking, where="ball"))


def test_the_chrome_sphere_of_washington_shows_its_lights(shared_data: Path, tmp_path: Path) -> None:
    out = tmp_path / "rig.toml"
    assert main(["calibrate", "mirror-sphere", str(shared_data / "uw_psm" / "chrome"), "-o", str(out), "-q"]) == 0
    assert read_picture(out.with_suffix(".png")).shape[1] == 1200
    truth = np.loadtxt(shared_data / "uw_psm" / "lights.txt", skiprows=1)
    lights = read_rig(out).lights
    errors = np.array([angle_deg(light.direction, vector) for light, vector in zip(lights, truth, strict=True)])
    assert errors.mean() <= 3.0
    assert np.median(errors) < 2.2


def test_the_command_writes_rig_and_picture_and_speaks_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, out = tmp_path / "stills", tmp_path / "rig.toml"
    folder.mkdir()
    for n, (name, lamp) in enumerate(DISTANT.items()):
        picture = photograph(Lens(width=300, height=300), [ball_at(0)], [lamp], noise=0.002, seed=n)
        cv2.imwrite(str(folder / f"{name}.png"), np.round(picture * 65535).astype(np.uint16))
    words = ["calibrate", "mirror-sphere", str(folder), "-o", str(out)]
    assert main([*words, "--focal-mm", "54", "--sensor-mm", "18", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {light["name"] for light in found["lights"]} == set(DIRECTIONS)
    assert found["spheres"][0]["radius_px"] == pytest.approx(900 * np.tan(np.arcsin(0.05 / 0.45)), abs=0.2)
    for light in read_rig(out).lights:
        assert angle_deg(light.direction, DIRECTIONS[light.name]) < 0.3
    assert out.with_suffix(".png").is_file()
    assert main(words) == 2, "neither file is replaced without --force"
    for bad, expected in (
        (["--circle", "1,2"], "x,y,radius"),
        (["--focal-mm", "50"], "go together"),
        (["--radius-mm", "0.05"], "millimetres"),
        (["--radius-mm", "small"], "1.5in"),
    ):
        assert main([*words, "--force", *bad]) == 2
        assert expected in capsys.readouterr().err


def test_where_no_sphere_is_found_a_picture_shows_where_it_was_looked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b", "c"):
        cv2.imwrite(str(tmp_path / f"{name}.png"), np.full((100, 140, 3), 30, np.uint8))
    assert main(["calibrate", "mirror-sphere", str(tmp_path), "-o", str(tmp_path / "out" / "rig.toml")]) == 1
    assert "rig.png" in capsys.readouterr().err
    assert (tmp_path / "out" / "rig.png").is_file()
    assert not (tmp_path / "out" / "rig.toml").exists()


def test_positions_in_millimetres_are_refused() -> None:
    text = 'schema = "psvideo-rig/1"\n[[light]]\nname = "a"\nposition_m = [-400.0, 100.0, 50.0]\n'
    with pytest.raises(PsvideoError, match="millimetres"):
        parse_rig(text)


def spots(*, patches: dict[int, float]) -> list[FoundHighlight]:
    """Return what is found on a ball under four lamps, some of which light a patch of the room (brightness) as well."""
    images = np.full((4, 200, 200), 0.001, np.float32)
    for light, (x, y) in enumerate(((80, 90), (110, 85), (90, 120), (120, 115))):
        images[light, y - 1 : y + 2, x - 1 : x + 2] = 0.7
        images[light, 45:60, 75:125] += patches.get(light, 0.0)
    outline = given_outline(SphereView(focal_px=900.0, principal_px=(99.5, 99.5)), (100.0, 100.0, 80.0))
    return find_highlights(light_pictures(list("abcd"), list(images)), outline)


def test_a_lamp_is_its_small_bright_spot_and_not_the_wall_that_it_lights() -> None:
    found = spots(patches={0: 0.3})
    assert [one.fault for one in found] == [""] * 4
    assert found[0].highlight is not None
    assert np.abs(found[0].highlight.place - [80, 90]).max() < 0.2


def test_a_wall_that_outshines_a_lamps_highlight_is_none() -> None:
    assert "far wider" in spots(patches={0: 6.0})[0].fault
    two = spots(patches={0: 6.0, 1: 5.0})
    assert all("something that both lights light" in one.fault for one in two[:2])
    assert all(one.highlight is not None for one in two[2:])
