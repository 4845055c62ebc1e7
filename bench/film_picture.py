"""Make docs/pictures/gallery_turning.png, whole maps over time: ``python -m bench.film_picture``."""

import tempfile
import tomllib
from pathlib import Path

import cv2
import numpy as np
import tomlkit
from docs.figures.staging import PICTURES, Figure, Image, exr, figure, psvideo, row

from psvideo.model.surface import Surface
from psvideo.pictures.on_screen import normal_colours, srgb
from psvideo.pictures.relighting import relight
from psvideo.synth.scenes import builtin_scene

TURN_DEG_PER_S = 40.0
"""At 120 frames a second and five lights: a quarter of a pixel from flash to flash."""
SMALL = {"width_px": 320, "height_px": 180}
FRAMES, SHOWN = 96, 6
MIDDLE = slice(90, 230)
"""The columns around the bust."""
LAMP, FILL = (0.8, 0.35, 0.5), (-0.7, 0.3, 0.6)


def gallery_turning(folder: Path) -> Figure:
    """The demo's bust, turning: six results of one take, under two lamps that were not there, and their normals."""
    scene = tomllib.loads(builtin_scene().read_text(encoding="utf-8"))
    scene["camera"] |= SMALL
    scene["frames"] = FRAMES
    scene["object"][0] |= {"motion": {"axis": [0.0, 1.0, 0.0], "spin_deg_per_s": TURN_DEG_PER_S}}
    folder.mkdir(parents=True)
    (folder / "scene.toml").write_text(tomlkit.dumps(scene), encoding="utf-8")
    clip, out = folder / "clip", folder / "out"
    said = psvideo("synth", folder / "scene.toml", "-o", clip)
    said += psvideo("normals", clip, "--rig", clip / "rig.toml", "-o", out)
    return shown(out, said)


def shown(out: Path, said: str) -> Figure:
    """Return the picture of a folder of results."""
    count = len(sorted((out / "normals").glob("*.exr")))
    places = np.linspace(0, count - 1, SHOWN).round().astype(int)
    lit = [(f"result {place + 1}", srgb(_lit(out, place), exposure=1.5)[:, MIDDLE]) for place in places]
    seen = [("", normal_colours(exr(out / "normals", place))[:, MIDDLE]) for place in places]
    return figure([row("A bust that turns, relit result by result", *lit), row("Its normals", *seen)], said)


def _lit(out: Path, place: int) -> Image:
    normals, albedo = exr(out / "normals", place), exr(out / "albedo", place)
    surface = Surface(normals=normals, albedo=albedo, residual=None, valid=albedo.max(axis=-1) > 0)
    return relight(surface, LAMP) + relight(surface, FILL, strength=0.35, colour=(0.62, 0.8, 1.0))


def main() -> None:
    """Write the picture, and print what psvideo said."""
    with tempfile.TemporaryDirectory() as folder:
        made = gallery_turning(Path(folder) / "film")
    path = PICTURES / "gallery_turning.png"
    cv2.imwrite(str(path), made.picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])
    print(made.said)


if __name__ == "__main__":
    main()
