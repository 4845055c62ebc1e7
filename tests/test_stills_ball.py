"""Photographs whose lights a chrome ball shows, and the lens that a rig, a ball or EXIF names."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from still_pictures import LIGHTS, NAMES, SIZE, as_srgb, error_deg, listed, lit, photographs, remarks, save8, save16

import psvideo as ps
from psvideo.errors import UsageError
from psvideo.formats.rig_toml import format_rig


def test_the_lens_that_exif_names_gives_depth_its_view(tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for name, picture in zip(NAMES, lit(), strict=True):
        exif = Image.Exif()
        exif.get_ifd(0x8769)[0xA405] = 72
        save8(folder / f"{name}.jpg", as_srgb(picture), exif=exif, quality=98)
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert "The lens is assumed to be 128 pixels long, as EXIF says" in remarks(report)
    assert ps.read_rig(tmp_path / "out" / "setup" / "rig.toml").focal_px == (128.0, 128.0)
    given = ps.stills(folder, lights=tmp_path / "lights.lp", out=tmp_path / "out", focal_px=200.0, force=True)
    assert "as EXIF says" not in remarks(given)
    assert ps.read_rig(tmp_path / "out" / "setup" / "rig.toml").focal_px == (200.0, 200.0)


def chrome(folder: Path, *, middle: tuple[float, float] = (128, 118), radius: float = 80) -> Path:
    """Write pictures of a chrome ball under the lights, and one under room light, on which its outline shows."""
    folder.mkdir()
    y, x = np.mgrid[:256, :256]
    x, y = (x - middle[0]) / radius, (middle[1] - y) / radius
    inside = x**2 + y**2 < 1
    for name, light in zip(NAMES, LIGHTS, strict=True):
        half = light + np.array([0, 0, 1])
        half /= np.linalg.norm(half)
        spot = np.exp(-((x - half[0]) ** 2 + (y - half[1]) ** 2) / (2 * 0.03**2))
        save16(folder / f"{name}.png", np.clip(np.where(inside, 0.03 + spot, 0.0), 0, 1))
    save16(folder / "room.png", np.where(inside, 0.5, 0.02))
    return folder


def test_a_chrome_ball_under_the_same_lights_is_enough(tmp_path: Path) -> None:
    folder, ball_folder = photographs(tmp_path / "photos", lit()), chrome(tmp_path / "ball")
    report = ps.stills(folder, sphere=[ball_folder], out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1.5
    assert "6 of 6 lights were measured on 1 sphere, as directions" in remarks(report)
    assert "belong to lights by name" in remarks(report)


def test_photographs_of_another_size_than_the_balls_do_not_get_their_lens(tmp_path: Path) -> None:
    """The middle of a picture that was cropped around the ball is not where the axis meets the photographs."""
    folder, ball_folder = photographs(tmp_path / "photos", lit()), chrome(tmp_path / "ball")
    for file in ball_folder.iterdir():
        save16(file, np.asarray(Image.open(file), np.float64)[20:220, 30:230] / 65535)
    report = ps.stills(folder, sphere=[ball_folder], focal_px=900.0, out=tmp_path / "out")
    rig = ps.read_rig(tmp_path / "out" / "setup" / "rig.toml")
    assert (rig.focal_px, rig.principal_px) == (None, None)
    assert f"The photographs are {SIZE} x {SIZE} pixels and those of the spheres 200 x 200" in remarks(report)


def test_a_focal_length_beside_a_rig_of_another_lens_is_refused(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", lit())
    lights = tuple(
        ps.Light(name=name, direction=(float(x), float(y), float(z)))
        for name, (x, y, z) in zip(NAMES, LIGHTS, strict=True)
    )
    (tmp_path / "rig.toml").write_text(format_rig(ps.Rig(lights=lights, focal_px=(300.0, 300.0))))
    with pytest.raises(UsageError, match=r"`focal_px` is 250, and rig\.toml says that the lens is 300 pixels"):
        ps.stills(folder, lights=tmp_path / "rig.toml", focal_px=250.0, out=tmp_path / "other")
    ps.stills(folder, lights=tmp_path / "rig.toml", focal_px=300.0, out=tmp_path / "same")
    assert ps.read_rig(tmp_path / "same" / "setup" / "rig.toml").focal_px == (300.0, 300.0)


def test_chrome_balls_may_be_named_picture_by_picture_or_by_patterns(tmp_path: Path) -> None:
    folder, one = photographs(tmp_path / "photos", lit()), chrome(tmp_path / "ball")
    ps.stills(folder, sphere=sorted(one.glob("*.png")), out=tmp_path / "single")
    assert error_deg(tmp_path / "single") < 1.5
    both, two = tmp_path / "both", chrome(tmp_path / "other", middle=(140, 130))
    both.mkdir()
    for name, source in (("left", one), ("right", two)):
        for file in source.iterdir():
            (both / f"{name}_{file.name}").write_bytes(file.read_bytes())
    report = ps.stills(folder, sphere=[both / "left_*.png", both / "right_*.png"], out=tmp_path / "patterns")
    assert error_deg(tmp_path / "patterns") < 1.5
    assert "6 of 6 lights were measured on 2 spheres, as directions; `radius_mm` and the lens" in remarks(report)
    assert "belong to lights by name" in remarks(report), "called by what the star stands for"
    for file in two.iterdir():
        save16(file, np.asarray(Image.open(file), np.float64)[:250] / 65535)
    out = tmp_path / "cropped"
    said = remarks(ps.stills(folder, sphere=[one, two], radius_mm=40.0, focal_px=900.0, out=out))
    assert "the pictures of the spheres are 256 x 256 and 256 x 250 pixels, so they were cropped" in said
    with pytest.raises(ps.PsvideoError, match=r"middle_\*\.png: fits no picture"):
        ps.stills(folder, sphere=[both / "middle_*.png"], out=tmp_path / "none")


def test_a_sphere_that_the_picture_cuts_off_is_refused(tmp_path: Path) -> None:
    folder, ball_folder = photographs(tmp_path / "photos", lit()), chrome(tmp_path / "ball", middle=(215, 118))
    with pytest.raises(ps.PsvideoError) as fault:
        ps.stills(folder, sphere=[ball_folder], out=tmp_path / "out")
    assert "ball" in str(fault.value)
    assert "\n" not in str(fault.value)
    assert not (tmp_path / "out").exists()
