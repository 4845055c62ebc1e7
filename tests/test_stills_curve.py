"""How photographs code light: what their files say, what is assumed of those that do not, and when that is doubted."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import ExifTags, Image, ImageCms
from still_pictures import (
    LIGHTS,
    NAMES,
    SIZE,
    Picture,
    as_srgb,
    chunk,
    error_deg,
    listed,
    lit,
    photographs,
    remarks,
    save8,
)

import psvideo as ps
from psvideo.clip.stated import stated_by
from psvideo.errors import PsvideoError
from psvideo.model.turn import EXIF
from psvideo.synth.camera.dpx_writer import dpx_bytes


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


@pytest.mark.parametrize("transfer", ["linear", "srgb"])
def test_twelve_bits_in_files_of_sixteen_count_from_the_white_that_is_named(tmp_path: Path, transfer: str) -> None:
    """Without it the picture is called dark, what is clipped passes for light, and an sRGB curve tilts normals."""
    pictures = [np.clip(1.6 * one, 0, 1) for one in lit()]
    codes = [4095 / 65535 * (one if transfer == "linear" else as_srgb(one)) for one in pictures]
    folder, lights = photographs(tmp_path / "photos", codes), listed(tmp_path / "l.lp")
    report = ps.stills(folder, lights=lights, out=tmp_path / "out", transfer=transfer, white_level=4095)
    assert "They saturate at code 4095, as you say" in remarks(report)
    assert error_deg(tmp_path / "out") < 1.5
    said = " ".join(f"{one.grade}: {one.found}" for one in report.judgements if one.subject in ("exposure", "clipping"))
    assert "Every light clips: 18 to 20 % of the subject" in said
    with pytest.raises(PsvideoError, match=r"`white_level` is 70000, and shot 3.png holds codes up to 65535"):
        ps.stills(folder, lights=lights, out=tmp_path / "none", white_level=70000)


def test_what_a_file_says_of_itself_is_read(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x010F], exif[0x0110] = "Canon", "Canon EOS 5D"
    exif.get_ifd(0x8769)[0xA405] = 50
    save8(tmp_path / "a.jpg", lit()[0], exif=exif)
    told = stated_by(tmp_path / "a.jpg")
    assert told.camera == "Canon EOS 5D"
    assert told.focal_widths == pytest.approx(50 / 36)
    assert stated_by(tmp_path / "missing.jpg").transfer is None


def test_what_a_file_says_is_read_also_where_pillow_cannot_open_it(tmp_path: Path) -> None:
    """Grey with alpha in 16 bits was read as linear whatever its profile said."""
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    said = [(34675, "B", len(profile), profile, True), (274, "H", 1, 6, True), (33434, "2I", 1, (1, 50), True)]
    codes = np.zeros((8, 12, 2), np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", codes, photometric="minisblack", extrasamples=["unassalpha"], extratags=said)
    told = stated_by(tmp_path / "a.tif")
    assert (told.transfer, told.turn, told.exposure, told.longer_px) == ("srgb", EXIF[6], 0.02, 12)


def test_a_lens_is_as_long_as_the_picture_and_not_the_small_one_before_it(tmp_path: Path) -> None:
    """Pictures of chrome balls in TIFF and DNG with a preview were seen through a lens of its few pixels."""
    with tifffile.TiffWriter(tmp_path / "a.dng") as file:
        lens = [(0xA405, "H", 1, 72, True)]
        file.write(np.zeros((16, 24, 3), np.uint8), photometric="rgb", subifds=1, subfiletype=1, extratags=lens)
        filters = [(33421, "H", 2, (2, 2), True), (33422, "B", 4, (0, 1, 1, 2), True)]
        file.write(np.full((64, 96), 500, np.uint16), photometric=32803, extratags=filters)
    assert stated_by(tmp_path / "a.dng").focal_px == 192.0


def test_a_profile_that_is_damaged_takes_neither_orientation_nor_exposure_with_it(tmp_path: Path) -> None:
    tag = b"para\0\0\0\0" + struct.pack(">HH3i", 1, 0, 65536, 0, 65536)  # a = 0: divided by
    profile = bytes(128) + struct.pack(">I4sII", 1, b"rTRC", 144, len(tag)) + tag
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 6
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.ExposureTime] = 0.5
    Image.new("RGB", (8, 6)).save(tmp_path / "a.jpg", exif=exif, icc_profile=profile)
    said = stated_by(tmp_path / "a.jpg")
    assert (said.turn, said.exposure, said.longer_px, said.transfer) == (EXIF[6], 0.5, 8, None)


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
