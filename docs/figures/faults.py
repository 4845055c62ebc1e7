"""The faults of docs/troubleshooting.md, each provoked in a virtual shoot, with what psvideo then says."""

import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from docs.figures.staging import (
    SCENE,
    WIDTH_PX,
    Figure,
    Image,
    Pixels,
    exr,
    figure,
    film,
    frames,
    psvideo,
    read_picture,
    row,
)

from psvideo.model.surface import Surface
from psvideo.pictures.on_screen import normal_colours, srgb
from psvideo.pictures.relighting import relight

BRIGHT = 1.7
"""Exposure of all pictures of frames and plates."""
STILL = ("--align", "none")
"""The table stands still, and pictures of faults should show these alone."""
LIGHTS = tomllib.loads(SCENE.read_text(encoding="utf-8"))["light"]


def shown(image: Image) -> Pixels:
    """Return a linear picture as the pages show frames and plates."""
    return srgb(image, exposure=BRIGHT)


def paint(albedo: Image) -> Pixels:
    """Return albedo as the pages show it."""
    return srgb(albedo, exposure=1.0)


def white(share: Image) -> Pixels:
    """Return shares of 0 to 1 as greys."""
    plane = share if share.ndim == 2 else share[..., 0]
    return np.repeat((255 * np.clip(plane, 0, 1)).astype(np.uint8)[..., None], 3, axis=-1)


def solved(clip: Path, *words: object) -> tuple[Path, str]:
    """Run psvideo normals on a clip; return its results and what it said."""
    out = clip.parent / "out"
    return out, psvideo("normals", clip, "--rig", clip / "rig.toml", "-o", out, *STILL, *words)


def _normals(out: Path, place: int = 0) -> Image:
    return exr(out / "normals", place)


def _plate(folder: Path, light: str = "key", place: int = 0) -> Pixels:
    return shown(exr(folder / light, place))


def _edit(path: Path, *changes: tuple[str, str]) -> None:
    text = path.read_text(encoding="utf-8")
    for pattern, new in changes:
        text = re.sub(pattern, new, text)
    path.write_text(text, encoding="utf-8")


def banding(folder: Path) -> Figure:
    """Lamps at 100 Hz mains pulse over the rows of a camera at 85 frames a second."""
    clip = film(
        folder,
        {
            "ambient": {"level": 0.25, "flicker_hz": 100.0, "flicker_depth": 0.9},
            "camera": {"fps": 85, "readout_s": 0.0108},
        },
    )
    said = psvideo("split", clip, "-o", folder / "plates")
    psvideo("split", clip, "-o", folder / "copied", "--method", "hudon2015")
    tiles = [("two frames: bands that wander", shown(frames(clip)[4])), ("", shown(frames(clip)[7]))]
    copied = ("plate by Algorithm 1 of 2015", _plate(folder / "copied"))
    return figure([row("Banding", *tiles, copied, ("plate by psvideo", _plate(folder / "plates")))], said)


def short_dark_time(folder: Path) -> Figure:
    """Flashes come 6.5 ms after each other, and every row is open for 10 ms."""
    clip = film(folder, {"strobe": {"dark_s": 0.0065}})
    out, said = solved(clip)
    seen = frames(clip)
    return figure(
        [
            row(
                "Dark time too short: bright bands, no dark row",
                *(("frame", shown(seen[5])), ("next frame", shown(seen[6]))),
                *(("normals", normal_colours(_normals(out, 1))), ("valid is white", white(exr(out / "valid", 1)))),
            )
        ],
        said,
    )


def half_shutter(folder: Path) -> Figure:
    """At 180 degrees every row is blind for half of the time."""
    clip = film(folder, {"camera": {"shutter_deg": 180.0}, "strobe": {"dark_s": 0.0101}})
    out, said = solved(clip)
    psvideo("split", clip, "-o", folder / "plates")
    seen = [("frame: a wide black band", shown(frames(clip)[5])), ("plate", _plate(folder / "plates"))]
    left = [("normals", normal_colours(_normals(out))), ("valid is white", white(exr(out / "valid")))]
    return figure(
        [
            row(
                "Shutter of 180 degrees: what one flash showed, and normals with rows of other rounds",
                *seen,
                *left,
            )
        ],
        said,
    )


def led_tails(folder: Path) -> Figure:
    """LEDs that glow on for long, and a plan that does not say so."""
    clip = film(folder, {"strobe": {"fall_s": 0.0006, "rise_s": 0.0002}, "plan": {"tails": False}})
    said = psvideo("sync", clip)
    quick, slow = (shown(frames(one)[5]) for one in (film(folder.parent / "quick"), clip))
    tiles = [("LEDs that are off at once", quick), ("slow LEDs: a soft, grey dark row", slow)]
    return figure([row("LEDs that glow on", *tiles)], said)


def swapped_lights(folder: Path) -> Figure:
    """The rig file calls the key light left, and the left one key."""
    clip = film(folder)
    right, _ = solved(clip)
    true = _normals(right)
    _edit(clip / "rig.toml", ('"key"', '"x"'), ('"left"', '"key"'), ('"x"', '"left"'))
    said = psvideo("normals", clip, "--rig", clip / "rig.toml", "-o", folder / "wrong", *STILL)
    wrong = _normals(folder / "wrong")
    albedo = exr(right / "albedo")
    good = [("right: normals", normal_colours(true)), ("lit from the right", _relit(true, albedo))]
    bad = [("exchanged: normals", normal_colours(wrong)), ("lit from the right", _relit(wrong, albedo))]
    return figure([row("The rig's key and left exchanged", *good, *bad)], said)


def _relit(normals: Image, albedo: Image, light: tuple[float, float, float] = (0.85, 0.2, 0.5)) -> Pixels:
    valid = np.linalg.norm(normals, axis=-1) > 0.5
    nothing = np.zeros(valid.shape, np.float32)
    surface = Surface(normals=normals, albedo=albedo, residual=nothing, valid=valid)
    return srgb(relight(surface, light), exposure=1.3)


def wrong_y(folder: Path) -> Figure:
    """Normals for DirectX in a program that reads them as OpenGL."""
    clip = film(folder)
    out, said = solved(clip, "--y", "down")
    down, albedo, above = _normals(out), exr(out / "albedo"), (0.1, 0.85, 0.5)
    up = down * np.array([1, -1, 1], np.float32)
    good = [("Y up, read as Y up", normal_colours(up)), ("lit from above", _relit(up, albedo, above))]
    bad = [("Y down, read as Y up", normal_colours(down)), ("lit from above", _relit(down, albedo, above))]
    return figure([row("The wrong Y", *good, *bad)], said)


def colour_shift(folder: Path) -> Figure:
    """A warm and a cold LED, and a rig file that takes all lights for white and alike."""
    tints = ([1.0, 0.8, 0.55], [0.6, 0.8, 1.0], [0.8, 0.8, 0.8], [0.8, 0.8, 0.8])
    clip = film(folder, {"light": [light | {"intensity": tint} for light, tint in zip(LIGHTS, tints, strict=True)]})
    right, _ = solved(clip)
    _edit(clip / "rig.toml", ("intensity = .*", "intensity = 0.8"))
    said = psvideo("normals", clip, "--rig", clip / "rig.toml", "-o", folder / "wrong", *STILL)
    wrong = folder / "wrong"
    tiles = [
        ("albedo, the LEDs' colours in the rig", paint(exr(right / "albedo"))),
        ("albedo, all taken for white", paint(exr(wrong / "albedo"))),
        ("normals, all taken for white", normal_colours(_normals(wrong))),
    ]
    return figure([row("Colour shifts", *tiles)], said)


def wrong_curve(folder: Path) -> Figure:
    """S-Log3 footage under a plan that says linear."""
    clip = film(folder, {"camera": {"transfer": "slog3"}})
    _edit(clip / "plan.toml", ("transfer = .*", 'transfer = "linear"'))
    out, said = solved(clip)
    codes = np.round(255 * frames(clip)[5]).astype(np.uint8)
    tiles = [("frame: the flat, pale look of log", codes), ("albedo", paint(exr(out / "albedo")))]
    return figure([row("Wrong transfer curve", *tiles, ("normals", normal_colours(_normals(out))))], said)


def flicker(folder: Path) -> Figure:
    """A camera whose automatic exposure follows the flashes."""
    clip = film(folder)
    for count, file in enumerate(sorted((clip / "frames").iterdir())):
        codes = read_picture(file, cv2.IMREAD_UNCHANGED).astype(np.float64)
        gained = 4096 + (codes - 4096) * (1 + 0.25 * np.sin(0.55 * count))
        cv2.imwrite(str(file), np.clip(gained, 0, 65535).astype(np.uint16))
    out, said = solved(clip)
    tiles = [(f"result {1001 + place}", paint(exr(out / "albedo", place))) for place in range(3)]
    return figure([row("Flicker: albedo of three results that follow each other", *tiles)], said)


def clipped(folder: Path) -> Figure:
    """Flashes so strong that white paint saturates."""
    clip = film(folder, {"light": [light | {"intensity": 2.2} for light in LIGHTS]})
    out, said = solved(clip)
    frame = frames(clip)[5]
    marked = np.where((frame.max(axis=-1) > 0.99)[..., None], np.array([255, 0, 200], np.uint8), srgb(frame))
    tiles = [("frame", srgb(frame)), ("clipped pixels in magenta", marked)]
    holes = ("normals, some of them estimated", normal_colours(_normals(out)))
    return figure([row("Clipped highlights", *tiles, holes)], said)


def misnamed_rate(folder: Path) -> Figure:
    """The camera says 100 frames a second and records 99.9."""
    rates = {"camera": {"fps": "100000/1001"}, "plan": {"fps": 100}, "strobe": {"clock_offset_ppm": 3.0}}
    clip = film(folder, {**rates, "frames": 40})
    said = psvideo("sync", clip, "--picture", folder / "timing.png")
    picture = read_picture(folder / "timing.png")[..., ::-1]
    rows, cols = picture.shape[:2]
    small = cv2.resize(picture, (WIDTH_PX, rows * WIDTH_PX // cols), interpolation=cv2.INTER_AREA)
    return Figure(picture=small[: len(small) * 11 // 20].astype(np.uint8), said=said)  # profiles and flashes


def dropped_frame(folder: Path) -> Figure:
    """The recorder lost one frame."""
    clip = film(folder, {"output": {"dropped": [8]}})
    out, said = solved(clip)
    psvideo("split", clip, "-o", folder / "plates")
    count = len(list((out / "valid").glob("*.exr")))
    worst = min(range(count), key=lambda place: float(exr(out / "valid", place).mean()))
    tiles = [("normals", normal_colours(_normals(out, worst))), ("valid is white", white(exr(out / "valid", worst)))]
    return figure([row("A frame is missing: its rows are not valid in that round", *tiles)], said)


FAULTS: dict[str, Callable[[Path], Figure]] = {
    "fault_banding": banding,
    "fault_short_dark_time": short_dark_time,
    "fault_half_shutter": half_shutter,
    "fault_led_tails": led_tails,
    "fault_swapped_lights": swapped_lights,
    "fault_wrong_y": wrong_y,
    "fault_colour_shift": colour_shift,
    "fault_wrong_curve": wrong_curve,
    "fault_flicker": flicker,
    "fault_clipped": clipped,
    "fault_misnamed_rate": misnamed_rate,
    "fault_dropped_frame": dropped_frame,
}
"""By the picture's name: docs/pictures/NAME.png."""
