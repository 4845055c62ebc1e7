"""Photographs of a still scene, one per light: read, paired with their lights and solved, without a plan."""

import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np
import OpenEXR
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image
from still_pictures import (
    LIGHTS,
    NAMES,
    SIZE,
    Picture,
    as_srgb,
    ball,
    error_deg,
    facing,
    listed,
    lit,
    photographs,
    remarks,
    save8,
)

import psvideo as ps
from psvideo.clip.decode import tiff
from psvideo.clip.decode.decoders import decode
from psvideo.errors import PsvideoError

Item = TypeVar("Item")


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


@pytest.mark.parametrize("shape", [(4, 6000), (2000, 4)])
def test_narrow_strips_are_solved(shape: tuple[int, int], tmp_path: Path) -> None:
    folder = photographs(tmp_path / "photos", [facing(light, shape) for light in LIGHTS])
    ps.stills(folder, lights=listed(tmp_path / "lights.lp"), out=tmp_path / "out", transfer="linear")
    normals = decode("exr", next((tmp_path / "out" / "normals").glob("*.exr"))).codes
    assert np.abs(normals[..., 2] - 1).max() < 0.01


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
