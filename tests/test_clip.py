"""A clip: which files are its frames, whether they fit the plan, and reading them lazily, in order, with holes."""

import dataclasses
import threading
import time
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from psvideo.clip import holes, open_clip, parse_range, read_frames, reading
from psvideo.clip.decode.decoders import decode
from psvideo.clip.decoded import CodedPicture
from psvideo.clip.folder import find_sequence
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.plan_toml import format_plan
from psvideo.model.camera import Encoding
from psvideo.model.plan import Plan
from psvideo.synth.camera.dpx_writer import dpx_bytes

ROWS, COLS = 6, 8


def write_png(file: Path, value: int = 0, *, rows: int = ROWS, cols: int = COLS, dtype: type = np.uint16) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(imagecodecs.png_encode(np.full((rows, cols, 3), value, dtype)))


@pytest.fixture
def write_plan(make_plan: Callable[..., Plan]) -> Callable[..., None]:
    def write(folder: Path, *, rows: int = ROWS, cols: int = COLS, **encoding: Any) -> None:
        plan = make_plan(width_px=cols, height_px=rows)
        camera = dataclasses.replace(plan.camera, encoding=Encoding(**encoding))
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "plan.toml").write_text(format_plan(dataclasses.replace(plan, camera=camera)))

    return write


@pytest.fixture
def shot(tmp_path: Path, write_plan: Callable[..., None]) -> Path:
    """A clip of frames 8 to 12 without 10, whose values are 100 times their numbers."""
    write_plan(tmp_path / "shot", white_level=1000)
    for number in (12, 8, 9, 11):
        write_png(tmp_path / "shot" / "frames" / f"shot.{number}.png", 100 * number)
    return tmp_path / "shot"


def test_frames_come_in_the_order_of_their_numbers_and_holes_count_as_time(shot: Path) -> None:
    clip = open_clip(shot)
    frames = list(read_frames(clip))
    assert (clip.name, clip.numbers) == ("shot", (8, 9, 11, 12))
    assert [(frame.index, frame.number) for frame in frames] == [(0, 8), (1, 9), (3, 11), (4, 12)]
    assert [float(frame.image[0, 0, 0]) for frame in frames] == pytest.approx([0.8, 0.9, 1.1, 1.2])
    assert holes(clip.numbers) == ((9, 1),)
    assert (frames[0].image.shape, frames[0].image.dtype) == ((ROWS, COLS, 3), np.dtype(np.float32))


@pytest.mark.parametrize("ahead", [1, 2, 5])
def test_chosen_frames_keep_their_place_in_time(shot: Path, ahead: int) -> None:
    frames = read_frames(open_clip(shot), [12, 9], ahead=ahead)
    assert [(frame.index, frame.number) for frame in frames] == [(1, 9), (4, 12)]


def test_frames_may_lie_beside_the_plan_and_be_numbered_in_any_width(
    tmp_path: Path, write_plan: Callable[..., None]
) -> None:
    write_plan(tmp_path)
    for name in ("a9.PNG", "a10.png", "a100.png"):
        write_png(tmp_path / name)
    assert [file.name for file in open_clip(tmp_path).files] == ["a9.PNG", "a10.png", "a100.png"]


def test_images_without_a_number_are_left_aside_and_named(shot: Path) -> None:
    write_png(shot / "frames" / "shot.mask.png")
    write_png(shot / "frames" / "._shot.13.png")
    clip = open_clip(shot)
    assert len(clip.numbers) == 4
    assert clip.notes == ("left aside, having no number at the end: shot.mask.png",)


def test_numbers_in_brackets_count_where_no_name_ends_in_a_number(
    tmp_path: Path, write_plan: Callable[..., None]
) -> None:
    """Windows numbers so what is renamed at once; browsers so the copies of a file."""
    write_plan(tmp_path)
    for name in ("shot (2).png", "shot (10).png"):
        write_png(tmp_path / name)
    assert [file.name for file in open_clip(tmp_path).files] == ["shot (2).png", "shot (10).png"]
    write_png(tmp_path / "shot.0001.png")
    assert [file.name for file in open_clip(tmp_path).files] == ["shot.0001.png"]


def touch(*names: str) -> Callable[[Path], None]:
    def put(shot: Path) -> None:
        for name in names:
            write_png(shot / name)

    return put


UNCLEAR = {
    "two kinds": (touch("frames/shot.13.exr"), r"images of two kinds, shot\.8\.png and shot\.13\.exr"),
    "two sequences": (touch("frames/other.13.png"), r"two sequences, shot\.8\.png and other\.13\.png"),
    "one number twice": (touch("frames/shot.08.png"), r"shot\.08\.png and shot\.8\.png have the same number"),
    "two places": (touch("beside.1.png"), r"in the folder \(beside\.1\.png, …\) and in its frames/"),
    "no plan": (lambda shot: (shot / "plan.toml").unlink(), r"there is no plan\.toml"),
    "no such clip": (lambda shot: shot.rename(shot.with_name("moved")), "there is no such clip"),
    "wrong curve": (
        lambda shot: (shot / "plan.toml").write_text((shot / "plan.toml").read_text().replace('"linear"', '"slog7"')),
        r"plan\.toml: transfer is 'slog7'.*did you mean",
    ),
}


@pytest.mark.parametrize("fault", UNCLEAR)
def test_a_folder_that_is_not_clear_is_refused_with_advice(shot: Path, fault: str) -> None:
    spoil, message = UNCLEAR[fault]
    spoil(shot)
    with pytest.raises(PsvideoError, match=message) as raised:
        open_clip(shot)
    assert raised.value.exit_status == 1
    assert "\n" not in str(raised.value)


def test_the_files_of_a_long_take_are_found_in_time_that_grows_with_their_number(tmp_path: Path) -> None:
    worked_s = []
    for count in (500, 8_000):
        folder = tmp_path / str(count)
        folder.mkdir()
        for number in range(count):
            (folder / f"take.{number:07d}.png").touch()
        began_s = time.process_time()
        assert len(find_sequence(folder).files) == count
        worked_s.append(time.process_time() - began_s)
    assert worked_s[1] < 3 * 16 * worked_s[0], "two hours are 172,800 files"


def test_a_folder_without_frames_says_what_it_holds(tmp_path: Path, write_plan: Callable[..., None]) -> None:
    write_plan(tmp_path)
    with pytest.raises(PsvideoError, match=r"holds no images; expected numbered frames such as name\.0001\.png"):
        open_clip(tmp_path)
    write_png(tmp_path / "mask.png")
    with pytest.raises(PsvideoError, match=r"without a number at the end of the name \(mask\.png\)"):
        open_clip(tmp_path)
    (tmp_path / "A001.mov").touch()
    with pytest.raises(PsvideoError, match=r"Name the movie itself: .*A001\.mov"):
        open_clip(tmp_path)
    with pytest.raises(PsvideoError, match=r"mask\.png: is neither a folder nor a movie"):
        open_clip(tmp_path / "mask.png")


def test_footage_of_another_size_than_the_plans_is_refused(shot: Path, write_plan: Callable[..., None]) -> None:
    write_plan(shot, rows=1080, cols=1920)
    with pytest.raises(PsvideoError, match=r"shot\.8\.png: is 8 x 6 pixels, and .*plan\.toml says 1920 x 1080"):
        open_clip(shot)


def test_a_mosaic_is_given_as_it_is_with_its_filters(tmp_path: Path, write_plan: Callable[..., None]) -> None:
    write_plan(tmp_path, cfa="GBRG")
    codes = np.arange(ROWS * COLS, dtype=np.uint16).reshape(ROWS, COLS)
    (tmp_path / "a.1.png").write_bytes(imagecodecs.png_encode(codes))
    clip = open_clip(tmp_path)
    (frame,) = read_frames(clip)
    assert (clip.cfa, clip.channels, clip.header.channels) == ("GBRG", 3, 1)
    assert np.allclose(frame.image, codes / 65535)


def test_filters_over_colour_pictures_are_refused(shot: Path, write_plan: Callable[..., None]) -> None:
    write_plan(shot, cfa="RGGB")
    with pytest.raises(PsvideoError, match=r"is a colour picture, and .*plan\.toml says cfa = 'RGGB'"):
        open_clip(shot)


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-30])


def become_a_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


BROKEN_LATER: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (Path.unlink, "is not there any more"),
    "empty": (lambda file: file.write_bytes(b""), "empty"),
    "truncated": (cut, "truncated"),
    "another size": (lambda file: write_png(file, rows=7), r"is 8 x 7 pixels.*first frame, shot\.8\.png, is 8 x 6"),
    "another depth": (
        lambda file: write_png(file, dtype=np.uint8),
        r"8 bits.*first frame, shot\.8\.png, is .* 16 bits",
    ),
    "a folder": (become_a_folder, "is a folder, and a file is expected"),
}


@pytest.mark.parametrize("fault", BROKEN_LATER)
def test_a_broken_frame_is_named_after_the_good_ones_before_it(shot: Path, fault: str) -> None:
    clip = open_clip(shot)
    spoil, message = BROKEN_LATER[fault]
    spoil(shot / "frames" / "shot.11.png")
    seen: list[int] = []
    with pytest.raises(PsvideoError, match=rf"shot\.11\.png: .*{message}") as raised:
        seen.extend(frame.number for frame in read_frames(clip))
    assert seen == [8, 9]
    assert "\n" not in str(raised.value)
    assert not decoding_threads()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_pixels_that_are_no_numbers_are_refused(tmp_path: Path, write_plan: Callable[..., None], value: float) -> None:
    import OpenEXR

    write_plan(tmp_path)
    pixels = np.zeros((ROWS, COLS, 3), np.float16)
    pixels[2, 3, 1] = value
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": pixels}).write(str(tmp_path / "a.1.exr"))
    with pytest.raises(PsvideoError, match=r"a\.1\.exr: holds 1 values that are not numbers"):
        list(read_frames(open_clip(tmp_path)))


def test_a_frame_that_the_clip_lacks_is_a_wrong_choice(shot: Path) -> None:
    with pytest.raises(UsageError, match=r"has no frame number 10; its 4 frames are numbered 8 to 12"):
        read_frames(open_clip(shot), [9, 10])
    with pytest.raises(UsageError, match=r"names none of the clip's frames; its only frame has the number 8\."):
        parse_range("9-10", [8])


def decoding_threads() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name.startswith("decode")]


def test_threads_end_when_reading_is_broken_off(shot: Path) -> None:
    frames = read_frames(open_clip(shot))
    next(frames)
    frames.close()  # type: ignore[attr-defined]
    assert not decoding_threads()


def test_no_more_than_the_frames_asked_for_are_decoded_ahead(shot: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decoded: list[str] = []

    def counted(kind: str, file: Path, **_: bool) -> CodedPicture:
        decoded.append(file.name)
        return decode(kind, file)

    monkeypatch.setattr(reading, "opened", counted)
    for number in range(13, 33):
        write_png(shot / "frames" / f"shot.{number}.png")
    frames = read_frames(open_clip(shot), ahead=2)
    assert decoded == []
    next(frames)
    time.sleep(0.1)
    assert len(decoded) == 3
    assert len(list(frames)) == 23
    assert len(decoded) == len(set(decoded)) == 24


def test_frames_that_were_used_are_let_go(shot: Path) -> None:
    """Memory does not grow with the clip: apart from the frame at hand, only those decoded ahead are alive."""
    for number in range(13, 43):
        write_png(shot / "frames" / f"shot.{number}.png")
    given: list[weakref.ref[Any]] = []
    for frame in read_frames(open_clip(shot), ahead=2):
        given.append(weakref.ref(frame.image))
        assert sum(image() is not None for image in given) <= 2
    assert len(given) == 34


@pytest.mark.parametrize(
    ("text", "numbers"),
    [("8", (8,)), ("1-100", (8, 9, 11, 12)), ("8-12x2", (8, 12)), ("9,12-20", (9, 12)), ("8-12x1", (8, 9, 11, 12))],
)
def test_ranges_choose_among_the_frames_that_are_there(text: str, numbers: tuple[int, ...]) -> None:
    assert parse_range(text, (8, 9, 11, 12)) == numbers


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a frame range"),
        ("a-b", "not a frame range"),
        ("90-99", "names none"),
        ("9-8", "runs backwards"),
        ("8,9-8", "9-8 runs"),
    ],
)
def test_ranges_that_say_nothing_are_wrong_usage(text: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        parse_range(text, (8, 9))


SYNCED = """schema = "psvideo-plan/1"
[camera]
width_px = {}
height_px = {}
fps = 1
[strobe]
mode = "synced"
"""


def synced_plan(file: Path, lights: int, cols: int, rows: int) -> Path:
    flashes = "".join(f"[[strobe.flash]]\nlights = {{ L{light} = 1.0 }}\n" for light in range(lights))
    file.write_text(SYNCED.format(cols, rows) + flashes)
    return file


@pytest.mark.parametrize("subject", ["cat", "horse", "gray"])
def test_still_photographs_one_per_light_are_a_clip(shared_data: Path, tmp_path: Path, subject: str) -> None:
    plan = synced_plan(tmp_path / "plan.toml", 12, 512, 340)
    clip = open_clip(shared_data / "uw_psm" / subject, plan=plan)
    frames = list(read_frames(clip))
    assert [frame.number for frame in frames] == list(range(12))
    assert clip.notes == (f"left aside, having no number at the end: {subject}.mask.png",)
    assert all(frame.image.shape == (340, 512, 3) and 0.01 < frame.image.mean() < 0.5 for frame in frames)


def test_sixteen_bit_photographs_come_out_whole(shared_data: Path, tmp_path: Path) -> None:
    plan = synced_plan(tmp_path / "plan.toml", 48, 160, 160)
    clip = open_clip(shared_data / "diligent_ball", plan=plan)
    frames = list(read_frames(clip))
    assert [frame.number for frame in frames] == list(range(1, 96, 2))
    codes: NDArray[np.uint16] = imagecodecs.imread(str(shared_data / "diligent_ball" / "095.png"))
    assert np.array_equal(np.rint(frames[-1].image * 65535), codes)


@pytest.mark.parametrize(("name", "count"), [("plain", 24), ("ambient", 36)])
def test_another_simulators_clips_are_clips(shared_data: Path, name: str, count: int) -> None:
    clip = open_clip(shared_data / "clips" / name)
    images = np.stack([frame.image for frame in read_frames(clip)])
    assert images.shape == (count, 180, 320, 3)
    assert clip.colour == "lin_rec709_scene"
    assert -0.01 < images.min() < 0.01
    assert 0.5 < images.max() <= 1.0


def test_a_headerless_mosaic_is_a_clip_once_it_is_a_tiff(
    shared_data: Path, tmp_path: Path, write_plan: Callable[..., None]
) -> None:
    import tifffile

    codes = np.fromfile(shared_data / "raw" / "DSC_1339_768x512_rggb.raw", "<u2").reshape(512, 768)
    write_plan(tmp_path, rows=512, cols=768, black_level=600, white_level=15520, cfa="RGGB")
    tifffile.imwrite(tmp_path / "rose.0001.tif", codes)
    (frame,) = read_frames(open_clip(tmp_path))
    assert np.allclose(frame.image, (codes - 600.0) / 14920, atol=1e-6)


@pytest.mark.parametrize(
    ("gamma", "transfer", "doubted"),
    [(45455, "linear", True), (45455, "srgb", False), (100000, "linear", False), (100000, "srgb", True)],
)
def test_a_curve_that_pictures_name_is_held_against_the_plan_s(
    tmp_path: Path, write_plan: Callable[..., None], gamma: int, transfer: str, doubted: bool
) -> None:
    """PNG names a gamma of 2.2 for sRGB too: only a curve that is far from the plan's is spoken of."""
    info = PngInfo()
    info.add(b"gAMA", gamma.to_bytes(4, "big"))
    Image.fromarray(np.full((ROWS, COLS, 3), 90, np.uint8)).save(tmp_path / "shot.0001.png", pnginfo=info)
    write_plan(tmp_path, transfer=transfer)
    clip = open_clip(tmp_path)
    assert bool(clip.curve_doubt) == doubted
    assert any("tagged with the transfer" in warning for warning in clip.warnings) == doubted


@pytest.mark.parametrize(
    ("says", "transfer", "doubted"), [(3, "linear", True), (3, "logc3", False), (2, "srgb", False)]
)
def test_a_dpx_that_says_it_is_logarithmic_is_held_against_the_plan(
    tmp_path: Path, write_plan: Callable[..., None], says: int, transfer: str, doubted: bool
) -> None:
    written = bytearray(dpx_bytes(np.full((ROWS, COLS, 3), 500, np.uint16), 10))
    written[801] = says
    (tmp_path / "shot.0001.dpx").write_bytes(written)
    write_plan(tmp_path, transfer=transfer)
    clip = open_clip(tmp_path)
    assert ("hold a logarithm of light" in clip.curve_doubt) == doubted
    assert bool(clip.warnings) == doubted


def test_a_cameras_dng_is_a_clip(shared_data: Path, tmp_path: Path, write_plan: Callable[..., None]) -> None:
    (tmp_path / "shot.0001.dng").symlink_to(shared_data / "raw" / "colorchart.dng")
    write_plan(tmp_path, rows=1156, cols=1734, transfer="slog3")
    clip = open_clip(tmp_path)
    (frame,) = read_frames(clip)
    assert (clip.cfa, clip.channels, clip.colour, frame.image.shape) == ("RGGB", 3, "unknown", (1156, 1734))
    assert "DNG files hold linear light" in clip.warnings[0]


@pytest.mark.parametrize(("white", "warned"), [(65535, False), (65536, True), (255, False)])
def test_a_white_level_of_other_files_is_warned_of(
    white: int, warned: bool, tmp_path: Path, write_plan: Callable[..., None]
) -> None:
    write_plan(tmp_path, white_level=white)
    for number in range(3):
        write_png(tmp_path / f"shot.{number}.png", 100)
    said = " ".join(open_clip(tmp_path).warnings)
    assert ("the largest code of these 16-bit files is 65535" in said) == warned
