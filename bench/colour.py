"""Flashes of several colours: crosstalk, and standing and moving scenes against one white light per flash."""

import copy
import json
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import OpenEXR
import tomlkit

import psvideo as ps
from bench.accuracy_measure import angles_deg
from psvideo.formats.rig_toml import read_rig
from psvideo.runs.calibrate.colours import colours
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.scene import read_scene
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.stage import set_stage
from psvideo.synth.subject.shading import flash_plate

CROSSTALK_BAR = 0.01
AS_GOOD = 1.25
"""A standing scene's error, in shares of that under white lights: taking colours apart raises noise a little."""
WITHIN_DEG = 10.0
EDGE_PX = 3
SPIN_DEG_PER_S = 60.0
FLASH_S = 0.0003
"""Of the fan: longer ones blur its blades."""
GREY = {"pattern": "constant", "colour": 0.5}


class Line(NamedTuple):
    """One comparison; what stands under ``colours`` and ``white`` is said in ``measure``."""

    scene: str
    measure: str
    colours: str
    white: str
    bar: str
    met: bool


def rows() -> Iterator[Line]:
    """Film every scene twice, under coloured lamps and under white ones of the same light, and solve both."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rig = _measured_rig(folder)
        scene = scene_of("colour", 160)
        yield _crosstalk(scene, folder, rig)
        yield _standing(scene, folder, rig)
        yield _turning(scene, folder, rig)
        yield _moving("fan, 720 turns a minute, painted grey", fan_scene(grey=True), folder, rig)
        yield _moving("fan, 720 turns a minute, in its own colours", fan_scene(grey=False), folder, rig)


def scene_of(name: str, width_px: int) -> dict[str, Any]:
    """Return a scene of the repository, smaller and shorter."""
    scene: dict[str, Any] = tomlkit.parse(builtin_scene(name).read_text(encoding="utf-8")).unwrap()
    camera = scene["camera"]
    camera["height_px"] = round(camera["height_px"] * width_px / camera["width_px"])
    camera["width_px"] = width_px
    scene["frames"] = 24
    return scene


def fan_scene(*, grey: bool) -> dict[str, Any]:
    """Return the fan under the lamps of the scene of colours."""
    fan, coloured = scene_of("fan", 144), scene_of("colour", 144)
    fan["frames"], fan["ambient"] = 20, {"level": 0.0}
    fan["light"] = coloured["light"]
    fan["strobe"] = {"clock_offset_ppm": 62.0, "dark_every": 4, "flash": coloured["strobe"]["flash"]}
    for flash in fan["strobe"]["flash"]:
        flash["duration_s"] = FLASH_S
    if grey:
        fan["object"][0]["albedo"] = fan["object"][2]["albedo"] = GREY
    return fan


def white_scene(scene: dict[str, Any]) -> dict[str, Any]:
    """Return a scene whose lamps flash white, one after the other, each as strong as its three LEDs together."""
    white = copy.deepcopy(scene)
    lamps: dict[str, dict[str, Any]] = {}
    for light in scene["light"]:
        name = light["name"].split("_")[0]
        lamp = lamps.setdefault(name, {"name": name, "direction": light["direction"], "intensity": np.zeros(3)})
        lamp["intensity"] = lamp["intensity"] + light["intensity"] * np.array(light["colour"])
    white["light"] = [lamp | {"intensity": lamp["intensity"].tolist()} for lamp in lamps.values()]
    strobe = white["strobe"]
    duration_s = strobe.pop("flash")[0]["duration_s"]
    white["strobe"] = strobe | {"flash_s": duration_s}
    return white


def filmed(scene: dict[str, Any], path: Path) -> Path:
    """Film a scene, and return the clip."""
    path.with_suffix(".toml").write_text(tomlkit.dumps(scene), encoding="utf-8")
    return ps.shoot(path.with_suffix(".toml"), path, force=True).path


def _measured_rig(folder: Path) -> Path:
    """Film a white card under one LED after the other, and measure their colours."""
    scene = scene_of("colour", 160)
    scene["strobe"] = {"flash_s": 0.0008}
    scene["object"] = [{"mesh": "plane", "scale": 4.0, "albedo": 0.6}]
    card = filmed(scene, folder / "card")
    colours(card, rig=card / "rig.toml", out=folder / "rig.toml", albedo=0.6)
    return folder / "rig.toml"


def _crosstalk(scene: dict[str, Any], folder: Path, rig: Path) -> Line:
    """Take the plates of a standing bust apart, and look for every other lamp's light in them."""
    clip = filmed(scene, folder / "standing")
    ps.split(clip, rig=rig, out=folder / "plates", force=True)
    stage = set_stage(read_scene(folder / "standing.toml"), folder)
    assert stage.still is not None
    truths, plates = [], []
    for lamp in sorted({light["name"].split("_")[0] for light in scene["light"]}):
        led = read_rig(clip / "rig.toml").select([f"{lamp}_green"])[0]
        white = ps.Rig(lights=(replace(led, colour=None, intensity=(1.0,)),))
        whole = Emission(rise_s=0.0, fall_s=0.0)
        truths.append(flash_plate(stage.still, white, {led.name: 1.0}, led.reference_duration_s or 1.0, whole).ravel())
        files = sorted((folder / "plates" / lamp).glob("*.exr"))
        plates.append(np.mean([picture_of(file) for file in files], axis=0).ravel())
    basis = np.stack([*truths, np.ones_like(truths[0])], axis=1)
    held = np.linalg.lstsq(basis, np.stack(plates, axis=1), rcond=None)[0][:3].T
    left = np.abs(held - np.diag(np.diag(held))).max()
    raw = max(max(light["colour"][:c] + light["colour"][c + 1 :]) for light in scene["light"] for c in [_main(light)])
    return Line(
        scene="painted bust, standing; rig measured on a card",
        measure="light of another lamp in a plate (in the camera's own channels)",
        colours=f"{left:.2%} ({raw:.0%})",
        white="none",
        bar=f"< {CROSSTALK_BAR:.0%}",
        met=bool(left < CROSSTALK_BAR),
    )


def _main(light: dict[str, Any]) -> int:
    return int(np.argmax(light["colour"]))


def _standing(scene: dict[str, Any], folder: Path, rig: Path) -> Line:
    coloured, white = (
        _errors(one, folder / name, given, fps="round")
        for one, name, given in ((scene, "standing", rig), (white_scene(scene), "white", None))
    )
    means = [float(one.valid.mean()) for one in (coloured, white)]
    return Line(
        scene="painted bust, standing",
        measure="mean error of valid normals (share valid)",
        colours=f"{means[0]:.2f} deg ({coloured.share:.1%})",
        white=f"{means[1]:.2f} deg ({white.share:.1%})",
        bar=f"< {AS_GOOD} x white",
        met=means[0] < AS_GOOD * means[1],
    )


def _turning(scene: dict[str, Any], folder: Path, rig: Path) -> Line:
    turning = copy.deepcopy(scene) | {"frames": 16}
    (bust,) = (one for one in turning["object"] if one["mesh"] == "bust")
    bust["motion"] = {"spin_deg_per_s": SPIN_DEG_PER_S}
    coloured, white = (
        _errors(one, folder / name, given, fps="flash")
        for one, name, given in ((turning, "turning", rig), (white_scene(turning), "white_turning", None))
    )
    means = [float(one.valid.mean()) for one in (coloured, white)]
    return Line(
        scene=f"painted bust, turning {SPIN_DEG_PER_S:.0f} degrees a second",
        measure="mean error of valid normals, one result per flash (share valid)",
        colours=f"{means[0]:.2f} deg ({coloured.share:.1%})",
        white=f"{means[1]:.2f} deg ({white.share:.1%})",
        bar=f"< {AS_GOOD} x white, no fewer valid",
        met=means[0] < AS_GOOD * means[1] and coloured.share >= white.share,
    )


def _moving(what: str, scene: dict[str, Any], folder: Path, rig: Path) -> Line:
    coloured, white = (
        _errors(one, folder / name, given, fps="flash", disc=True)
        for one, name, given in ((scene, "fan", rig), (white_scene(scene), "white_fan", None))
    )
    within = [float((one.all < WITHIN_DEG).mean()) for one in (coloured, white)]
    return Line(
        scene=what,
        measure=f"blades' normals within {WITHIN_DEG:.0f} deg, one result per flash (valid: share, mean error)",
        colours=f"{within[0]:.1%} ({coloured.trusted})",
        white=f"{within[1]:.1%} ({white.trusted})",
        bar="better",
        met=within[0] > within[1],
    )


class Errors(NamedTuple):
    """Degrees by which normals are off, of all pixels that count and of valid ones, and which share these are."""

    all: np.ndarray
    valid: np.ndarray
    share: float

    @property
    def trusted(self) -> str:
        """The share of valid ones and their mean error, in words."""
        return f"{self.share:.1%}, {self.valid.mean():.1f} deg" if self.valid.size else "none"


def _errors(scene: dict[str, Any], path: Path, rig: Path | None, *, fps: str, disc: bool = False) -> Errors:
    """Film and solve a scene, and hold its normals against the truth of the flash that is nearest.

    What counts is what is seen but the wall, or ``disc``: that through which the fan's blades pass.
    """
    clip = filmed(scene, path)
    out = path.with_name(path.name + "_out")
    report = ps.normals(clip, rig=rig or clip / "rig.toml", out=out, fps=fps, force=True)
    flashes = json.loads((clip / "truth" / "timing.json").read_text(encoding="utf-8"))["flashes"]
    times_s = {one["plate"][7:]: one["start_s"] + one["duration_s"] / 2 for one in flashes if one.get("plate")}
    every, valid = [], []
    for instant, file in zip(report.instants, sorted((out / "normals").iterdir()), strict=True):
        nearest = min(times_s, key=lambda name: abs(times_s[name] - instant.time_s))
        still = clip / "truth" / "normals.exr"
        truth = picture_of(still if still.is_file() else clip / "truth" / "normals" / nearest)
        off = angles_deg(picture_of(file), truth)
        counts = _disc(truth) if disc else _bust(truth)
        measured = picture_of(out / "valid" / file.name.replace("_normals", "_valid")) > 0
        every.append(off[counts])
        valid.append(off[counts & measured])
    whole = np.concatenate(every)
    trusted = np.concatenate(valid)
    return Errors(all=whole, valid=trusted, share=trusted.size / whole.size)


def _bust(truth: np.ndarray) -> np.ndarray:
    """Return where something other than the wall is seen: what the wall adds is its noise, and most of the picture."""
    seen = np.linalg.norm(truth, axis=-1) > 0.9
    seen[:, :EDGE_PX] = seen[:, -EDGE_PX:] = False
    return np.asarray(seen & (np.abs(truth[..., 2]) < 0.999))


def _disc(truth: np.ndarray) -> np.ndarray:
    """Return the disc through which the fan's blades pass."""
    seen = np.linalg.norm(truth, axis=-1) > 0.9
    rows, cols = seen.shape
    y, x = np.mgrid[:rows, :cols]
    return np.asarray(seen & (np.hypot(x - (cols - 1) / 2, y - (rows - 1) / 2 + 0.09 * cols) < 0.3 * cols))


def picture_of(path: Path) -> np.ndarray:
    """Return an EXR file's picture."""
    channels = OpenEXR.File(str(path)).channels()
    return np.asarray(next(iter(channels.values())).pixels, np.float32)
