"""Numbers of a calibration that cannot be meant, and what beside a calibration is not believed or is repeated."""

import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from angles import angles_deg
from pictures_of_lights import sphere_pictures, ways

from psvideo.cli.app import main
from psvideo.cli.options.typed import parse_box, parse_seconds, parse_starts_s
from psvideo.errors import UsageError
from psvideo.formats.exr_files import write_exr
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.model.rig import Light, Rig
from psvideo.runs.calibrate.matte_sphere import matte_sphere
from psvideo.runs.calibrate.mirror_sphere import mirror_sphere
from psvideo.runs.calibrate.readout import readout


@pytest.fixture
def shot(tmp_path: Path) -> tuple[Path, Path]:
    """A folder of stills of a matte ball, one per light, and the rig of these lights."""
    directions = ways(4)
    for name, image in zip("abcd", sphere_pictures(directions, np.full((4, 3), 0.8)).images, strict=True):
        write_exr(tmp_path / "stills" / f"{name}.exr", {c: image[..., k] for k, c in enumerate("RGB")}, half=False)
    lights = tuple(Light(name=name, direction=(x, y, z)) for name, (x, y, z) in zip("abcd", directions, strict=True))
    (tmp_path / "known.toml").write_text(format_rig(Rig(lights=lights)))
    return tmp_path / "stills", tmp_path / "known.toml"


@pytest.mark.parametrize("out", ["rig", "rig.lp", "rig.png"])
def test_a_rig_gets_a_name_under_which_it_can_be_read(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str], out: str
) -> None:
    """A list of lights is read for what it is not, and a .png would be its own picture's name."""
    path = shot[0].with_name(out)
    assert main(["calibrate", "matte-sphere", str(shot[0]), "-o", str(path)]) == 2
    assert "expected a name that ends in .toml, such as" in capsys.readouterr().err
    assert not path.exists()


@pytest.mark.parametrize(
    ("circle", "status", "says"),
    [
        ("95.3,71.8,63", 0, "lies 3 pixels from the outline that the pictures show, 95,72,60"),
        pytest.param(
            "101,71.8,60",
            0,
            "lies 6 pixels from the outline that the pictures show, 95,72,60",
            marks=pytest.mark.campaign,
        ),
        ("110,71.8,60", 1, "lies 15 pixels from the outline that the pictures show, 95,72,60"),
    ],
)
def test_a_circle_beside_the_ball_is_named_and_not_believed(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str], circle: str, status: int, says: str
) -> None:
    rig = shot[0].with_name("rig.toml")
    assert main(["calibrate", "matte-sphere", str(shot[0]), "-o", str(rig), "--circle", circle]) == status
    said = capsys.readouterr().err
    assert says in said
    assert "no matte sphere of one colour" not in said
    if status == 0:
        known = {light.name: light.direction for light in read_rig(shot[1]).lights}
        for light in read_rig(rig).lights:
            assert light.direction is not None
            off = angles_deg(np.array(light.direction), np.array(known[light.name]))
            assert off < 3 * (light.error_deg or 0)


def test_a_calibration_that_failed_is_repeated_without_force(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    rig = shot[0].with_name("rig.toml")
    words = ["calibrate", "matte-sphere", str(shot[0]), "-o", str(rig)]
    assert main([*words, "--circle", "30,30,20"]) == 1
    assert rig.with_suffix(".png").exists(), "it shows what was tried"
    capsys.readouterr()
    assert main([*words, "--circle", "95.3,71.8,60"]) == 0
    assert main([*words, "--circle", "95.3,71.8,60"]) == 2, "a picture that belongs to a rig stays"
    before = rig.read_bytes(), rig.with_suffix(".png").read_bytes()
    capsys.readouterr()
    assert main([*words, "--circle", "30,30,20", "--force"]) == 1
    assert (rig.read_bytes(), rig.with_suffix(".png").read_bytes()) == before, "and stays where a repetition fails"
    assert f"See {rig.with_suffix('.failed.png')}." in capsys.readouterr().err
    assert rig.with_suffix(".failed.png").exists()
    rig.unlink()
    rig.with_suffix(".png").write_bytes(b"somebody's own")
    assert main(words) == 2


def test_what_is_no_white_target_gives_no_strengths(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = shot[0].with_name("rig.toml")
    assert main(["calibrate", "flat-field", str(shot[0]), "--rig", str(shot[1]), "-o", str(out)]) == 1
    assert "as where the pictures show no white target, or more than it" in capsys.readouterr().err
    assert not out.exists()


def test_rig_and_falloff_are_never_written_to_one_file(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(shot[0].with_name("rig.toml"))
    words = ["calibrate", "flat-field", str(shot[0]), "--rig", str(shot[1]), "-o", out, "--flat", out]
    assert main(words) == 2
    assert "--out and --flat both name" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["flat-field", "colours", "intensities"])
def test_a_rig_that_is_not_there_is_said_before_pictures_are_read(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a clip the flashes are sought first, which takes minutes."""
    words = ["calibrate", command, str(tmp_path / "none"), "--rig", str(tmp_path / "no.toml")]
    assert main([*words, "-o", str(tmp_path / "rig.toml")]) == 1
    assert "no.toml: there is no such file" in capsys.readouterr().err


def test_a_first_light_of_pictures_that_are_no_flashes_is_refused(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = shot[0].with_name("rig.toml")
    assert main(["calibrate", "matte-sphere", str(shot[0]), "-o", str(out), "--first-light", "a"]) == 2
    assert "--first-light a: is for strobed clips" in capsys.readouterr().err


def test_a_falloff_gets_a_name_under_which_it_is_known(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = shot[0].with_name("rig.toml")
    words = ["calibrate", "flat-field", str(shot[0]), "--rig", str(shot[1]), "-o", str(out)]
    assert main([*words, "--flat", str(out.with_name("flat.txt"))]) == 2
    assert "expected a name that ends in .toml, such as" in capsys.readouterr().err


def test_a_ball_of_next_to_no_pixels_is_refused_with_its_folder(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = shot[0].with_name("rig.toml")
    assert main(["calibrate", "matte-sphere", str(shot[0]), "-o", str(out), "--circle", "95,72,4"]) == 1
    assert re.search(rf"{re.escape(str(shot[0]))}: The sphere shows \d+ usable pixels", capsys.readouterr().err)


def test_a_ball_on_which_no_light_shows_is_drawn_as_it_was_taken_to_be(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = shot[0].with_name("rig.toml")
    assert main(["calibrate", "mirror-sphere", str(shot[0]), "-o", str(out), "--circle", "95.3,71.8,60"]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert "no light could be measured" in said
    assert "; and 1 more light)" in said
    assert said.endswith(f"See {out.with_suffix('.png')}.")
    assert out.with_suffix(".png").exists()
    assert not out.exists()


def test_colours_that_are_the_same_are_no_number_that_json_has_none_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = np.full((40, 40), 0.5, np.float32)
    for name in "ab":
        write_exr(tmp_path / "card" / f"{name}.exr", dict.fromkeys("RGB", card), half=False)
    lights = tuple(Light(name=name, direction=at) for name, at in (("a", (0.6, 0.0, 0.8)), ("b", (-0.6, 0.0, 0.8))))
    (tmp_path / "known.toml").write_text(format_rig(Rig(lights=lights)))
    words = ["calibrate", "colours", str(tmp_path / "card"), "--rig", str(tmp_path / "known.toml")]
    assert main([*words, "-o", str(tmp_path / "rig.toml"), "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out, parse_constant=pytest.fail)["condition"] is None
    assert "the colours of a and b are the same, and" in told.err


def test_pictures_that_a_rig_knows_nothing_of_are_named_with_the_rig(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    (shot[0] / "d.exr").rename(shot[0] / "top.exr")
    out = shot[0].with_name("rig.toml")
    assert main(["calibrate", "flat-field", str(shot[0]), "--rig", str(shot[1]), "-o", str(out)]) == 1
    assert (
        "known.toml: The rig has no light named 'top', which the plan flashes or pictures are"
        in capsys.readouterr().err
    )


def test_a_room_of_which_there_is_no_picture_is_said_to_be_taken_as_dark(
    shot: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """Its light counts as the lamps': a card that it lit to 0.15 made a lamp of 0.5 one of 0.72."""
    words = ["calibrate", "matte-sphere", str(shot[0]), "--circle", "95.3,71.8,60", "-o"]
    assert main([*words, str(shot[0].with_name("rig.toml"))]) == 0
    assert "the room is assumed dark" in capsys.readouterr().out
    black = np.zeros_like(sphere_pictures(ways(1), np.ones((1, 3))).images[0])
    write_exr(shot[0] / "ambient.exr", {c: black[..., k] for k, c in enumerate("RGB")}, half=False)
    assert main([*words, str(shot[0].with_name("again.toml"))]) == 0
    assert "the room is assumed dark" not in capsys.readouterr().out


def test_too_few_measured_lights_make_no_rig_of_a_matte_sphere(
    shot: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows, cols = np.mgrid[:150, :200]
    disc = (0.5 * ((rows - 71.8) ** 2 + (cols - 95.3) ** 2 < 60**2)).astype(np.float32)
    for name in "cd":  # pictures that no lamp shades
        write_exr(shot[0] / f"{name}.exr", dict.fromkeys("RGB", disc), half=False)
    rig = tmp_path / "rig.toml"
    assert main(["calibrate", "matte-sphere", str(shot[0]), "--circle", "95.3,71.8,60", "-o", str(rig)]) == 1
    assert "only 2 of 4 lights could be measured (c: " in capsys.readouterr().err
    assert not rig.exists()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"circle": (float("nan"), 90, 60)}, "`circle` nan: expected"),
        ({"circle": (95, 70, 1e5)}, "`circle` 95,70,100000: is larger than the picture of 200 x 150 pixels"),
        ({"circle": (300, 70, 60)}, "`circle` 300,70,60: is outside of the picture of 200 x 150 pixels"),
        ({"focal_px": float("inf")}, "`focal_px` inf: expected 1 to"),
        ({"albedo": 0.0}, "`albedo` 0: expected a share above 0"),
        ({"albedo": -0.5}, "`albedo` -0.5: expected a share above 0"),
    ],
)
def test_numbers_of_a_matte_sphere_that_cannot_be_meant_are_refused(
    options: dict[str, Any], says: str, shot: tuple[Path, Path], tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=re.escape(says)):
        matte_sphere(shot[0], out=tmp_path / "rig.toml", **options)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"principal_px": (float("nan"), 3.0), "focal_px": 500.0}, "`principal_px` nan: expected"),
        ({"focal_mm": float("inf"), "sensor_mm": 36.0}, "`focal_mm` inf: expected 0.1 to"),
        ({"focal_mm": 50.0, "sensor_mm": 0.0}, "`sensor_mm` 0: expected 0.1 to"),
        ({"circle": [(float("inf"), 1.0, 1.0)]}, "`circle` inf: expected"),
        ({"radius_mm": float("nan")}, "`radius_mm` nan"),
    ],
)
def test_numbers_of_a_mirror_sphere_that_cannot_be_meant_are_refused(
    options: dict[str, Any], says: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=re.escape(says)):
        mirror_sphere([tmp_path], out=tmp_path / "rig.toml", **options)


@pytest.mark.parametrize("number", ["led_hz", "led_tolerance_ppm", "zoom", "near_s"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 1e300])
def test_numbers_of_a_readout_that_cannot_be_meant_are_refused(number: str, value: float, tmp_path: Path) -> None:
    given: dict[str, Any] = {"led_hz": 1000.0, number: value}
    with pytest.raises(UsageError, match=re.escape(f"`{number}` {value:g}: expected")):
        readout([tmp_path], **given)


@pytest.mark.parametrize("text", ["nan,nan,nan,nan", "inf,0,9,9", "0,0,1e400,9"])
def test_a_box_of_no_numbers_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="expected left,top,right,bottom, numbers in pixels"):
        parse_box(text)


@pytest.mark.parametrize("parse", [partial(parse_seconds, option="--flash"), parse_starts_s])
def test_a_time_without_an_end_is_refused(parse: Callable[[str], object]) -> None:
    with pytest.raises(UsageError, match="1e400"):
        parse("1e400" if parse is parse_starts_s else "1e400s")
