"""Pictures of lights, from stills, folders of plates and clips: the same record, whatever they were read from."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import ExifTags, Image, PngImagePlugin

from psvideo.calibrate.light_files import find_plates, find_stills
from psvideo.calibrate.light_folder import find_light_pictures, shows_lights
from psvideo.calibrate.light_pictures import LightPictures, light_pictures, mean_of_sets
from psvideo.cli.app import main
from psvideo.clip.stills import look_at
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.whole_files import marked_png
from psvideo.runs.photographs.light_sets import open_light_sets, read_images
from psvideo.runs.photographs.opened_sets import Reading

SCENES = Path(__file__).resolve().parents[1] / "data_synth"


def still(path: Path, value: float, size: tuple[int, int] = (6, 8)) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.full(size, round(value * 65535), np.uint16))


def mean_pictures(path: Path, reading: Reading = Reading()) -> LightPictures:
    return mean_of_sets(open_light_sets(path, reading).sets)


def test_stills_are_lights_of_their_names_and_ambient_light_is_taken_off(tmp_path: Path) -> None:
    for name, value in (("L2", 0.3), ("L10", 0.5), ("key", 1.0), ("ambient", 0.1), ("room", 0.7)):
        still(tmp_path / f"{name}.png", value)
    opened = open_light_sets(tmp_path)
    found = mean_of_sets(opened.sets)
    assert found.names == ("L2", "L10", "key")
    assert found.images[:, 0, 0] == pytest.approx([0.2, 0.4, 0.9], abs=1e-4)
    assert found.saturated.all(axis=(1, 2)).tolist() == [False, False, True]
    assert opened.room is not None
    assert opened.room[0, 0] == pytest.approx(0.7, abs=1e-4)


def test_a_folder_per_light_holds_several_frames(tmp_path: Path) -> None:
    for light, values in (("a", (0.1, 0.3)), ("b", (0.5, 0.7))):
        for number, value in enumerate(values, start=1001):
            still(tmp_path / light / f"x_{light}.{number}.png", value)
    found = mean_pictures(tmp_path)
    assert found.frames == 2
    assert found.images[:, 0, 0] == pytest.approx([0.2, 0.6], abs=1e-4)
    second = mean_pictures(tmp_path, Reading(frames="2"))
    assert second.images[:, 0, 0] == pytest.approx([0.3, 0.7], abs=1e-4)


@pytest.mark.parametrize("mask", ["mask", "cat.mask", "cat_Mask"])
def test_a_mask_beside_the_pictures_is_no_light(mask: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name, value in (("L1", 0.3), ("L2", 0.5), (mask, 1.0), ("unmask", 0.4)):
        still(tmp_path / f"{name}.png", value)
    assert read_images(tmp_path).names == ("L1", "L2", "unmask")
    assert f"{mask}.png: is assumed to be no light's picture" in caplog.text


@pytest.mark.parametrize(
    ("files", "lights", "words"),
    [
        (["L1.png", "L1.tif"], [], "L1.png and L1.tif are one photograph in two kinds. Expected one picture per light"),
        (["take_key.png", "key.png"], ["key"], "two lights have the name 'key'"),
        (
            ["a1.png", "a2.png"],
            ["key", "left", "top"],
            "holds 2 pictures .a1.png to a2.png., and the plan has 3 lights",
        ),
        (["key.png", "left.png"], ["key", "left", "top"], "holds no picture of 'top'; expected one for each"),
        (["flashes.png", "b.png"], [], "'flashes' cannot be a light's name"),
        (["ambient.png", "mask.png"], [], "holds no pictures of lights. Expected still photographs"),
    ],
)
def test_pictures_that_do_not_fit_the_lights_are_named(
    files: list[str], lights: list[str], words: str, tmp_path: Path
) -> None:
    for name in files:
        still(tmp_path / name, 0.5)
    with pytest.raises(PsvideoError, match=words):
        find_stills(tmp_path, lights=lights)


def test_numbered_pictures_are_the_plan_s_lights_in_order(tmp_path: Path) -> None:
    for name in ("x2.png", "x10.png", "x1.png"):
        still(tmp_path / name, 0.5)
    found = find_stills(tmp_path, lights=("key", "left", "top"))
    assert {light: files[0].name for light, files in found.by_light.items()} == {
        "key": "x1.png",
        "left": "x2.png",
        "top": "x10.png",
    }


def test_folders_lack_a_light_of_the_plan_by_name(tmp_path: Path) -> None:
    still(tmp_path / "key" / "1.png", 0.5)
    with pytest.raises(PsvideoError, match="holds no pictures of 'left', which the plan flashes; its folders are key"):
        find_plates(tmp_path, lights=("key", "left"))


def test_noise_of_dark_pictures_is_no_other_exposure(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A chrome ball is dark but for its highlights."""
    rng = np.random.default_rng(3)
    for number in range(3):
        path = tmp_path / "key" / f"photo.{number}.png"
        still(path, 0.0)
        cv2.imwrite(str(path), rng.normal(1310, 655, (64, 64)).clip(0).astype(np.uint16))
    read_images(tmp_path)
    assert "differ" not in caplog.text


def test_folders_that_are_scenes_and_not_lights_are_said(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A folder of scenes, each with one picture per light, looks like a folder of lights with several pictures each."""
    for folder, values in (("cat", (0.5, 0.5, 0.5)), ("horse", (0.5, 0.505, 0.35))):
        for number, value in enumerate(values):
            still(tmp_path / folder / f"photo.{number}.png", value)
    read_images(tmp_path)
    assert "pictures 1 and 3 of light 'horse' differ by 35% of their light" in caplog.text
    caplog.clear()
    still(tmp_path / "horse" / "photo.2.png", 0.49)
    read_images(tmp_path)
    assert not caplog.text


def test_rows_that_no_frame_saw_do_not_count_in_the_mean() -> None:
    seen = np.ones((1, 4), np.bool_)
    seen[0, 1] = False
    half = light_pictures("a", [np.where(seen[0, :, None], 0.4, 0.0).astype(np.float32)], seen=seen)
    whole = light_pictures("a", [np.full((4, 1), 0.6, np.float32)])
    found = mean_of_sets([half, whole])
    assert found.images[0, :, 0] == pytest.approx([0.5, 0.6, 0.5, 0.5])
    assert found.seen.all()


def test_a_strobed_clip_and_its_plates_show_the_same(tmp_path: Path) -> None:
    clip, plates = tmp_path / "clip", tmp_path / "plates"
    assert main(["synth", str(SCENES / "sphere.toml"), "-o", str(clip), "-q"]) == 0
    assert main(["split", str(clip), "-o", str(plates), "-q"]) == 0
    from_clip, from_plates = mean_pictures(clip), mean_pictures(plates)
    assert from_clip.names == from_plates.names
    assert from_clip.frames == from_plates.frames > 1
    assert np.abs(from_clip.images - from_plates.images).max() < 1e-3
    with pytest.raises(UsageError, match=r"its frames are read as 'linear' as .*plan.toml says, not as `transfer` 'sr"):
        open_light_sets(clip, Reading(transfer="srgb"))
    assert open_light_sets(clip, Reading(transfer="Linear")).names == from_clip.names


def test_what_does_not_fit_is_said(tmp_path: Path) -> None:
    with pytest.raises(PsvideoError, match="is not there"):
        open_light_sets(tmp_path / "nowhere")
    with pytest.raises(PsvideoError, match="holds no pictures"):
        open_light_sets(tmp_path)
    still(tmp_path / "two" / "key.png", 0.1)
    still(tmp_path / "two" / "key.tif", 0.1)
    with pytest.raises(PsvideoError, match="are one photograph in two kinds"):
        open_light_sets(tmp_path / "two")
    still(tmp_path / "sizes" / "a.png", 0.1)
    still(tmp_path / "sizes" / "b.png", 0.1, (6, 9))
    with pytest.raises(PsvideoError, match="one camera"):
        mean_pictures(tmp_path / "sizes")


PORTRAIT = 6
"""EXIF's orientation of a camera that was held upright: the first row is the right-hand side."""


def photograph(path: Path, image: "np.ndarray[tuple[int, ...], np.dtype[np.uint8]]", orientation: int = 1) -> None:
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(image).save(path, exif=exif)


@pytest.mark.parametrize("ending", ["png", "jpg", "tif"])
def test_photographs_are_turned_upright_as_their_files_say(ending: str, tmp_path: Path) -> None:
    lying = np.zeros((40, 64, 3), np.uint8)
    lying[:20, 32:] = 250  # top right as the sensor lay: bottom right of the picture
    for name in ("key", "left", "ambient", "room"):
        photograph(tmp_path / f"{name}.{ending}", lying if name != "ambient" else lying // 5, PORTRAIT)
    opened = open_light_sets(tmp_path)
    found = mean_of_sets(opened.sets)
    assert found.images.shape == (2, 64, 40, 3)
    assert found.ambient is not None
    assert opened.room is not None
    for picture in (found.images[0], found.ambient, opened.room):
        assert picture[48, 30].min() > 0.02 > picture[16, 30].max()
        assert picture[48, 10].max() < 0.02


def test_photographs_that_lie_in_other_ways_are_not_of_one_place(tmp_path: Path) -> None:
    square = np.full((32, 32, 3), 90, np.uint8)
    photograph(tmp_path / "key.png", square)
    photograph(tmp_path / "left.png", square, PORTRAIT)
    with pytest.raises(PsvideoError, match=r"turned by 90 degrees clockwise, and .*key\.png is 32 x 32 pixels"):
        read_images(tmp_path)


@pytest.mark.parametrize("dark_says", [True, False])
def test_ambient_light_is_taken_off_as_each_picture_was_exposed(
    dark_says: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """As for the photographs that ``stills`` solves: with the dark picture as it is, directions were wrong."""
    for name, value, seconds in (("a", 0.5, 1 / 50), ("b", 0.3, 1 / 100), ("c", 0.4, 1 / 50), ("dark", 0.2, 1 / 25)):
        exif = Image.Exif()
        if name != "dark" or dark_says:
            exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.ExposureTime] = seconds
        Image.fromarray(np.full((8, 8), round(255 * value), np.uint8)).save(
            tmp_path / f"{name}.jpg", exif=exif, quality=98
        )
    found = read_images(tmp_path, transfer="linear").images[:, 4, 4]
    times = np.array([0.5, 0.25, 0.5] if dark_says else [1.0, 0.5, 1.0])
    assert found == pytest.approx(np.array([0.5, 0.3, 0.4]) - 0.2 * times, abs=0.004)
    assert "the ambient light was scaled by it before it was taken off" in caplog.text
    assert ("dark.jpg does not say how it was exposed" in caplog.text) is not dark_says


@pytest.mark.parametrize(
    ("name", "says", "curve"),
    [
        ("key.png", None, "linear"),
        ("key.jpg", None, "srgb"),
        ("key.png", 1.0, "linear"),
        ("key.png", 1 / 1.8, "gamma18"),
    ],
)
def test_photographs_are_read_by_the_curve_that_their_files_name(
    name: str, says: float | None, curve: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Where files name one, it is what ``stills`` reads them by: calibration and results see the same light."""
    chunks = PngImagePlugin.PngInfo()
    if says is not None:
        chunks.add(b"gAMA", round(says * 100000).to_bytes(4, "big"))
    for light in ("key", "left"):
        path = tmp_path / name.replace("key", light)
        picture = Image.fromarray(np.full((16, 16), 128, np.uint8))
        picture.save(path, pnginfo=chunks) if path.suffix == ".png" else picture.save(path)
    with caplog.at_level("DEBUG", logger="psvideo"):
        found = read_images(tmp_path)
    assert found.images[0, 8, 8] == pytest.approx(read_images(tmp_path, transfer=curve).images[0, 8, 8])
    if says is not None:
        assert look_at(sorted(tmp_path.iterdir())).transfer == curve
    assert f"the pictures are read as {curve!r}" in caplog.text


def test_lights_whose_names_end_alike_are_told_apart(tmp_path: Path) -> None:
    lights = ("left", "right", "top_left", "top_right")
    for name in lights:
        still(tmp_path / "exact" / f"{name}.png", 0.5)
        still(tmp_path / "with_words" / f"take3_{name}.png", 0.5)
    for folder in ("exact", "with_words"):
        found = find_stills(tmp_path / folder, lights=lights)
        assert [files[0].stem.removeprefix("take3_") for files in found.by_light.values()] == list(lights)


def test_a_light_whose_name_ends_with_dark_is_a_light(tmp_path: Path) -> None:
    for name in ("a_key", "a_after_dark", "a_dark"):
        still(tmp_path / f"{name}.png", 0.5)
    found = find_stills(tmp_path, lights=("key", "after_dark"))
    assert found.names == ("key", "after_dark")
    assert [file.name for file in found.ambient] == ["a_dark.png"]


def test_a_second_picture_of_the_dark_or_of_the_room_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name in ("L1", "L2", "a_dark", "dark", "outline", "room"):
        still(tmp_path / f"{name}.png", 0.1 if name == "dark" else 0.4)
    found = read_images(tmp_path)
    assert found.images[:, 0, 0] == pytest.approx([0.3, 0.3], abs=1e-4)
    assert "a_dark.png: is assumed to be no light's picture and left aside" in caplog.text
    assert "room.png: is assumed to be no light's picture and left aside" in caplog.text


def test_ambient_light_is_that_of_the_same_round(tmp_path: Path) -> None:
    """Of the lights, rounds count that all of them have."""
    for light, values in (("key", {1: 0.9, 2: 0.5, 3: 0.5}), ("left", {2: 0.6, 3: 0.6}), ("dark", {1: 0.4, 2: 0.2})):
        for number, value in values.items():
            still(tmp_path / light / f"x_{light}.{number:04d}.png", value)
    found = find_plates(tmp_path)
    assert found is not None
    assert [file.name for file in found.ambient] == ["x_dark.0002.png", "x_dark.0002.png"]
    assert read_images(tmp_path).images[:, 0, 0] == pytest.approx([0.3, 0.4], abs=1e-4)


def test_a_second_folder_of_the_dark_is_no_light(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name in ("key", "left", "ambient", "dark"):
        still(tmp_path / name / "1.png", 0.1 if name == "ambient" else 0.4)
    found = read_images(tmp_path)
    assert found.names == ("key", "left")
    assert "dark: is assumed to be no light's folder and left aside" in caplog.text


def test_pictures_are_the_lights_whatever_folders_lie_beside_them(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for name in ("L1", "L2", "L3", "L4", "old/first_try", "dark/1"):
        still(tmp_path / f"{name}.png", 0.5)
    assert read_images(tmp_path).names == ("L1", "L2", "L3", "L4")
    for folder in ("old", "dark"):
        assert f"{folder}: is assumed to be no light's folder and left aside" in caplog.text


def test_a_single_picture_beside_folders_is_none_of_a_set(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for name in ("key/1", "left/1", "top/1", "preview"):
        still(tmp_path / f"{name}.png", 0.5)
    assert read_images(tmp_path).names == ("key", "left", "top")
    assert "preview.png: is assumed to be no light's picture and left aside" in caplog.text


def test_folders_that_a_plan_names_go_before_pictures_beside_them(tmp_path: Path) -> None:
    for name in ("key/1", "left/1", "a", "b"):
        still(tmp_path / f"{name}.png", 0.5)
    found = find_light_pictures(tmp_path, lights=("key", "left"))
    assert found.by_light["left"] == (tmp_path / "left" / "1.png",)
    assert [path.name for path in found.left_aside] == ["a.png", "b.png"]
    with_pictures = find_light_pictures(tmp_path, lights=("a", "b"))
    assert with_pictures.by_light["b"] == (tmp_path / "b.png",)
    assert [path.name for path in with_pictures.left_aside] == ["key", "left"]


@pytest.mark.parametrize("lights", [(), ("key", "left")])
def test_a_picture_and_a_folder_of_each_light_are_refused(lights: tuple[str, ...], tmp_path: Path) -> None:
    for name in ("key/1", "left/1", "key", "left"):
        still(tmp_path / f"{name}.png", 0.5)
    with pytest.raises(PsvideoError, match="holds a picture and a folder of pictures of each of key, left"):
        find_light_pictures(tmp_path, lights=lights)


def test_a_clip_stays_one_with_a_folder_of_pictures_beside_its_frames(tmp_path: Path) -> None:
    for name in ("f.0001", "f.0002", "old/first_try"):
        still(tmp_path / f"{name}.png", 0.5)
    assert not shows_lights(tmp_path, ("key", "left"))
    assert shows_lights(tmp_path, ("old", "left"))


def test_numbers_in_names_may_be_written_in_any_way(tmp_path: Path) -> None:
    """A raised 2 is a digit and no number."""
    for name in ("L²", "L10", "L9"):
        still(tmp_path / name / "1.png", 0.5)
    assert set(read_images(tmp_path).names) == {"L²", "L10", "L9"}


def test_a_picture_that_a_calibration_drew_beside_its_rig_is_no_photograph(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        still(tmp_path / f"{name}.png", 0.3)
    (tmp_path / "rig.png").write_bytes(marked_png((tmp_path / "a.png").read_bytes()))
    assert mean_pictures(tmp_path).names == ("a", "b", "c")
