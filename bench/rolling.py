"""A turning fan under continuous light and under flashes: what a rolling shutter does to it."""

import tempfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenEXR
import tomlkit
from numpy.typing import NDArray

import psvideo as ps
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.scene import read_scene
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.stage import Stage, set_stage
from psvideo.synth.subject.shading import flash_plate
from psvideo.synth.truth import as_seen

Picture = NDArray[np.float32]
LIGHT = "key"
SIZE_PX = 144
STEP_S = 0.25e-3
"""Between the instants at which the fan is rendered for a continuous light."""
FRAME = 12
BANDS = 10
TIP_PX = 0.2 / 0.5 * SIZE_PX
"""How far from the hub the blades end."""
EDGE_PX = 6


class Line(NamedTuple):
    """How far apart in time the first and the last row show the fan (a straight line through bands of rows), what that
    makes of it, and peak signal to noise against the fan frozen at the middle."""

    light: str
    turns_a_minute: int
    rows_apart_ms: float
    skew_deg: float
    skew_at_tips_px: float
    psnr_db: float


def rows() -> Iterator[Line]:
    """Film the fan of the repository at two speeds under both kinds of light."""
    for turns in (720, 120):
        with tempfile.TemporaryDirectory() as temporary:
            scene = scene_at(turns, Path(temporary))
            stage = set_stage(read_scene(scene), builtin_scene("fan").parent)
            for what, shutter_deg in (("continuous, 360 degrees", 360.0), ("continuous, 11 degrees", 11.0)):
                yield _line(what, turns, stage, *continuous(stage, shutter_deg))
            yield _line("flash of 0.3 ms", turns, stage, *flashed(scene, Path(temporary)))


def scene_at(turns: int, folder: Path, *, frames: int = 20) -> Path:
    """Write the fan smaller, without noise, ambient light and faults of its clock, at so many turns a minute."""
    scene = tomlkit.parse(builtin_scene("fan").read_text(encoding="utf-8")).unwrap()
    scene["camera"] |= {"width_px": SIZE_PX, "height_px": SIZE_PX, "full_well_e": 0.0}
    scene["strobe"] = {"flash_s": 0.0003}
    scene["ambient"] = {"level": 0.0}
    scene["frames"] = frames
    scene["object"][0]["motion"]["spin_deg_per_s"] = 6.0 * turns
    path = folder / f"fan{turns}.toml"
    path.write_text(tomlkit.dumps(scene), encoding="utf-8")
    return path


def continuous(stage: Stage, shutter_deg: float) -> tuple[Picture, float]:
    """Return a frame as a rolling shutter takes it under a light that stays on, and the middle of its exposure."""
    camera = stage.plan.camera
    exposure_s = shutter_deg / 360.0 * camera.frame_period_s
    opens_s = FRAME * camera.frame_period_s + camera.row_offsets_s()
    count = int((opens_s.max() + exposure_s - opens_s.min()) / STEP_S)
    instants_s = opens_s.min() + STEP_S * (np.arange(count) + 0.5)
    total = np.zeros((camera.height_px, camera.width_px, 3), np.float32)
    within = (instants_s[:, None] >= opens_s) & (instants_s[:, None] < opens_s + exposure_s)
    for time_s, lit in zip(instants_s, within, strict=True):
        if lit.any():
            total[lit] += frozen(stage, float(time_s))[lit]
    return total / within.sum(axis=0)[:, None, None], float(opens_s.mean() + 0.5 * exposure_s)


def frozen(stage: Stage, time_s: float) -> Picture:
    """Return the scene at one instant under the light, as strong as in its flash."""
    flash = next(one for one in stage.plan.flashes if LIGHT in one.lit)
    image = flash_plate(stage.view(time_s), stage.rig, {LIGHT: 1.0}, flash.duration_s, Emission(rise_s=0.0, fall_s=0.0))
    return np.asarray(as_seen(image, stage.scene.camera.channels), np.float32)


def flashed(scene: Path, folder: Path) -> tuple[Picture, float]:
    """Return the light's plate of the same moment, rebuilt from a clip of the scene, and when it flashed."""
    clip = ps.shoot(scene, folder / "clip", force=True).path
    ps.split(clip, out=folder / "plates", force=True)
    found = []
    for file in sorted((folder / "plates" / LIGHT).iterdir()):
        with OpenEXR.File(str(file)) as read:
            found.append((np.asarray(read.channels()["RGB"].pixels, np.float32), read.header()["psvideo:time_s"]))
    return found[len(found) // 2][0], float(found[len(found) // 2][1])


def _line(what: str, turns: int, stage: Stage, picture: Picture, time_s: float) -> Line:
    around_s: NDArray[np.float64] = np.arange(-28.0, 29.0) * STEP_S
    views = np.stack([frozen(stage, time_s + float(since_s)) for since_s in around_s])
    bands = _bands(views)
    lags_s = [_lag_s(views[:, band], picture[band], around_s) for band in bands]
    per_row_s = float(np.polyfit([0.5 * (band.start + band.stop) for band in bands], lags_s, 1)[0])
    apart_s = per_row_s * SIZE_PX
    skew_deg = 6.0 * turns * apart_s
    inner = np.s_[EDGE_PX:-EDGE_PX, EDGE_PX:-EDGE_PX]
    there = views[len(views) // 2][inner]
    return Line(
        light=what,
        turns_a_minute=turns,
        rows_apart_ms=round(1e3 * apart_s, 2),
        skew_deg=round(skew_deg, 1),
        skew_at_tips_px=round(np.deg2rad(skew_deg) * TIP_PX, 1),
        psnr_db=round(float(10 * np.log10(there.max() ** 2 / np.mean((picture[inner] - there) ** 2))), 1),
    )


def _bands(views: NDArray[np.float32]) -> list[slice]:
    """Return bands of rows over what turns, from the first row to the last."""
    turning = np.flatnonzero(np.ptp(views, axis=0).max(axis=(1, 2)) > 0.1 * views.max())
    edges = np.linspace(turning[0], turning[-1] + 1, BANDS + 1).astype(int)
    return [slice(first, last) for first, last in pairwise(edges.tolist())]


def _lag_s(views: NDArray[np.float32], shown: Picture, around_s: NDArray[np.float64]) -> float:
    """Return how much later than the middle a band shows the fan: where it is most like it, to a part of a step."""
    apart = np.mean((views - shown) ** 2, axis=(1, 2, 3))
    best = int(np.clip(apart.argmin(), 1, len(apart) - 2))
    before, here, after = apart[best - 1 : best + 2]
    return float(around_s[best] + 0.5 * STEP_S * (before - after) / (before - 2 * here + after))
