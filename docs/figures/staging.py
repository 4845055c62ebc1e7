"""Film the small table scene with one thing changed, run psvideo on it as a user would, and keep what it says."""

import contextlib
import io
import shutil
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import tomlkit
from numpy.typing import NDArray

from psvideo.cli.app import main
from psvideo.pictures.contact import Strip, Tile, sheet

SCENE = Path(__file__).parent / "table.toml"
PICTURES = Path(__file__).resolve().parents[1] / "pictures"
WIDTH_PX = 960
BLACK = 4096
"""The black level of the table's frames."""
Image = NDArray[np.float32]
Pixels = NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture, and all that the commands said while it was made."""

    picture: Pixels
    said: str


def film(folder: Path, changes: Mapping[str, Any] | None = None) -> Path:
    """Film the table with keys of the scene file changed (tables are merged), and return the clip.

    Without changes it is filmed once, beside ``folder``, and copied from there.
    """
    if not changes:
        table = folder.parent / "table"
        clip = table / "clip" if (table / "clip").is_dir() else film(table, {"seed": 7})
        return Path(shutil.copytree(clip, folder / "clip"))
    scene = _merged(tomllib.loads(SCENE.read_text(encoding="utf-8")), changes)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(tomlkit.dumps(scene), encoding="utf-8")
    said = psvideo("synth", folder / "scene.toml", "-o", folder / "clip")
    if not (folder / "clip").is_dir():
        raise RuntimeError(said)
    return folder / "clip"


def _merged(base: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        merged[key] = _merged(base.get(key, {}), value) if isinstance(value, Mapping) else value
    return merged


def psvideo(*words: object) -> str:
    """Run a command and return what it said, warnings and errors included, in one line."""
    heard = io.StringIO()
    with contextlib.redirect_stdout(heard), contextlib.redirect_stderr(heard):
        main([str(word) for word in words])
    return " ".join(heard.getvalue().split())


def read_picture(path: Path, how: int = cv2.IMREAD_COLOR) -> NDArray[Any]:
    """Return a picture as OpenCV reads it. Raises FileNotFoundError where none can be read."""
    picture = cv2.imread(str(path), how)
    if picture is None:
        raise FileNotFoundError(path)
    return picture


def frames(clip: Path) -> list[Image]:
    """Return the frames' codes in their order, 0 at the black level and 1 at the largest."""
    files = sorted((clip / "frames").iterdir())
    codes = [read_picture(file, cv2.IMREAD_UNCHANGED)[..., ::-1].astype(np.float32) for file in files]
    return [np.maximum((one - BLACK) / (65535 - BLACK), 0) for one in codes]


def exr(folder: Path, place: int = 0) -> Image:
    """Return one picture of a sequence."""
    return exr_file(sorted(folder.glob("*.exr"))[place])


def exr_file(path: Path) -> Image:
    """Return an EXR file's picture: its colours, or its first channel."""
    channels = OpenEXR.File(str(path)).channels()
    picture = channels["RGB"].pixels if "RGB" in channels else next(iter(channels.values())).pixels
    return np.asarray(picture, np.float32)


def row(title: str, *tiles: tuple[str, Pixels]) -> Strip:
    """Return a row of pictures with their names."""
    return Strip(title, [Tile(name, picture) for name, picture in tiles])


def figure(strips: list[Strip], said: str) -> Figure:
    """Put rows of pictures below each other."""
    return Figure(picture=sheet(strips, width_px=WIDTH_PX), said=said)
