"""Photographs of a matte ball, one per light, written as users have them, and how far a result is from the ball."""

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from angles import angles_deg
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from psvideo.clip.decode.decoders import decode

SIZE, RADIUS = 64, 27
ANGLES = np.radians(np.arange(0, 360, 60))
LIGHTS = np.stack([0.5 * np.cos(ANGLES), 0.5 * np.sin(ANGLES), np.full(6, np.sqrt(0.75))], axis=1)
NAMES = [f"shot {n}" for n in (3, 7, 8, 20, 21, 22)]
Picture = NDArray[np.float64]


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
    return float(angles_deg(normals, true)[middle].mean())


def remarks(report: object) -> str:
    assert hasattr(report, "shot")
    return str(report.shot["Remarks"])


def facing(light: NDArray[np.float64], shape: tuple[int, int]) -> Picture:
    """A wall that faces the camera, with a little noise of its own, so that no picture is another's copy."""
    noise = np.random.default_rng(int(1000 * light[0] + 2000) + int(1000 * light[1])).normal(0, 0.0005, (*shape, 3))
    return np.asarray(0.8 * light[2] + noise)


def with_exposures(folder: Path, pictures: Sequence[Picture], seconds: Sequence[float]) -> Path:
    """Write pictures, the seventh named dark, with what EXIF says of their exposure; nothing at 0 seconds."""
    folder.mkdir()
    for name, picture, time_s in zip([*NAMES, "dark"], pictures, seconds, strict=False):
        exif = Image.Exif()
        if time_s:
            exif.get_ifd(0x8769)[0x829A] = time_s
        save8(folder / f"{name}.jpg", as_srgb(picture), exif=exif, quality=98)
    return folder


def chunk(name: bytes, data: bytes) -> PngInfo:
    info = PngInfo()
    info.add(name, data)
    return info
