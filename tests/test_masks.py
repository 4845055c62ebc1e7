"""Where to solve, as a sequence of masks; and takes that show nothing, or less than the plan says."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest
import tifffile
from angles import angles_deg
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageOps

import psvideo as ps
from psvideo.clip.decode.decoders import decode
from psvideo.clip.maps.mask_sequence import open_masks

SIZE, NOISE = 64, 0.002
DIRECTIONS = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [-0.6, 0.0, 0.8], [0.0, 0.6, 0.8], [0.0, -0.6, 0.8]]
Picture = NDArray[np.float64]


def ball(right_px: int) -> Picture:
    """Return the normals of a ball (row, col, 3), moved to the right; z is 0 beside it."""
    y, x = np.mgrid[:SIZE, :SIZE]
    x, y = (x - SIZE / 2 + 0.5 - right_px) / 26, (SIZE / 2 - 0.5 - y) / 26
    return np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)


def plates(*, right_px: int = 0) -> list[Picture]:
    """Return one round of a matte ball's plates, moved to the right."""
    normals = ball(right_px)
    lit = [np.where(normals[..., 2] > 0, 0.5 * np.maximum(normals @ np.array(one), 0), 0) for one in DIRECTIONS]
    return [plate + noise() for plate in lit]


def noise(seed: int = 1) -> Picture:
    return np.random.default_rng(seed).normal(0.004, NOISE, (SIZE, SIZE))


def take(folder: Path, frames: Sequence[Picture], *, rig: Sequence[Sequence[float]] = DIRECTIONS) -> Path:
    """Write frames as a synced clip of five lights with its rig."""
    folder.mkdir()
    for number, frame in enumerate(frames):
        codes = np.clip(frame * 60000 + 5000, 0, 65535).astype(np.uint16)
        cv2.imwrite(str(folder / f"take.{number:04d}.png"), codes)
    flashes = "".join(f"[[strobe.flash]]\nlights = {{ L{k} = 1.0 }}\n" for k in range(len(DIRECTIONS)))
    camera = f"width_px = {SIZE}\nheight_px = {SIZE}\nfps = 24\ntransfer = 'linear'\nblack_level = 5000\n"
    (folder / "plan.toml").write_text(
        f"schema = 'psvideo-plan/1'\n[camera]\n{camera}[strobe]\nmode = 'synced'\n{flashes}"
    )
    lights = "".join(f"[[light]]\nname = 'L{k}'\ndirection = {list(one)}\n" for k, one in enumerate(rig))
    (folder / "rig.toml").write_text(f"schema = 'psvideo-rig/1'\n{lights}")
    return folder


def solved(clip: Path, out: Path, **more: object) -> ps.PsvideoError | dict[str, list[dict[str, str]]]:
    try:
        ps.normals(clip, rig=clip / "rig.toml", out=out, align="none", **more)  # type: ignore[arg-type]
    except ps.PsvideoError as fault:
        return fault
    report: dict[str, list[dict[str, str]]] = json.loads((out / "report.json").read_text())
    return report


def written(out: Path, name: str) -> list[NDArray[np.float32]]:
    return [decode("exr", file).codes.astype(np.float32) for file in sorted((out / name).glob("*.exr"))]


def masks(folder: Path, numbers: Sequence[int], *, size: int = SIZE, white: slice = slice(8, 40)) -> Path:
    folder.mkdir()
    for number in numbers:
        image = np.zeros((size, size), np.uint8)
        image[:, white.start + number % 10 : white.stop + number % 10] = 255
        cv2.imwrite(str(folder / f"mask.{number:04d}.png"), image)
    return folder


@pytest.mark.parametrize("named", ["", "mask.####.png", "mask.%04d.png"])
def test_every_result_has_its_own_mask(tmp_path: Path, named: str) -> None:
    clip = take(tmp_path / "take", plates() + plates(right_px=2) + plates())
    folder = masks(tmp_path / "masks", [1001, 1002, 1003])
    assert not isinstance(solved(clip, tmp_path / "out", mask=folder / named), ps.PsvideoError)
    for number, normals in zip((1001, 1002, 1003), written(tmp_path / "out", "normals"), strict=True):
        mask = ps.read_mask(folder / f"mask.{number}.png")
        assert normals[mask].any(axis=-1).all()
        assert not normals[~mask].any()


def test_a_mask_sequence_that_does_not_fit_is_refused_before_anything_is_solved(tmp_path: Path) -> None:
    clip = take(tmp_path / "take", plates() + plates())
    cases = {
        "the masks have a hole: after number 1001, 2 of them are missing": masks(tmp_path / "a", [1001, 1004]),
        "has no mask for result 1002; its files are numbered 1001 to 1001": masks(tmp_path / "b", [1001]),
        "the mask is 32 x 32 pixels, and the frames are 64 x 64": masks(tmp_path / "c", [1001, 1002], size=32),
        "black everywhere": masks(tmp_path / "d", [1001, 1002], white=slice(0, 0)),
        "no file is named like this": tmp_path / "d" / "matte.####.png",
        "there is no such folder of masks": tmp_path / "none" / "mask.####.png",
    }
    for said, path in cases.items():
        fault = solved(clip, tmp_path / "out", mask=path)
        assert isinstance(fault, ps.PsvideoError)
        assert said in str(fault)
        assert "\n" not in str(fault)
        assert not (tmp_path / "out").exists()


def test_masks_of_a_sequence_may_be_black_where_the_subject_has_left(tmp_path: Path) -> None:
    """They were refused; where most are, no light is called dead and nothing untrusted for it."""
    clip, matte = take(tmp_path / "take", plates() * 3), masks(tmp_path / "matte", [1001, 1002, 1003])
    for number in (1001, 1003):
        cv2.imwrite(str(matte / f"mask.{number}.png"), np.zeros((SIZE, SIZE), np.uint8))
    report = solved(clip, tmp_path / "out", mask=matte, aov=["depth", "alpha", "error"], mesh=["ply"])
    assert not isinstance(report, ps.PsvideoError)
    for name in ("normals", "albedo", "depth", "alpha", "valid"):
        assert [bool(one.any()) for one in written(tmp_path / "out", name)] == [False, True, False]
    assert [one["valid_share"] is None for one in report["instants"]] == [True, False, True]
    assert judged(report, "lights").startswith("good")
    assert judged(report, "validity").startswith("good")


def test_only_the_results_of_the_frames_that_are_used_need_a_mask(tmp_path: Path) -> None:
    clip = take(tmp_path / "take", plates() * 3)
    one = masks(tmp_path / "one", [1001])
    assert "has no mask for result 1002" in str(solved(clip, tmp_path / "out", mask=one))
    ps.sync(clip, out=tmp_path / "timing.json")
    report = solved(clip, tmp_path / "out", mask=one, frames="0-4", timing=tmp_path / "timing.json")
    assert not isinstance(report, ps.PsvideoError)
    assert len(report["instants"]) == 1


def test_a_mask_of_0_and_1_is_called_black_with_what_white_is(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.png"), np.ones((8, 8), np.uint8))
    with pytest.raises(ps.PsvideoError, match=r"black everywhere \(its brightest pixel is 1, and white is 255\)"):
        ps.read_mask(tmp_path / "a.png")


def test_two_masks_of_one_number_are_refused(tmp_path: Path) -> None:
    folder = masks(tmp_path / "a", [1, 2])
    shutil.copyfile(folder / "mask.0001.png", folder / "mask.1.png")
    with pytest.raises(ps.PsvideoError, match=r"mask.0001.png and mask.1.png have one number. Expected one mask"):
        open_masks(folder / "mask.####.png", width_px=SIZE, height_px=SIZE)


def test_a_mask_s_width_and_height_are_held_each_by_itself(tmp_path: Path) -> None:
    mask = masks(tmp_path / "a", [1]) / "mask.0001.png"
    rows, cols = ps.read_mask(mask).shape
    assert ps.read_mask(mask, width_px=cols).shape == ps.read_mask(mask, height_px=rows).shape == (rows, cols)
    with pytest.raises(ps.PsvideoError, match=f"is {cols} x {rows} pixels, and the frames are {cols + 1} x {rows}"):
        ps.read_mask(mask, width_px=cols + 1)


def test_a_mask_sequence_is_known_by_all_its_pictures(tmp_path: Path) -> None:
    size = {"width_px": SIZE, "height_px": SIZE}
    one = open_masks(masks(tmp_path / "a", [1001, 1002]), **size)
    other = open_masks(masks(tmp_path / "b", [1001, 1003 - 1], white=slice(9, 40)), **size)
    assert one.sha256 != other.sha256


def judged(report: object, subject: str) -> str:
    assert isinstance(report, dict)
    return " ".join(f"{one['grade']}: {one['found']}" for one in report["judgements"] if one["subject"] == subject)


@pytest.mark.parametrize("rounds", [2, 5])
def test_every_round_of_photographs_has_its_result_the_last_one_too(tmp_path: Path, rounds: int) -> None:
    frames = [plate for number in range(rounds) for plate in plates(right_px=2 * number)]
    solved(take(tmp_path / "take", frames), tmp_path / "out")
    results = written(tmp_path / "out", "normals")
    assert len(results) == rounds
    for number, normals in enumerate(results):
        true = ball(2 * number)
        assert angles_deg(normals, true)[true[..., 2] > 0.3].mean() < 0.5, "noise alone makes 0.32"


@pytest.mark.parametrize("first", [0, 5, 25, 35])
def test_a_take_that_is_all_noise_gives_no_normal_and_says_why(tmp_path: Path, first: int) -> None:
    clip = take(tmp_path / "take", [noise(seed) for seed in range(first, first + 5)])
    report = solved(clip, tmp_path / "out", aov=["alpha"])
    assert judged(report, "exposure").startswith("bad: ")
    assert judged(report, "validity").startswith("bad: Only 0 %")
    assert not any(
        picture.any() for name in ("normals", "albedo", "alpha") for picture in written(tmp_path / "out", name)
    )


def test_a_light_that_never_fires_is_named(tmp_path: Path) -> None:
    one = plates()
    one[2] = noise(7) - 0.004
    assert "doubtful: The light 'L2' gives no light (0.0 % of the strongest); normals come from the other 4." in judged(
        solved(take(tmp_path / "take", one), tmp_path / "out"), "lights"
    )


def test_lights_in_another_order_than_the_rig_s_do_not_fit_the_plates(tmp_path: Path) -> None:
    clip = take(tmp_path / "take", plates(), rig=DIRECTIONS[1:] + DIRECTIONS[:1])
    said = judged(solved(clip, tmp_path / "out"), "rig")
    assert "lights exchanged" in said or "does not fit the plates" in said


def test_a_subject_that_leaves_the_picture_leaves_an_empty_result_that_is_said_once(tmp_path: Path) -> None:
    clip = take(tmp_path / "take", plates() + plates() + [noise(seed) for seed in range(5)])
    said = judged(solved(clip, tmp_path / "out", aov=["alpha"]), "lights")
    assert said.startswith("doubtful: Nothing is lit in 1 of 3 rounds (1003): the subject left the picture")
    assert "failed" not in said
    assert not any(written(tmp_path / "out", name)[2].any() for name in ("normals", "albedo", "alpha"))


@pytest.mark.parametrize("ending", ["jpg", "png", "tif"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_mask_is_turned_upright_as_its_own_file_says(tmp_path: Path, ending: str, orientation: int) -> None:
    painted = np.zeros((40, 60), np.uint8)
    painted[4:20, 8:24] = 255
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    file = tmp_path / f"mask.{ending}"
    Image.fromarray(painted).save(file, exif=exif)
    Image.fromarray(painted).save(tmp_path / "reference.png", exif=exif)  # Pillow itself turns TIFFs wrongly
    upright = np.asarray(ImageOps.exif_transpose(Image.open(tmp_path / "reference.png"))) > 127
    assert np.array_equal(ps.read_mask(file), upright)
    ps.read_mask(file, width_px=upright.shape[1], height_px=upright.shape[0])


def cut_out() -> NDArray[np.bool_]:
    y, x = np.mgrid[:SIZE, :SIZE]
    return np.asarray((x - 30) ** 2 + (y - 24) ** 2 < 200)


def painted(path: Path, colour: NDArray[np.uint8], alpha: NDArray[np.bool_]) -> Path:
    planes = [*(colour[..., None] * np.ones(3, np.uint8)).transpose(2, 0, 1), np.uint8(255) * alpha]
    if path.suffix == ".exr":
        channels = {name: (plane / 255).astype(np.float16) for name, plane in zip("RGBA", planes, strict=True)}
        OpenEXR.File({"type": OpenEXR.scanlineimage}, channels).write(str(path))
    elif path.stem == "planar":
        tifffile.imwrite(
            path, np.stack(planes), photometric="rgb", planarconfig="separate", extrasamples=["unassalpha"]
        )
    else:
        Image.fromarray(np.stack(planes, axis=-1), "RGBA").save(path)
    return path


@pytest.mark.parametrize("name", ["mask.png", "mask.tif", "planar.tif", "mask.exr"])
@pytest.mark.parametrize("level", [0, 90, 255])
def test_a_mask_that_is_cut_out_is_its_alpha_channel(name: str, level: int, tmp_path: Path) -> None:
    colour = np.full((SIZE, SIZE), level, np.uint8)
    assert (ps.read_mask(painted(tmp_path / name, colour, cut_out())) == cut_out()).all()


@pytest.mark.parametrize("name", ["mask.png", "mask.tif", "planar.tif", "mask.exr"])
def test_a_mask_that_is_painted_on_an_opaque_picture_is_what_is_white(name: str, tmp_path: Path) -> None:
    path = painted(tmp_path / name, np.uint8(255) * cut_out(), np.ones((SIZE, SIZE), np.bool_))
    assert (ps.read_mask(path) == cut_out()).all()


def test_a_matte_of_an_alpha_channel_alone_is_a_mask_also_where_its_file_holds_a_part_of_the_picture(
    tmp_path: Path,
) -> None:
    part = cut_out()[10:40, 12:50].astype(np.float16)
    window = {"dataWindow": ((12, 10), (49, 39)), "displayWindow": ((0, 0), (SIZE - 1, SIZE - 1))}
    OpenEXR.File({"type": OpenEXR.scanlineimage, **window}, {"A": part}).write(str(tmp_path / "matte.exr"))
    assert (ps.read_mask(tmp_path / "matte.exr") == cut_out()).all()


def test_a_palette_with_a_transparent_colour_is_a_mask_of_what_is_not(tmp_path: Path) -> None:
    picture = Image.fromarray(np.uint8(1) * cut_out(), "P")
    picture.putpalette([255, 0, 0, 0, 0, 255])
    picture.save(tmp_path / "mask.png", transparency=0)
    assert (ps.read_mask(tmp_path / "mask.png") == cut_out()).all()
    picture.putpalette([0, 0, 0, 255, 255, 255, 9, 9, 9])
    picture.save(tmp_path / "opaque.png", transparency=2)
    assert (ps.read_mask(tmp_path / "opaque.png") == cut_out()).all()
