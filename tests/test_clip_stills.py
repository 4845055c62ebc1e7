"""Still pictures: every kind comes out with the very values that went in, and damaged files are refused by name."""

import os
import struct
import subprocess
import sys
from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import imagecodecs
import numpy as np
import OpenEXR
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image, ImageCms

from psvideo.clip.decode import tiff
from psvideo.clip.decode.decoders import decode, opened, read_header
from psvideo.clip.decode.exr import read_halves
from psvideo.clip.decode.exr_chunks import is_cut_short
from psvideo.clip.decoded import PictureInFile
from psvideo.errors import PsvideoError
from psvideo.formats import exr_files

Write = Callable[[Path, NDArray[Any]], None]
RNG = np.random.default_rng(7)


def random(bits: int, channels: int, *, rows: int = 11, cols: int = 17) -> NDArray[Any]:
    shape = (rows, cols) if channels == 1 else (rows, cols, channels)
    return RNG.integers(0, 2**bits, shape).astype(np.uint8 if bits == 8 else np.uint16)


def write_png(path: Path, codes: NDArray[Any]) -> None:
    swapped = codes if codes.ndim == 2 else codes[..., [2, 1, 0, 3][: codes.shape[2]]]
    path.write_bytes(cv2.imencode(".png", swapped)[1].tobytes())


def write_tiff(**options: Any) -> Write:
    def write(path: Path, codes: NDArray[Any]) -> None:
        planar = options.get("planarconfig") == "separate"
        stored = np.moveaxis(codes, -1, 0) if planar else codes
        tifffile.imwrite(path, stored, photometric="rgb" if codes.ndim == 3 else "minisblack", **options)

    return write


def write_exr(path: Path, codes: NDArray[Any], names: str = "RGB", layer: str = "") -> None:
    channels = {f"{layer}{name}": np.ascontiguousarray(codes[..., place]) for place, name in enumerate(names)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels if codes.ndim == 3 else {f"{layer}Y": codes}).write(str(path))


def write_dpx(bits: int, *, order: str = ">", packing: int = 1) -> Write:
    """Pack a DPX file byte by byte, as SMPTE 268M lays it out."""

    def write(path: Path, codes: NDArray[Any]) -> None:
        rows, cols = codes.shape[:2]
        head = bytearray(b"\xff" * 2048)
        head[:4] = b"SDPX" if order == ">" else b"XPDS"
        struct.pack_into(order + "I", head, 4, 2048)
        head[8:16] = b"V1.0\0\0\0\0"
        struct.pack_into(order + "HHII", head, 768, 0, 1, cols, rows)
        head[800:804] = bytes([50 if codes.ndim == 3 else 6, 2, 2, bits])
        struct.pack_into(order + "HHIII", head, 804, 0 if bits in (8, 16) else packing, 0, 2048, 0, 0)
        struct.pack_into(order + "I", head, 1920, 0x01020304)
        path.write_bytes(bytes(head) + _dpx_data(codes.reshape(rows, -1).astype(np.uint32), bits, order, packing))

    return write


def _dpx_data(samples: NDArray[np.uint32], bits: int, order: str, packing: int) -> bytes:
    if bits == 8:
        return samples.astype("u1").tobytes()
    if bits in (12, 16):
        return (samples << (4 if bits == 12 and packing == 1 else 0)).astype(order + "u2").tobytes()
    padded = np.pad(samples, ((0, 0), (0, -samples.shape[1] % 3))).reshape(len(samples), -1, 3)
    words = padded[..., 0] << 20 | padded[..., 1] << 10 | padded[..., 2]
    packed: bytes = (words << (2 if packing == 1 else 0)).astype(order + "u4").tobytes()
    return packed


LAYOUTS: dict[str, dict[str, Any]] = {
    "plain": {},
    "strips": {"rowsperstrip": 4},
    "tiles": {"tile": (16, 16)},
    "zip": {"compression": "zlib", "predictor": True},
    "lzw": {"compression": "lzw"},
    "planes": {"planarconfig": "separate"},
    "big-endian": {"byteorder": ">"},
}
EXACT = [
    pytest.param("png", 8, 3, write_png, id="png-8-rgb"),
    pytest.param("png", 16, 3, write_png, id="png-16-rgb"),
    pytest.param("png", 8, 1, write_png, id="png-8-grey"),
    pytest.param("png", 16, 1, write_png, id="png-16-grey"),
    *(
        pytest.param("tiff", bits, channels, write_tiff(**options), id=f"tiff-{bits}-{channels}-{name}")
        for name, options in LAYOUTS.items()
        for bits in (8, 16)
        for channels in (1, 3)
        if (name, channels) != ("planes", 1)
    ),
    *(
        pytest.param(
            "dpx",
            bits,
            channels,
            write_dpx(bits, order=order, packing=packing),
            id=f"dpx-{bits}-{channels}-{order}{packing}",
        )
        for bits in (8, 10, 12, 16)
        for channels in (1, 3)
        for order in "><"
        for packing in (1, 2)
        if (bits, channels) != (10, 1)  # FFmpeg fills words of one channel from the low end; held to that below
    ),
]


@pytest.mark.parametrize(("kind", "bits", "channels", "write"), EXACT)
def test_integer_pictures_come_out_with_every_bit(
    tmp_path: Path, kind: str, bits: int, channels: int, write: Write
) -> None:
    codes = random(bits, channels)
    file = tmp_path / "x.0001"
    write(file.with_suffix(".img"), codes)
    picture = decode(kind, file.with_suffix(".img"))
    assert np.array_equal(picture.codes, codes)
    head = picture.header
    assert (head.width_px, head.height_px, head.channels, head.bits) == (17, 11, channels, bits)
    assert read_header(kind, file.with_suffix(".img")) == head


@pytest.mark.parametrize("kind", ["exr", "tiff"])
@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("channels", [1, 3])
def test_floating_point_pictures_come_out_as_they_are(tmp_path: Path, kind: str, dtype: type, channels: int) -> None:
    codes: NDArray[Any] = (random(16, channels) / 9000 - 0.1).astype(dtype)
    (write_exr if kind == "exr" else write_tiff())(tmp_path / "x.1", codes)
    picture = decode(kind, tmp_path / "x.1")
    assert np.array_equal(picture.codes, codes)
    assert picture.codes.dtype == dtype, "a frame in half floats takes half the memory"
    assert picture.header.bits is None
    assert read_header(kind, tmp_path / "x.1") == picture.header


def test_exr_channels_are_found_in_a_layer_and_beside_alpha(tmp_path: Path) -> None:
    codes = (random(16, 4) / 65535).astype(np.float32)
    write_exr(tmp_path / "layer.exr", codes[..., :3], layer="beauty.")
    assert np.array_equal(decode("exr", tmp_path / "layer.exr").codes, codes[..., :3])
    write_exr(tmp_path / "alpha.exr", codes, names="RGBA")
    alpha = decode("exr", tmp_path / "alpha.exr")
    assert np.array_equal(alpha.codes, codes[..., :3])
    assert (alpha.header.warnings, alpha.header.notes) == ((), ("the EXR files' alpha channel is left out",))


def test_exr_of_several_layers_or_none_is_refused(tmp_path: Path) -> None:
    planes = {name: np.zeros((4, 5), np.float32) for name in ("a.Y", "b.Y")}
    OpenEXR.File({}, planes).write(str(tmp_path / "two.exr"))
    with pytest.raises(PsvideoError, match=r"two\.exr: holds more than one layer \(channels a\.Y, b\.Y\)"):
        decode("exr", tmp_path / "two.exr")
    OpenEXR.File({}, {"Z": planes["a.Y"]}).write(str(tmp_path / "depth.exr"))
    with pytest.raises(PsvideoError, match="neither Y nor R, G, B"):
        read_header("exr", tmp_path / "depth.exr")


def write_parts(path: Path, **parts: Mapping[str, NDArray[Any]]) -> Path:
    OpenEXR.File([OpenEXR.Part({}, dict(planes), name) for name, planes in parts.items()]).write(str(path))
    return path


def test_an_exr_s_picture_is_found_in_a_later_part_where_the_first_shows_none(tmp_path: Path) -> None:
    depth = {"Z": np.full((4, 5), 7, np.float32)}
    low, high = (random(16, 3)[:4, :5].astype(np.float32) / 65535 for _ in range(2))
    in_layer = {f"rgba.{name}": np.ascontiguousarray(low[..., place]) for place, name in enumerate("RGB")}
    first = {name: np.ascontiguousarray(high[..., place]) for place, name in enumerate("RGB")}
    later = write_parts(tmp_path / "later.exr", depth=depth, rgba=in_layer)
    assert read_header("exr", later).channels == 3
    assert np.array_equal(decode("exr", later).codes, low)
    assert np.array_equal(np.stack(read_halves(later).planes, axis=-1), low)
    both = write_parts(tmp_path / "both.exr", beauty=first, rgba=in_layer)
    assert np.array_equal(decode("exr", both).codes, high), "the first part goes before the others"
    two = write_parts(tmp_path / "two.exr", depth=depth, beauty=first, rgba=in_layer)
    with pytest.raises(PsvideoError, match=r"more than one picture \(channels B, G, R, Z, rgba\.B"):
        decode("exr", two)
    none = write_parts(tmp_path / "none.exr", depth=depth, far={"far.Z": depth["Z"]})
    with pytest.raises(PsvideoError, match=r"neither Y nor R, G, B \(channels Z, far\.Z\)"):
        read_header("exr", none)


def test_exr_data_window_is_put_in_its_place_in_the_display_window(tmp_path: Path) -> None:
    codes = np.arange(1, 7, dtype=np.float32).reshape(2, 3)
    windows = {
        "displayWindow": (np.array([10, 20], np.int32), np.array([15, 24], np.int32)),
        "dataWindow": (np.array([11, 22], np.int32), np.array([13, 23], np.int32)),
    }
    OpenEXR.File({"type": OpenEXR.scanlineimage, **windows}, {"Y": codes}).write(str(tmp_path / "x.exr"))
    expected = np.zeros((5, 6), np.float32)
    expected[2:4, 1:4] = codes
    assert np.array_equal(decode("exr", tmp_path / "x.exr").codes, expected)


@pytest.mark.parametrize("compression", ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB"])
@pytest.mark.parametrize("rows", [1, 16, 33, 300])
def test_an_exr_of_any_compression_is_whole_until_a_byte_is_missing(
    tmp_path: Path, compression: str, rows: int
) -> None:
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION"), "type": OpenEXR.scanlineimage}
    pixels = RNG.uniform(0, 1, (rows, 20)).astype(np.float16)
    OpenEXR.File(header, {"Y": pixels}).write(str(tmp_path / "x.exr"))
    assert not is_cut_short(tmp_path / "x.exr")
    data = (tmp_path / "x.exr").read_bytes()
    for size in (len(data) - 1, len(data) // 2, 300, 50):
        (tmp_path / "x.exr").write_bytes(data[:size])
        assert is_cut_short(tmp_path / "x.exr")


def test_a_large_plain_tiff_stays_in_its_file_with_every_bit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever else a TIFF may be (packed, in planes, of the other byte order) is decoded as any other."""
    plain: list[dict[str, Any]] = [{}, {"rowsperstrip": 3}]
    others: list[dict[str, Any]] = [{"compression": "zlib"}, {"planarconfig": "separate"}, {"byteorder": ">"}]
    monkeypatch.setattr(tiff, "STAYS_FROM_BYTES", 1)
    monkeypatch.setattr(tiff, "OF_CLIP_STAYS_FROM_BYTES", 1)
    for options, channels, of_clip in product([*plain, *others], (1, 3), (False, True)):
        picture, path = random(16, channels), tmp_path / "picture.tif"
        write_tiff(**options if channels == 3 else {k: v for k, v in options.items() if k != "planarconfig"})(
            path, picture
        )
        found = opened("tiff", path, of_clip=of_clip)
        assert found.codes.shape == picture.shape
        assert found.codes.dtype == picture.dtype
        assert np.array_equal(found.codes, picture)
        assert np.array_equal(found.codes[3:9], picture[3:9])
        in_file = options in plain or (channels == 1 and "planarconfig" in options)
        assert isinstance(found, PictureInFile) == in_file, options
        if isinstance(found, PictureInFile):
            rows = np.array([2, 3, 8, 10])
            assert np.array_equal(found.codes.some(rows)[rows - 2], picture[rows])
        assert np.array_equal(decode("tiff", path).codes, picture)


@pytest.mark.parametrize("of_clip", [False, True], ids=["photograph", "frame"])
@pytest.mark.parametrize("change", ["cut short", "written again", "gone"])
def test_a_picture_that_stays_in_its_file_is_refused_once_the_file_is_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str, of_clip: bool
) -> None:
    """A clip's frame stays open: of one that is deleted the system keeps what is read."""
    monkeypatch.setattr(tiff, "STAYS_FROM_BYTES", 1)
    monkeypatch.setattr(tiff, "OF_CLIP_STAYS_FROM_BYTES", 1)
    path, picture = tmp_path / "picture.tif", random(16, 3)
    write_tiff()(path, picture)
    codes = opened("tiff", path, of_clip=of_clip).codes
    if change == "cut short":
        os.truncate(path, 300)
    elif change == "written again":
        path.write_bytes(path.read_bytes())
        os.utime(path, ns=(0, 0))
    else:
        path.unlink()
    if change == "gone" and of_clip and sys.platform != "win32":
        assert np.array_equal(codes[3:9], picture[3:9])
        return
    with pytest.raises(PsvideoError, match=r"picture\.tif: (was changed|cannot be read any more)"):
        codes[3:9]


def test_png_alpha_is_left_out_with_a_note(tmp_path: Path) -> None:
    codes = random(16, 4)
    write_png(tmp_path / "x.png", codes)
    picture = decode("png", tmp_path / "x.png")
    assert np.array_equal(picture.codes, codes[..., :3])
    assert (picture.header.warnings, picture.header.notes) == ((), ("the PNG files' alpha channel is left out",))


def test_dpx_grey_of_ten_bits_is_filled_from_the_low_end(tmp_path: Path) -> None:
    codes = random(10, 1, cols=18)
    write_dpx(10)(tmp_path / "x.dpx", codes.reshape(11, 6, 3)[..., ::-1].reshape(11, 18))
    assert np.array_equal(decode("dpx", tmp_path / "x.dpx").codes, codes)


def test_dpx_shows_its_time_code(tmp_path: Path) -> None:
    write_dpx(16)(tmp_path / "x.dpx", random(16, 3))
    assert read_header("dpx", tmp_path / "x.dpx").time_code == "01:02:03:04"


@pytest.mark.parametrize("code", ["01:00:59:23", "01:00:59;23"])
def test_exr_shows_its_time_code_and_whether_it_drops_frames(tmp_path: Path, code: str) -> None:
    exr_files.write_exr(tmp_path / "x.exr", {"Y": np.zeros((4, 5), np.float32)}, time_code=code)
    assert read_header("exr", tmp_path / "x.exr").time_code == code


@pytest.mark.parametrize("channels", [1, 3])
def test_jpeg_is_read_with_a_warning(tmp_path: Path, channels: int) -> None:
    smooth = np.tile(np.linspace(0, 250, 64).astype(np.uint8), (48, 1))
    codes = smooth if channels == 1 else np.stack([smooth, smooth[:, ::-1], smooth // 2], axis=-1)
    (tmp_path / "x.jpg").write_bytes(
        imagecodecs.jpeg8_encode(codes, level=98, subsampling="444" if channels == 3 else None)
    )
    picture = decode("jpeg", tmp_path / "x.jpg")
    assert np.abs(picture.codes.astype(int) - codes).max() <= 4
    assert picture.header == read_header("jpeg", tmp_path / "x.jpg")
    assert "lossy" in picture.header.warnings[0]


def write_jpeg(path: Path, codes: NDArray[Any]) -> None:
    path.write_bytes(imagecodecs.jpeg8_encode((codes >> 8).astype(np.uint8)))


DAMAGED = {
    "png": write_png,
    "tiff": write_tiff(),
    "tiff-zip": write_tiff(compression="zlib"),
    "tiff-strips": write_tiff(rowsperstrip=3),
    "tiff-directory_at_end": lambda path, codes: path.write_bytes(cv2.imencode(".tif", codes)[1].tobytes()),
    "exr": lambda path, codes: write_exr(path, codes.astype(np.float32)),
    "dpx": write_dpx(16),
    "jpeg": write_jpeg,
}


@pytest.mark.parametrize("kept", ["nothing", "a few bytes", "half", "all but the end"])
@pytest.mark.parametrize("name", DAMAGED)
def test_truncated_pictures_are_refused_by_name(
    tmp_path: Path, name: str, kept: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Told from the header alone, too, and with nothing written to the terminal by a library."""
    file = tmp_path / "shot.0007.img"
    DAMAGED[name](file, random(16, 3, rows=60, cols=50))
    whole = file.read_bytes()
    size = {"nothing": 0, "a few bytes": 20, "half": len(whole) // 2, "all but the end": len(whole) - 60}[kept]
    file.write_bytes(whole[:size])
    for read in (decode, read_header):
        with pytest.raises(PsvideoError, match=r"shot\.0007\.img: .*(empty|truncated|begin like)") as raised:
            read(name.split("-")[0], file)
        assert "\n" not in str(raised.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
@pytest.mark.parametrize("progressive", [False, True])
@pytest.mark.parametrize("grey", [False, True])
def test_a_jpeg_that_breaks_off_and_has_an_end_marker_all_the_same_is_refused(
    tmp_path: Path, grey: bool, progressive: bool, share: float, capfd: pytest.CaptureFixture[str]
) -> None:
    """As programs close files that they could not fetch to the end; what is black at the bottom is whole."""
    codes = np.random.default_rng(0).integers(40, 200, (120, 160, 3)).astype(np.uint8)
    codes[60:] //= 4
    codes[100:] = 0
    file = tmp_path / "shot.jpg"
    Image.fromarray(codes[..., 0] if grey else codes).save(file, quality=90, progressive=progressive)
    assert decode("jpeg", file).codes.shape[:2] == (120, 160)
    whole = file.read_bytes()
    begin = whole.index(b"\xff\xda")
    file.write_bytes(whole[: begin + int((len(whole) - begin) * share)] + b"\xff\xd9")
    with pytest.raises(PsvideoError, match=r"shot\.jpg: its picture breaks off .* Copy it again"):
        decode("jpeg", file)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["png", "exr", "tiff-zip"])
def test_damage_inside_a_picture_is_refused_where_the_kind_can_tell(tmp_path: Path, name: str) -> None:
    file = tmp_path / "shot.0007.img"
    DAMAGED[name](file, (np.add.outer(np.arange(60), np.arange(50))[..., None] * [300, 200, 100]).astype(np.uint16))
    data = bytearray(file.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 40] = bytes(byte ^ 0x5A for byte in data[middle : middle + 40])
    file.write_bytes(data)
    with pytest.raises(PsvideoError, match=r"shot\.0007\.img"):
        decode(name.split("-")[0], file)


def test_a_strip_of_no_bytes_is_not_taken_for_black(tmp_path: Path) -> None:
    write_tiff(rowsperstrip=5)(tmp_path / "x.tif", random(16, 1, rows=20))
    with tifffile.TiffFile(tmp_path / "x.tif", mode="r+") as file:
        counts = file.pages.first.tags["StripByteCounts"]
        counts.overwrite([*counts.value[:2], 0, counts.value[3]])
    with pytest.raises(PsvideoError, match="1 of its 4 strips"):
        decode("tiff", tmp_path / "x.tif")


@pytest.mark.parametrize("harm", [lambda data: data.replace(b"\r\n", b"\n", 1), lambda data: data[:20]])
def test_a_png_whose_beginning_is_damaged_is_not_told_to_be_called_one(
    tmp_path: Path, harm: Callable[[bytes], bytes]
) -> None:
    whole = imagecodecs.png_encode(np.zeros((8, 8), np.uint8))
    (tmp_path / "x.png").write_bytes(harm(bytes(whole)))
    with pytest.raises(PsvideoError, match=r"truncated or damaged.*Copy it again\."):
        decode("png", tmp_path / "x.png")


def test_kinds_of_content_that_are_not_read_say_what_is(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "deep.tif", np.zeros((4, 4), np.uint32))
    with pytest.raises(PsvideoError, match="samples of 32 bits"):
        decode("tiff", tmp_path / "deep.tif")
    tifffile.imwrite(tmp_path / "stack.tif", np.zeros((3, 8, 8), np.uint16), photometric="minisblack")
    with pytest.raises(PsvideoError, match="holds 3 pictures"):
        decode("tiff", tmp_path / "stack.tif")
    tifffile.imwrite(tmp_path / "white.tif", np.zeros((8, 8), np.uint16), photometric="miniswhite")
    with pytest.raises(PsvideoError, match="MINISWHITE"):
        decode("tiff", tmp_path / "white.tif")
    (tmp_path / "x.png").write_bytes(imagecodecs.jpeg8_encode(np.zeros((8, 8), np.uint8)))
    with pytest.raises(PsvideoError, match=r"does not begin like a PNG file, but like JPEG\. Give it the ending \.jpg"):
        decode("png", tmp_path / "x.png")


@pytest.mark.parametrize(
    ("mode", "said"),
    [("1", "no more than 2 shades of grey"), ("P", "no more than 256 colours"), ("L", None), ("RGB", None)],
)
def test_pngs_of_few_shades_are_read_with_a_warning(tmp_path: Path, mode: str, said: str | None) -> None:
    ramp = np.repeat(np.arange(0, 256, 4)[None], 8, axis=0).astype(np.uint8)
    Image.fromarray(ramp).convert(mode).save(tmp_path / "x.png")
    found = read_header("png", tmp_path / "x.png").warnings
    assert [said is not None and said in warning for warning in found] == [True] * (said is not None)


def test_what_a_library_remarks_on_odd_profiles_stays_off_the_terminal(tmp_path: Path) -> None:
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    Image.new("L", (8, 8)).save(tmp_path / "x.png", icc_profile=profile)
    code = (
        f"from psvideo.clip.decode import png; from pathlib import Path; png.decode(Path({str(tmp_path / 'x.png')!r}))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stderr == ""


def test_a_jpeg_for_printing_is_refused_as_such(tmp_path: Path) -> None:
    Image.new("CMYK", (16, 16)).save(tmp_path / "x.jpg")
    with pytest.raises(PsvideoError, match=r"x\.jpg: has 4 channels \(CMYK, for printing\) of 8 bits; expected grey"):
        read_header("jpeg", tmp_path / "x.jpg")


@pytest.mark.parametrize(("start", "name"), [(b"\0\0\0\x18ftypheic", "HEIC"), (b"RIFF\0\0\0\0WEBP", "WebP")])
def test_a_phone_s_picture_under_another_ending_is_named(tmp_path: Path, start: bytes, name: str) -> None:
    (tmp_path / "x.jpg").write_bytes(start + bytes(100))
    with pytest.raises(PsvideoError, match=f"like a JPEG file, but like {name}, which is not read"):
        read_header("jpeg", tmp_path / "x.jpg")


def test_an_exr_whose_colour_is_in_differences_says_that_it_is_read_as_grey(tmp_path: Path) -> None:
    planes = {name: np.full((8, 8), 0.25, np.float16) for name in ("Y", "RY", "BY")}
    OpenEXR.File({"type": OpenEXR.scanlineimage}, planes).write(str(tmp_path / "x.exr"))
    (warning,) = read_header("exr", tmp_path / "x.exr").warnings
    assert "(RY, BY)" in warning
