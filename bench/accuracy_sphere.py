"""Lights from mirror spheres: real photographs against published directions, virtual ones against the truth.

Called by the table of accuracy; by itself ``python -m bench accuracy_sphere``.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bench.accuracy_measure import Accuracy
from bench.mirror_scene import Ball, Lamp, Lens, photograph, unit
from psvideo.calibrate.light_pictures import light_pictures
from psvideo.calibrate.mirror.lights import calibrate_lights
from psvideo.calibrate.mirror.measured import MirrorCalibration
from psvideo.calibrate.mirror.sighting import sight_spheres
from psvideo.calibrate.sphere.sphere_view import Looking
from psvideo.runs.photographs.light_sets import open_light_sets

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
LIGHTS = ((0.3, 0.4, 0.87), (-0.5, 0.2, 0.84), (0.1, -0.4, 0.9), (0.7, 0.3, 0.4), (-0.2, 0.7, 0.6))
PSBOX_CIRCLE = (535.9, 478.0, 421.13)


def rows() -> Iterator[Accuracy]:
    """Yield the errors of directions, with the standard errors that the calibration gave itself."""
    if DATA.is_dir():
        psbox = DATA / "psbox_sphere" / "LightProbe-1"
        truth = np.loadtxt(psbox / "light_directions.txt").T
        yield _row(
            "psbox, hand-made circle", _calibrated(psbox, Looking(circles=(PSBOX_CIRCLE,))), truth, 0.5, worst=True
        )
        yield _row("psbox, outline found (room light)", _calibrated(psbox, Looking()), truth, 0.5, worst=True)
        yield _row(
            "psbox, outline found (LEDs only)", _calibrated(psbox, Looking(), room=False), truth, 0.5, worst=True
        )
        chrome = DATA / "uw_psm" / "chrome"
        yield _row(
            "Washington chrome",
            _calibrated(chrome, Looking()),
            np.loadtxt(chrome.parent / "lights.txt", skiprows=1),
            3.0,
        )
    for off_axis_deg in (0.0, 5.0, 10.0):
        for focal in (600.0, None):
            view = "rays" if focal else "orthographic"
            what = f"virtual, 67 px, {off_axis_deg:.0f} deg off the axis, {view}"
            yield _row(what, _virtual(off_axis_deg, focal), np.array(LIGHTS), 0.2 if focal else None)


def _calibrated(folder: Path, looking: Looking, *, room: bool = True) -> MirrorCalibration:
    opened = open_light_sets(folder)
    return calibrate_lights(sight_spheres(opened.sets, looking, where=folder.name, room=opened.room if room else None))


def _virtual(off_axis_deg: float, focal: float | None) -> MirrorCalibration:
    lens = Lens(width=480, height=300, focal=600.0)
    ball = Ball(centre=(0.45 * np.tan(np.radians(off_axis_deg)), 0.0, -0.45))
    images = [
        photograph(lens, [ball], [Lamp(direction=vector)], noise=0.003, seed=n) for n, vector in enumerate(LIGHTS)
    ]
    pictures = light_pictures([str(n) for n in range(len(LIGHTS))], images)
    return calibrate_lights(sight_spheres([pictures], Looking(focal_px=focal), where="virtual"))


def _row(
    what: str, found: MirrorCalibration, truth: np.ndarray, bar_deg: float | None, *, worst: bool = False
) -> Accuracy:
    vectors = np.array([light.direction for light in found.lights])
    errors = np.degrees(np.arccos(np.clip((vectors * unit(truth)).sum(axis=1), -1, 1)))
    own = np.sqrt(np.mean([light.error_deg**2 for light in found.lights]))
    counted = errors.max() if worst else errors.mean()
    return Accuracy(
        f"light direction: {what}",
        after=f"mean {errors.mean():.2f}, worst {errors.max():.2f} deg (own standard error {own:.2f})",
        bar="" if bar_deg is None else f"{'worst' if worst else 'mean'} <= {bar_deg:g} deg",
        met=None if bar_deg is None else bool(counted <= bar_deg),
    )
