"""Photographs that were exposed differently, and the room's light in a dark one."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import tifffile
from PIL import Image
from still_pictures import (
    LIGHTS,
    NAMES,
    SIZE,
    as_srgb,
    ball,
    error_deg,
    listed,
    lit,
    photographs,
    remarks,
    save8,
    save16,
    with_exposures,
)

import psvideo as ps
from psvideo.clip.decode.decoders import decode
from psvideo.clip.decoded import Header
from psvideo.clip.stated import Stated, relative_exposures
from psvideo.inspect.about_photographs import photograph_findings
from psvideo.model.quantities import Aov
from psvideo.runs.photographs.glance import _signals


def test_a_dark_picture_is_taken_off_and_a_mask_is_used_where_they_are_named_so(tmp_path: Path) -> None:
    normals, inside = ball()
    folder = photographs(tmp_path / "photos", lit(ambient=0.1))
    save16(folder / "ball_DARK.png", np.where(inside, 0.1, 0.0))
    cv2.imwrite(str(folder / "ball.mask.png"), (255 * (inside & (normals[..., 0] > 0))).astype(np.uint8))
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out", transfer="linear")
    assert "ball_DARK.png shows the ambient light, which was taken off" in remarks(report)
    solved = decode("exr", next((tmp_path / "out" / "normals").glob("*.exr"))).codes
    assert not solved[:, : SIZE // 2].any()
    true = normals[:, SIZE // 2 + 2 :]
    middle = true[..., 2] > 0.3
    cosine = np.clip((solved[:, SIZE // 2 + 2 :].astype(np.float64) * true).sum(axis=-1), -1, 1)
    assert np.degrees(np.arccos(cosine))[middle].mean() < 1


def test_exposures_of_exif_are_believed_where_the_pictures_agree_and_not_where_they_do_not(tmp_path: Path) -> None:
    seconds = [0.02, 0.01, 0.02, 0.02, 0.02, 0.02]
    pictures, lights = lit(), listed(tmp_path / "lights.lp")
    half = [pictures[0], pictures[1] / 2, *pictures[2:]]
    true = ps.stills(with_exposures(tmp_path / "true", half, seconds), lights=lights, out=tmp_path / "out")
    assert "shot 7.jpg by a factor 2" in remarks(true)
    assert "strengths were scaled by it" in remarks(true)
    assert error_deg(tmp_path / "out") < 1.5
    lies = ps.stills(with_exposures(tmp_path / "lies", pictures, seconds), lights=lights, out=tmp_path / "other")
    assert any("EXIF was not believed" in warning for warning in lies.warnings)
    assert error_deg(tmp_path / "other") < 1.5


def test_exposures_are_read_of_dngs_that_hold_nothing_but_raw_samples(tmp_path: Path) -> None:
    """Without a small picture before them Pillow opens no such file, and brackets were 39 degrees off."""
    folder = tmp_path / "photos"
    folder.mkdir()
    for place, (name, picture) in enumerate(zip(NAMES, lit(), strict=True)):
        filters = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, (0, 1, 1, 2), True)]
        levels = [(50714, "I", 1, 200, True), (50717, "I", 1, 15000, True)]
        taken = [(33434, "2I", 1, (1, 50 * 2**place), True), (33437, "2I", 1, (8, 1), True), (34855, "H", 1, 100, True)]
        tags = [(50706, "B", 4, (1, 4, 0, 0), True), (50708, "s", 0, "Test Camera", True), *filters, *levels, *taken]
        codes = (200 + 14800 * picture / 2**place).astype(np.uint16)
        tifffile.imwrite(folder / f"{name}.dng", codes, photometric=32803, extratags=tags)
    report = ps.stills(folder, lights=listed(tmp_path / "l.lp"), out=tmp_path / "out")
    assert "and the pictures agree: their lights' strengths were scaled" in remarks(report)
    assert error_deg(tmp_path / "out") < 1.5


@pytest.mark.parametrize(
    "seconds",
    [(2, 2, 2, 2, 2, 2, 1), (2, 1, 2, 2, 1, 2, 2), (1, 1, 2, 1, 1, 2, 4), (1, 1, 2, 1, 1, 1, 0)],
    ids=["dark other", "lights differ", "both", "dark silent"],
)
def test_the_room_s_light_is_taken_off_as_much_as_each_picture_holds(seconds: tuple[int, ...], tmp_path: Path) -> None:
    """A room a quarter as bright as the lights, brighter at the top: taken off as it is, normals are 4 degrees off."""
    room = 0.1 * np.where(ball()[1], 1.5 - np.mgrid[:SIZE, :SIZE][0] / SIZE, 0.0)
    shown = [*(light + room for light in lit()), room]
    relative = [(time_s or 1) / 2 for time_s in seconds]
    pictures = [np.clip(one * more / max(relative), 0, 1) for one, more in zip(shown, relative, strict=True)]
    folder = with_exposures(tmp_path / "photos", pictures, [time_s / 100 for time_s in seconds])
    report = ps.stills(folder, lights=listed(tmp_path / "l.lp"), out=tmp_path / "out")
    assert "and the pictures agree" in remarks(report)
    assert ("the ambient light was scaled by it" in remarks(report)) == (len({*seconds[:6]}) == 1)
    assert any("does not say how it was exposed" in one for one in report.warnings) == (seconds[-1] == 0)
    assert error_deg(tmp_path / "out") < 1.5


@pytest.mark.parametrize("tag", [0x829D, 0x8827], ids=["aperture", "ISO"])
def test_exposures_by_other_tags_are_not_compared(tmp_path: Path, tag: int) -> None:
    """One picture without FNumber among others at f/4 counted as taken at f/1, sixteen times as bright."""
    folder = tmp_path / "photos"
    folder.mkdir()
    for name, picture in zip(NAMES, lit(), strict=True):
        exif = Image.Exif()
        exif.get_ifd(0x8769)[0x829A] = 0.02
        if name != NAMES[2]:
            exif.get_ifd(0x8769)[tag] = 4
        save8(folder / f"{name}.jpg", as_srgb(picture), exif=exif, quality=98)
    report = ps.stills(folder, lights=listed(tmp_path / "l.lp"), out=tmp_path / "out")
    by = {0x829D: "aperture", 0x8827: "ISO"}[tag]
    assert f"by time and {by}, others by time alone; none is scaled" in remarks(report)
    assert not any("EXIF" in one for one in report.warnings)
    assert error_deg(tmp_path / "out") < 1.5
    assert not any("exposures differ" in one.text for one in photograph_findings(folder))


def test_a_dark_picture_with_fewer_tags_than_the_lights_is_taken_for_a_usual_one() -> None:
    lights = [Stated(exposure=time_s / 16, exposed_by=("time", "aperture")) for time_s in (0.02, 0.04, 0.02)]
    relative = relative_exposures(lights, [Stated(exposure=0.02, exposed_by=("time",))])
    assert relative is not None
    np.testing.assert_allclose(relative, [1, 2, 1, 1])


def test_codes_of_raw_files_count_from_their_black_to_their_white() -> None:
    """Levels of 600 and 16000 of 16383 tilted what a curve was judged by."""
    head = Header(width_px=4, height_px=4, channels=1, bits=14, black=((600.0, 500.0), (400.0, 300.0)), white=16000.0)
    light = np.linspace(0.1, 0.9, 16).reshape(4, 4)
    black = np.tile(np.array(head.black), (2, 2))
    rows = cols = np.arange(4)
    np.testing.assert_allclose(_signals(black + light * (16000 - black), head, rows, cols), light)
    plain = Header(width_px=4, height_px=4, channels=3, bits=8)
    np.testing.assert_allclose(_signals(np.full((4, 4, 3), 51.0), plain, rows, cols), 0.2)


def test_a_dark_picture_whose_exposure_is_misstated_is_taken_off_as_it_is(tmp_path: Path) -> None:
    room = np.where(ball()[1], 0.1, 0.0)
    folder = with_exposures(tmp_path / "photos", [*lit(ambient=0.1), room], [0.02] * 6 + [0.005])
    report = ps.stills(folder, lights=listed(tmp_path / "l.lp"), out=tmp_path / "out")
    assert any("EXIF was not believed" in warning for warning in report.warnings)
    assert error_deg(tmp_path / "out") < 1.5


@pytest.mark.parametrize("aov", [(), ("beauty",)])
def test_the_room_s_light_is_judged_whatever_is_delivered(aov: tuple[Aov, ...], tmp_path: Path) -> None:
    """The dark picture comes last, when the only round is complete."""
    normals, inside = ball()
    shades = [np.where(inside, 0.4 * np.maximum(normals @ light, 0) + 0.45, 0) for light in LIGHTS]
    folder = photographs(tmp_path / "photos", shades)
    save16(folder / "dark.png", np.where(inside, 0.45, 0))
    report = ps.stills(folder, lights=listed(tmp_path / "l.lp"), out=tmp_path / "out", transfer="linear", aov=aov)
    said = next(one for one in report.judgements if one.subject == "ambient")
    assert said.grade == "bad"
    assert "of the signal" in said.found
