"""Photographs of a still scene, one per light: read, paired with their lights and solved, without a plan."""

import json
import os
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np
import OpenEXR
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageCms
from PIL.PngImagePlugin import PngInfo

import psvideo as ps
from psvideo.calibrate.still_pairs import pair_stills
from psvideo.cli.app import main
from psvideo.clip.decode import tiff
from psvideo.clip.decode.decoders import decode
from psvideo.clip.stated import stated_by
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.rig_toml import format_rig
from psvideo.inspect.describe import describe
from psvideo.model.quantities import Aov
from psvideo.model.turn import EXIF
from psvideo.synth.camera.dpx_writer import dpx_bytes

SIZE, RADIUS = 64, 27
ANGLES = np.radians(np.arange(0, 360, 60))
LIGHTS = np.stack([0.5 * np.cos(ANGLES), 0.5 * np.sin(ANGLES), np.full(6, np.sqrt(0.75))], axis=1)
NAMES = [f"shot {n}" for n in (3, 7, 8, 20, 21, 22)]
Picture = NDArray[np.float64]
Item = TypeVar("Item")


def ball() -> tuple[Picture, NDArray[np.bool_]]:
    """Return the normals of a ball (row, col, 3), and where it is."""
    y, x = np.mgrid[:SIZE, :SIZE]
    x, y = (x - SIZE / 2 + 0.5) / RADIUS, (SIZE / 2 - 0.5 - y) / RADIUS
    inside = x**2 + y**2 < 1
    return np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1), inside


def lit(ambient: float = 0.0) -> list[Picture]:
    normals, inside = ball()
    noise = np.random.default_rng(4).normal(0, 0.001, (len(LIGHTS), SIZE, SIZE))
    shades = [np.where(inside, 0.7 * np.maximum(normals @ light, 0) + ambient, 0) for light in LIGHTS]
    return [np.clip(shade + grain, 0, 1) for shade, grain in zip(shades, noise, strict=True)]


def as_srgb(light: Picture) -> Picture:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def save8(path: Path, signal: Picture, **more: object) -> None:
    Image.fromarray((255 * signal + 0.5).astype(np.uint8)).save(path, **more)  # type: ignore[arg-type]


def save16(path: Path, signal: Picture) -> None:
    cv2.imwrite(str(path), (65535 * signal + 0.5).astype(np.uint16))


def photographs(
    folder: Path, pictures: Sequence[Picture], names: Sequence[str] = NAMES, save: Callable[..., None] = save16
) -> Path:
    folder.mkdir()
    for name, picture in zip(names, pictures, strict=False):
        save(folder / f"{name}.png", picture)
    return folder


def listed(path: Path, names: Sequence[str] | None = None, lights: NDArray[np.float64] = LIGHTS) -> Path:
    """Write lights as .lp, with the pictures' names where there are any."""
    words = [""] * len(lights) if names is None else [f"{name} " for name in names]
    rows = [f"{word}{' '.join(map(str, light))}" for word, light in zip(words, lights.tolist(), strict=True)]
    path.write_text("\n".join([str(len(rows)), *rows, ""]))
    return path


def error_deg(out: Path) -> float:
    """Return the mean error of the ball's normals, its very rim left out."""
    normals = decode("exr", next((out / "normals").glob("*.exr"))).codes.astype(np.float64)
    true, _ = ball()
    middle = true[..., 2] > 0.3
    return float(np.degrees(np.arccos(np.clip((normals * true).sum(axis=-1), -1, 1)))[middle].mean())


def remarks(report: object) -> str:
    assert hasattr(report, "shot")
    return str(report.shot["Remarks"])


def test_pictures_find_their_lights_by_name_whatever_the_order_and_the_holes(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", lit())
    turned = [3, 0, 5, 1, 4, 2]
    lights = listed(tmp_path / "lights.lp", [f"C:\\rti\\{NAMES[n]}.JPG" for n in turned], LIGHTS[turned])
    report = ps.stills(folder, lights=lights, out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1
    assert "belong to lights by name" in remarks(report)
    assert not report.timing.dropped_frames


def test_a_result_of_photographs_is_delivered_at_a_rate_that_programs_know(tmp_path: Path) -> None:
    out = tmp_path / "out"
    ps.stills(
        photographs(tmp_path / "photos", lit(), NAMES[:6]), lights=listed(tmp_path / "l.lp"), out=out, plates=True
    )
    rates = {float(OpenEXR.File(str(path)).header()["framesPerSecond"]) for path in out.rglob("*.exr")}
    assert rates == {24.0}
    (timeline,) = out.glob("*.otio")
    assert '"rate": 24' in timeline.read_text()


def test_large_plain_tiffs_give_the_same_bytes_and_one_that_is_cut_short_while_it_is_solved_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = photographs(
        tmp_path / "photos", lit(), save=lambda path, light: save_tiff(path.with_suffix(".tif"), light)
    )
    lights = listed(tmp_path / "lights.lp")
    ps.stills(folder, lights=lights, out=tmp_path / "read")
    monkeypatch.setattr(tiff, "STAYS_FROM_BYTES", 1)
    ps.stills(folder, lights=lights, out=tmp_path / "left")
    for file in (tmp_path / "read").rglob("*.exr"):
        assert file.read_bytes() == (tmp_path / "left" / file.relative_to(tmp_path / "read")).read_bytes()

    def cutting(items: Iterable[Item], *, total: int, what: str, unit: str = "frame") -> Iterator[Item]:
        for frame in items:
            yield frame
            if (folder / "shot 20.tif").stat().st_size > 4000 and getattr(frame, "number", 0) == 4:
                os.truncate(folder / "shot 20.tif", 4000)

    with pytest.raises(PsvideoError, match=r"shot 20\.tif: was changed while it was worked on"):
        ps.stills(folder, lights=lights, out=tmp_path / "cut", watch=cutting)


def save_tiff(path: Path, signal: Picture) -> None:
    tifffile.imwrite(path, (65535 * signal + 0.5).astype(np.uint16), photometric="minisblack")


def facing(light: NDArray[np.float64], shape: tuple[int, int]) -> Picture:
    """A wall that faces the camera, with a little noise of its own, so that no picture is another's copy."""
    noise = np.random.default_rng(int(1000 * light[0] + 2000) + int(1000 * light[1])).normal(0, 0.0005, (*shape, 3))
    return np.asarray(0.8 * light[2] + noise)


@pytest.mark.parametrize("shape", [(4, 6000), (2000, 4)])
def test_narrow_strips_are_solved(shape: tuple[int, int], tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", [facing(light, shape) for light in LIGHTS])
    ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out", transfer="linear")
    normals = decode("exr", next((tmp_path / "out" / "normals").glob("*.exr"))).codes
    assert np.abs(normals[..., 2] - 1).max() < 0.01


def test_pictures_of_no_size_are_refused(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", [facing(light, (3, 2000)) for light in LIGHTS])
    with pytest.raises(PsvideoError, match="is a picture of 2000 x 3 pixels"):
        ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")


def test_pictures_without_names_belong_to_lights_by_order_and_the_report_says_so(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", lit())
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1
    said = remarks(report)
    assert "by order, since lights.lp names none of them: shot 3.png shows 'L0', and so on" in said
    assert "to shot 22.png, which shows 'L5'" in said
    setup = tmp_path / "out" / "setup"
    assert {"plan.toml", "rig.toml", "lights.lp"} == {file.name for file in setup.iterdir()}
    again = ps.stills(folder, lights=setup / "rig.toml", out=tmp_path / "out", force=True)
    assert "by name (rig.toml)" in remarks(again)
    assert error_deg(tmp_path / "out") < 1


@pytest.mark.parametrize(("left_aside", "named"), [("room light", True), ("black", False), ("another light", False)])
def test_a_picture_without_a_light_that_may_show_the_room_is_named(
    left_aside: str, named: bool, tmp_path: Path
) -> None:
    ambient = 0.1 * (1 + np.mgrid[:SIZE, :SIZE][0] / SIZE)
    shown = {"room light": ambient, "black": 0.001 * ambient, "another light": lit()[2] + ambient}[left_aside]
    folder = photographs(tmp_path / "photos", [np.clip(one + ambient, 0, 1) for one in lit()])
    save16(folder / "IMG_0007.png", shown)
    lights = listed(tmp_path / "lights.lp", NAMES)
    report = ps.stills(folder, lights=lights, out=tmp_path / "out", transfer="linear")
    assert "Left aside: IMG_0007.png" in remarks(report)
    said = "IMG_0007.png belongs to no light and is nowhere brighter than the others"
    assert (said in remarks(report)) == named


def test_pictures_a_folder_deeper_are_pointed_to(tmp_path: Path) -> None:
    photographs(tmp_path / "photos", lit())
    with pytest.raises(PsvideoError, match="The folder photos in it holds pictures: name that one"):
        ps.stills(tmp_path, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")


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


@pytest.mark.parametrize("said", ["nothing", "srgb chunk", "profile"])
def test_eight_bits_are_srgb_unless_they_say_otherwise(tmp_path: Path, said: str) -> None:
    more: dict[str, object] = {}
    if said == "profile":
        more["icc_profile"] = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    if said == "srgb chunk":
        more["pnginfo"] = chunk(b"sRGB", b"\0")
    folder = photographs(tmp_path / "photos", lit(), save=lambda path, light: save8(path, as_srgb(light), **more))
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1.5
    assert "read as 'srgb'" in remarks(report)
    why = {
        "nothing": "the usual curve of 8-bit",
        "srgb chunk": "as its sRGB chunk says",
        "profile": "as its ICC profile",
    }
    assert why[said] in remarks(report)
    assert not any("fit the lights better" in warning for warning in report.warnings)


@pytest.mark.parametrize(("code", "curve"), [(8, "linear"), (13, "srgb"), (16, "st2084"), (18, "hlg")])
def test_a_png_s_own_code_of_its_curve_goes_before_what_is_usual(tmp_path: Path, code: int, curve: str) -> None:
    """PNG 3, 11.3.2.6: the code of H.273 goes before profile, ``sRGB`` and ``gAMA``."""
    signals: dict[str, Callable[[Picture], Picture]] = {
        "linear": lambda light: light,
        "srgb": as_srgb,
        "st2084": lambda light: pq(100 * light),
        "hlg": lambda light: np.where(light < 1 / 12, np.sqrt(3 * light), hlg_top(np.maximum(light, 1 / 12))),
    }
    info = chunk(b"cICP", bytes([9, code, 0, 1]))
    info.add(b"gAMA", (55556).to_bytes(4, "big"))
    folder = photographs(
        tmp_path / "photos", lit(), save=lambda path, light: save8(path, signals[curve](light), pnginfo=info)
    )
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert f"read as {curve!r}, as its cICP chunk says" in remarks(report)
    assert error_deg(tmp_path / "out") < 1.5


def pq(nits: Picture) -> Picture:
    """The signal of so much light (SMPTE ST 2084, 5.2)."""
    power = (nits / 10_000) ** (2610 / 16384)
    return ((3424 / 4096 + 2413 / 128 * power) / (1 + 2392 / 128 * power)) ** (2523 / 32)


def hlg_top(light: Picture) -> Picture:
    """The signal of HLG above a twelfth (ITU-R BT.2100, table 5)."""
    return 0.17883277 * np.log(12 * light - 0.28466892) + 0.55991073


@pytest.mark.parametrize("says", [1, 3])
def test_a_dpx_that_says_it_is_logarithmic_is_not_read_as_linear(tmp_path: Path, says: int) -> None:
    def save(path: Path, light: Picture) -> None:
        codes = np.round(1023 * np.log10(1 + 999 * light) / 3).astype(np.uint16)
        coded = dpx_bytes(np.repeat(codes[..., None], 3, axis=2), 10)
        path.with_suffix(".dpx").write_bytes(coded[:801] + bytes([says]) + coded[802:])

    folder, lights = photographs(tmp_path / "photos", lit(), save=save), listed(tmp_path / "lights.lp")
    with pytest.raises(PsvideoError, match=r"dpx: says that it holds a logarithm of light, and not which"):
        ps.stills(folder, lights=lights, out=tmp_path / "out")
    report = ps.stills(folder, lights=lights, out=tmp_path / "out", transfer="logc3")
    assert "read as 'logc3', as you say" in remarks(report)


def test_pictures_that_speak_against_what_was_assumed_of_them_are_named(tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", lit(), save=save8)
    lights = listed(tmp_path / "lights.lp")
    report = ps.stills(folder, lights=lights, out=tmp_path / "out")
    doubt = report.findings[0]  # before what follows from it
    assert "read as 'srgb', the usual curve of 8-bit pictures" in doubt
    assert "say `transfer='linear'`" in doubt
    assert report.verdict == "This take is doubtful: see below before using it."
    assert not any("rig does not fit" in one or "fit the lights better" in one for one in report.findings[1:])
    assert not ps.stills(folder, lights=lights, out=tmp_path / "other", transfer="linear").findings
    assert error_deg(tmp_path / "other") < 1.5 < error_deg(tmp_path / "out")


def test_of_a_shallow_relief_no_curve_is_doubted_for_the_noise_of_its_codes(tmp_path: Path) -> None:
    y, x = np.mgrid[:SIZE, :SIZE] * (6 * np.pi / SIZE)
    normals = np.stack([0.1 * np.cos(x), 0.1 * np.cos(y), np.ones_like(x)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    noise = np.random.default_rng(5).normal(0, 0.002, (len(LIGHTS), SIZE, SIZE))
    shades = [as_srgb(0.6 * normals @ light + grain) for light, grain in zip(LIGHTS, noise, strict=True)]
    folder = photographs(tmp_path / "photos", shades, save=save8)
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert not any("fit the lights better" in one for one in report.findings)
    assert report.verdict.startswith("This take is usable")


def dome(lights: int) -> NDArray[np.float64]:
    """Return directions on a spiral, 20 to 75 degrees above the table."""
    turns = np.arange(lights) * np.pi * (np.sqrt(5) - 1)
    height = np.radians(20 + 55 * (np.arange(lights) + 0.5) / lights)
    return np.stack([np.cos(height) * np.cos(turns), np.cos(height) * np.sin(turns), np.sin(height)], axis=1)


def metal(lights: NDArray[np.float64]) -> list[Picture]:
    """Return photographs of a small shield of metal, nearly flat."""
    y, x = np.mgrid[:SIZE, :SIZE] * (3 * np.pi / SIZE)
    slopes = 0.12 * np.cos(x), 0.12 * np.cos(y + x / 2)  # of sin + sin
    normals = np.stack([-slopes[0] - slopes[1] / 2, slopes[1], np.ones_like(x)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    halves = lights + np.array([0, 0, 1])
    halves /= np.linalg.norm(halves, axis=1, keepdims=True)
    pairs = zip(lights, halves, strict=True)
    return [0.3 * normals @ light + 0.65 * np.maximum(normals @ half, 0) ** 40 for light, half in pairs]


def test_of_metal_the_surface_is_blamed_and_neither_the_rig_nor_the_curve(tmp_path: Path) -> None:
    lights = dome(12)
    names = [f"shot {n}" for n in range(12)]
    folder = photographs(tmp_path / "photos", [as_srgb(one) for one in metal(lights)], names, save8)
    report = ps.stills(folder, lights=listed(tmp_path / "right.lp", names, lights), out=tmp_path / "out")
    assert report.verdict == "This take is usable, with reservations."
    assert any(one.startswith("The surface shines") for one in report.findings)
    assert not any(word in one for one in report.findings for word in ("fit the lights better", "rig does not fit"))
    wrong = listed(tmp_path / "wrong.lp", names, np.roll(lights, 1, axis=0))
    doubted = ps.stills(folder, lights=wrong, out=tmp_path / "wrong")
    assert "rig does not fit" in doubted.findings[0]


def save_exr(path: Path, light: Picture, depth: type = np.float32) -> None:
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Y": light.astype(depth)}).write(str(path))


def test_developed_pictures_that_go_beyond_one_are_clipped_nowhere_below_their_brightest(tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for name, light in zip(NAMES, lit(), strict=True):
        save_exr(folder / f"{name}.exr", 3.6 * light)
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1.0
    assert "They hold light up to 2.5" in remarks(report)
    assert not any("clip" in one for one in report.findings)


@pytest.mark.parametrize(("times", "depth"), [(3.6, np.float16), (0.3, np.float32)])
def test_a_mirrored_lamp_in_a_merged_picture_makes_the_rest_neither_dark_nor_clipped(
    tmp_path: Path, times: float, depth: type
) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for name, light in zip(NAMES, lit(), strict=True):
        picture = times * light
        picture.flat[light.argmax()] = 30_000.0
        save_exr(folder / f"{name}.exr", picture, depth)
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1.0
    assert ("highlights beyond 10" in remarks(report)) == (times > 1)
    assert not any("clip" in one or "dark" in one for one in report.findings)


def with_exposures(folder: Path, pictures: Sequence[Picture], seconds: Sequence[float]) -> Path:
    """Write pictures, the seventh named dark, with what EXIF says of their exposure; nothing at 0 seconds."""
    folder.mkdir()
    for name, picture, time_s in zip([*NAMES, "dark"], pictures, seconds, strict=False):
        exif = Image.Exif()
        if time_s:
            exif.get_ifd(0x8769)[0x829A] = time_s
        save8(folder / f"{name}.jpg", as_srgb(picture), exif=exif, quality=98)
    return folder


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


def test_pictures_that_a_camera_held_upright_stand_upright(tmp_path: Path) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for name, picture in zip(NAMES, lit(), strict=True):
        exif = Image.Exif()
        exif[0x0112] = 6
        save8(folder / f"{name}.jpg", as_srgb(np.rot90(picture)), exif=exif, quality=98)
    ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1.5


def test_relighting_from_the_rti_planes_gives_back_the_photographs(tmp_path: Path) -> None:
    """Evaluated as OpenLIME's shader does: (code - bias) * scale, times 1, x, y, xx, xy, yy, times the colour."""
    pictures = lit()
    ps.stills(photographs(tmp_path / "photos", pictures), lights=listed(tmp_path / "l.lp"), out=tmp_path / "out")
    folder = tmp_path / "out" / "rti"
    info = json.loads((folder / "info.json").read_text())
    assert (info["type"], info["colorspace"], info["nplanes"]) == ("ptm", "lrgb", 9)
    scale, bias = (np.reshape(info["materials"][0][key], (3, 1, 1, 3)) for key in ("scale", "bias"))
    planes = np.array([np.asarray(Image.open(folder / f"plane_{n}.jpg")) / 255 for n in range(3)])
    colour, *terms = (planes - bias) * scale
    for light, picture in zip(LIGHTS, pictures, strict=True):
        x, y, _ = light
        level = np.concatenate(terms, axis=-1) @ np.array([1, x, y, x * x, x * y, y * y])
        shown = np.clip(level[..., None] * colour, 0, 1)
        coded = as_srgb(np.clip(picture * 0.8 / np.percentile(picture, 99), 0, 1))
        assert np.abs(shown[..., 0] - coded)[ball()[1]].mean() < 0.06


def read_ptm(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a .ptm's six numbers per pixel and its colours, as sections 2 and 3 of its description say."""
    header, data = path.read_bytes().split(b"\n", 6)[:6], path.read_bytes().split(b"\n", 6)[6]
    assert header[:2] == [b"PTM_1.2", b"PTM_FORMAT_LRGB"]
    cols, rows = int(header[2]), int(header[3])
    scale, bias = np.array(header[4].split(), float), np.array([int(word) for word in header[5].split()])
    assert len(data) == rows * cols * 9
    codes = np.frombuffer(data, np.uint8).astype(np.float64)
    numbers = (codes[: rows * cols * 6].reshape(rows, cols, 6) - bias) * scale
    return numbers[::-1], codes[rows * cols * 6 :].reshape(rows, cols, 3)[::-1]


def test_relighting_from_the_ptm_gives_back_coloured_photographs(tmp_path: Path) -> None:
    """One quarter is redder, another bluer, so that nothing may be turned round."""
    tint = np.ones((SIZE, SIZE, 3))
    tint[: SIZE // 2, : SIZE // 2, 1:] *= 0.4
    tint[SIZE // 2 :, SIZE // 2 :, :2] *= 0.4
    pictures = [picture[..., None] * tint for picture in lit()]
    folder = photographs(tmp_path / "photos", [picture[..., ::-1] for picture in pictures])
    ps.stills(folder, lights=listed(tmp_path / "l.lp"), out=tmp_path / "out")
    numbers, colour = read_ptm(tmp_path / "out" / "rti" / "relight.ptm")
    for (u, v, _), picture in zip(LIGHTS, pictures, strict=True):
        level = numbers @ np.array([u * u, v * v, u * v, u, v, 1])
        shown = np.clip(level[..., None] * colour / 255, 0, 255) / 255
        coded = as_srgb(np.clip(picture * 0.8 / np.percentile(picture, 99), 0, 1))
        assert np.abs(shown - coded)[ball()[1]].mean() < 0.06


BAD: dict[str, tuple[str, ...]] = {
    "unknown light": ("names 9.png, and no picture is called so", "Pictures without a light: shot 22.png"),
    "too few lights": ("holds 6 pictures of lights", "lists 5 lights"),
    "another size": ("shot 8.png: is 32 x 64 pixels", "Expected pictures of one camera"),
    "another kind": ("shot 3.png is PNG and shot 8.tif is TIFF", "of one kind"),
    "another curve": ("shot 8.png: says that its curve is linear", "Pictures with different curves cannot be compared"),
    "no lights": ("`lights` and `sphere`: expected one of the two",),
    "no folder": ("is no folder",),
}


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (["--dark", "photos"], 1, "photos: is a folder, and one picture is expected"),
        (["--dark", "no.png"], 1, "no.png: there is no such file"),
        (["--dark", "lights.lp"], 1, "lights.lp: is no picture that psvideo reads"),
        (["--mask", "photos"], 1, "photos: is a folder, and one picture is expected"),
        (["--transfer", "slog4"], 2, "--transfer is 'slog4', not a curve that this psvideo knows; did you mean"),
        (["--radius-mm", "20"], 2, "--radius-mm describes mirror spheres, and --lights"),
        (["--circle", "80,60,40"], 2, "--circle describes mirror spheres"),
        (["--spheres", "2"], 2, "--spheres describes mirror spheres"),
        (["--aov", "motion"], 2, "--aov motion: photographs of a still scene show no motion"),
    ],
)
def test_options_that_cannot_be_meant_are_one_paragraph(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    status: int,
    says: str,
) -> None:
    photographs(tmp_path / "photos", lit())
    listed(tmp_path / "lights.lp")
    monkeypatch.chdir(tmp_path)
    assert main(["stills", "photos", "--lights", "lights.lp", "-o", "out", *words]) == status
    said = capsys.readouterr()
    assert says in said.err
    assert said.err.count("\n") == 1
    assert not said.out
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_go_together_is_said_in_one_paragraph_and_nothing_is_written(tmp_path: Path, case: str) -> None:
    save = save8 if case == "another curve" else save16
    folder = photographs(tmp_path / "photos", lit(), save=save)
    lights: Path | None = listed(tmp_path / "lights.lp", None)
    if case == "unknown light":
        lights = listed(tmp_path / "lights.lp", [*NAMES[:5], "9.png"])
    if case == "too few lights":
        lights = listed(tmp_path / "lights.lp", None, LIGHTS[:5])
    if case == "another size":
        save16(folder / "shot 8.png", np.full((64, 32), 0.2))
    if case == "another kind":
        (folder / "shot 8.png").rename(folder / "shot 8.tif")
    if case == "another curve":
        save8(folder / "shot 8.png", lit()[2], pnginfo=chunk(b"gAMA", (100000).to_bytes(4, "big")))
    if case == "no lights":
        lights = None
    if case == "no folder":
        folder = tmp_path / "elsewhere"
    with pytest.raises(ps.PsvideoError) as fault:
        ps.stills(folder, lights=lights, out=tmp_path / "out")
    for part in BAD[case]:
        assert part in str(fault.value)
    assert "\n" not in str(fault.value)
    assert not (tmp_path / "out").exists()


def chunk(name: bytes, data: bytes) -> PngInfo:
    info = PngInfo()
    info.add(name, data)
    return info


def test_the_command_says_what_it_assumed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = photographs(tmp_path / "photos", lit(), save=save8)
    listed(tmp_path / "lights.lp")
    words = ["stills", str(folder), "--lights", str(tmp_path / "lights.lp"), "-o", str(tmp_path / "out")]
    assert main(words) == 0
    said = capsys.readouterr()
    assert "read as 'srgb'" in said.out + said.err
    assert "say --transfer linear" in said.err
    assert main(words) == 2
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<h2>Over time</h2>" not in page, "one picture has no course"
    assert "The only result</summary>" in page
    assert ".;" not in page[page.index("Remarks") :], "sentences are joined once"
    assert not any(words in page for words in ("a second", "shutter", "Lasts", "<h2>Timing</h2>", "Strobe"))


def test_info_says_what_a_folder_of_photographs_is_read_as_and_what_differs(tmp_path: Path) -> None:
    folder = with_exposures(tmp_path / "photos", lit(), [0.02, 0.01, 0.02, 0.02, 0.02, 0.02])
    save8(folder / "ambient.jpg", np.zeros((SIZE, SIZE)))
    said = [finding.text for finding in describe(folder).findings]
    assert said[0] == "as photographs, 6 lights: shot 3.jpg to shot 22.jpg, jpeg, 64 x 64 pixels, 1 channel, 8 bits"
    assert said[1].startswith("read as 'srgb', the usual curve")
    assert "exposures differ by up to a factor 2, as EXIF says" in said
    assert "ambient.jpg shows ambient light" in said
    assert "need none: psvideo stills" in said[-1]


def test_what_a_file_says_of_itself_is_read(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x010F], exif[0x0110] = "Canon", "Canon EOS 5D"
    exif.get_ifd(0x8769)[0xA405] = 50
    save8(tmp_path / "a.jpg", lit()[0], exif=exif)
    told = stated_by(tmp_path / "a.jpg")
    assert told.camera == "Canon EOS 5D"
    assert told.focal_widths == pytest.approx(50 / 36)
    assert stated_by(tmp_path / "missing.jpg").transfer is None


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


def test_a_cameras_own_raw_files_are_solved_as_linear_light(tmp_path: Path) -> None:
    """DNGs under another maker's ending: LibRaw goes by what a file holds, and gives what tifffile gives."""
    folder = tmp_path / "photos"
    folder.mkdir()
    for name, picture in zip(NAMES, lit(), strict=True):
        levels = [(50714, "I", 1, 200, True), (50717, "I", 1, 15000, True)]
        filters = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, (0, 1, 1, 2), True)]
        dng_tags = [(50706, "B", 4, (1, 4, 0, 0), True), (50708, "s", 0, "Test Camera", True), *filters, *levels]
        codes = (200 + 12000 * picture).astype(np.uint16)
        tifffile.imwrite(folder / f"{name}.nef", codes, photometric=32803, extratags=dng_tags)
    raw, dng = folder / f"{NAMES[0]}.nef", tmp_path / "same.dng"
    dng.write_bytes(raw.read_bytes())
    assert np.array_equal(decode("raw", raw).codes, decode("dng", dng).codes)
    head = decode("raw", raw).header
    assert (head.cfa, head.white, head.black) == ("RGGB", 15000.0, ((200.0, 200.0), (200.0, 200.0)))
    report = ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1.5
    assert "read as 'linear'" in remarks(report)
    raw.write_bytes(raw.read_bytes()[:600])
    with pytest.raises(ps.PsvideoError, match=r"shot 3\.nef: .*LibRaw .* cannot read it"):
        ps.stills(folder, lights=tmp_path / "lights.lp", out=tmp_path / "cut")


def test_a_sphere_that_the_picture_cuts_off_is_refused(tmp_path: Path) -> None:
    folder, ball_folder = photographs(tmp_path / "photos", lit()), chrome(tmp_path / "ball", middle=(215, 118))
    with pytest.raises(ps.PsvideoError) as fault:
        ps.stills(folder, sphere=[ball_folder], out=tmp_path / "out")
    assert "ball" in str(fault.value)
    assert "\n" not in str(fault.value)
    assert not (tmp_path / "out").exists()


def test_a_profile_that_is_damaged_takes_neither_orientation_nor_exposure_with_it(tmp_path: Path) -> None:
    tag = b"para\0\0\0\0" + struct.pack(">HH3i", 1, 0, 65536, 0, 65536)  # a = 0: divided by
    profile = bytes(128) + struct.pack(">I4sII", 1, b"rTRC", 144, len(tag)) + tag
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 6
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.ExposureTime] = 0.5
    Image.new("RGB", (8, 6)).save(tmp_path / "a.jpg", exif=exif, icc_profile=profile)
    said = stated_by(tmp_path / "a.jpg")
    assert (said.turn, said.exposure, said.longer_px, said.transfer) == (EXIF[6], 0.5, 8, None)


def named_pictures(folder: Path, names: Sequence[str]) -> Path:
    folder.mkdir()
    for level, name in enumerate(names):
        Image.new("L", (8, 8), 40 + level).save(folder / name)
    return folder


@pytest.mark.parametrize(
    ("listed", "pictures"),
    [
        (
            ("Bu\u0308ste 2.jpg", "Bu\u0308ste 0.jpg", "Bu\u0308ste 1.jpg"),
            ("B\u00fcste 2.jpg", "B\u00fcste 0.jpg", "B\u00fcste 1.jpg"),
        ),
        (("img03.jpg", "img01.jpg", "img02.jpg"), ("img3.jpg", "img1.jpg", "img2.jpg")),
        (("DSC_103.NEF", "DSC_101.NEF", "DSC_102.NEF"), ("DSC_103_edit.jpg", "DSC_101_edit.jpg", "DSC_102_edit.jpg")),
        (("a_3_edit.jpg", "a_1_edit.jpg", "a_2_edit.jpg"), ("a_3.jpg", "a_1.jpg", "a_2.jpg")),
        (("img3.jpg", "img1.jpg", "img2.jpg"), ("IMG3.JPG", "img1.jpg", "img2.jpg")),
        (("1.jpg", "10.jpg", "100.jpg"), ("001.jpg", "010.jpg", "100.jpg")),
    ],
    ids=["accents", "zeros", "a word more", "a word less", "large letters", "all zeros"],
)
def test_pictures_are_found_by_names_that_say_the_same(
    listed: tuple[str, ...], pictures: tuple[str, ...], tmp_path: Path
) -> None:
    """By order, as the files are sorted, each would get another one's light."""
    folder = named_pictures(tmp_path / "photos", pictures)
    found = pair_stills(folder, listed, named=True, whose="lights.lp")
    assert [file.name for file in found.files] == list(pictures)
    assert "by name" in found.how


def test_a_list_that_names_other_pictures_and_counts_otherwise_is_refused(tmp_path: Path) -> None:
    folder = named_pictures(tmp_path / "photos", ("shot1.jpg", "shot2.jpg", "shot3.jpg"))
    with pytest.raises(PsvideoError, match="numbers do not ascend as the pictures' do"):
        pair_stills(folder, ("dome_7.jpg", "dome_2.jpg", "dome_9.jpg"), named=True, whose="lights.lp")
    for names in (("dome_2.jpg", "dome_7.jpg", "dome_9.jpg"), ("key", "left", "top")):
        found = pair_stills(folder, names, named=True, whose="lights.lp")
        assert [file.name for file in found.files] == ["shot1.jpg", "shot2.jpg", "shot3.jpg"]
        assert "by order" in found.how


def test_lights_of_which_there_is_no_picture_are_left_out_and_named(tmp_path: Path) -> None:
    """Six photographs of a dome of 96: nobody takes ninety lines out by hand."""
    kept = [0, 1, 3, 5]
    folder = photographs(tmp_path / "photos", [lit()[n] for n in kept], [NAMES[n] for n in kept])
    turned = [3, 0, 5, 1, 4, 2]
    lights = listed(tmp_path / "lights.lp", [f"{NAMES[n]}.jpg" for n in turned], LIGHTS[turned])
    report = ps.stills(folder, lights=lights, out=tmp_path / "out")
    assert error_deg(tmp_path / "out") < 1
    assert "2 of the 6 lights are left out, as no picture bears the name: shot 21.jpg, shot 8.jpg of" in remarks(report)
    assert {light.name for light in ps.read_rig(tmp_path / "out" / "setup" / "rig.toml").lights} == {
        NAMES[n] for n in kept
    }


def test_pictures_that_bear_a_rigs_lights_need_not_be_all(tmp_path: Path) -> None:
    folder = named_pictures(tmp_path / "photos", ("vase_key.png", "vase_top.png", "vase_left.png"))
    found = pair_stills(folder, ("key", "left", "rim", "top"), named=True, whose="rig.toml")
    assert (found.names, found.places) == (("key", "left", "top"), (0, 1, 3))
    (folder / "vase_top.png").rename(folder / "vase_top2.png")
    with pytest.raises(PsvideoError, match=r"Pictures without a light: vase_top2.png"):
        pair_stills(folder, ("key", "left", "rim", "top"), named=True, whose="rig.toml")


def test_names_that_end_alike_are_told_apart_and_what_shows_no_light_is_named(tmp_path: Path) -> None:
    names = ("left", "top_left", "top")
    for number, name in enumerate([*(f"take_{name}" for name in names), "a_dark", "dark", "room"]):
        save8(tmp_path / f"{name}.png", np.full((8, 8), 0.1 * number))
    found = pair_stills(tmp_path, names, named=True, whose="lights.lp")
    assert [file.stem for file in found.files] == [f"take_{name}" for name in names]
    assert found.dark == tmp_path / "dark.png"
    assert [file.name for file in found.aside] == ["a_dark.png", "room.png"]


def test_a_name_that_begins_two_pictures_is_asked_about(tmp_path: Path) -> None:
    folder = named_pictures(tmp_path / "photos", ("a_1.jpg", "a_1_b.jpg", "a_2_b.jpg", "a_3_b.jpg"))
    found = pair_stills(folder, ("a_1", "a_2_b", "a_3_b"), named=True, whose="lights.lp")
    assert [file.name for file in found.files] == ["a_1.jpg", "a_2_b.jpg", "a_3_b.jpg"]


def test_a_little_gloss_under_four_lights_is_no_other_curve(tmp_path: Path) -> None:
    """A sheen looks as if sRGB pictures held light itself."""
    lights = 4
    y, x = np.mgrid[-1.2:1.2:96j, -1.2:1.2:96j]
    bumps = 0.9 * np.stack([np.cos(4 * x) * np.sin(3 * y), np.sin(4 * x) * np.cos(3 * y), np.ones_like(x)], axis=-1)
    normals = bumps / np.linalg.norm(bumps, axis=-1, keepdims=True)
    angles = np.linspace(0, 2 * np.pi, lights, endpoint=False)
    ways = np.stack([0.6 * np.cos(angles), 0.6 * np.sin(angles), np.full(lights, 0.8)], axis=-1)
    lines = [str(lights)]
    for number, way in enumerate(ways):
        half = way + np.array([0.0, 0.0, 1.0])
        half /= np.linalg.norm(half)
        light = 0.5 * np.maximum(normals @ way, 0) + 0.1 * np.maximum(normals @ half, 0) ** 12
        coded = np.where(light < 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
        Image.fromarray(np.round(255 * coded).astype(np.uint8)).save(tmp_path / f"img{number}.png")
        lines.append(f"img{number}.png {way[0]} {way[1]} {way[2]}")
    (tmp_path / "lights.lp").write_text("\n".join(lines) + "\n")
    report = ps.stills(tmp_path, lights=tmp_path / "lights.lp", out=tmp_path / "out")
    assert not any("fit the lights better" in line.sentence for line in report.judgements)
