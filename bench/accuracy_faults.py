"""Faults of physics.md on a matte ball: least squares with 3 lights, then 8 lights under the solver chosen by itself.

Mean errors, trusted or not, over 10 draws. The remedies that need a subject of their own (spheres, near lights, motion)
stand below.
"""

from collections.abc import Callable, Iterator

import numpy as np

from bench.accuracy_measure import Accuracy, Case, angles_deg, matte_ball
from psvideo.clip.transfer import find_curve, to_light
from psvideo.export.sequences.png_maps import decode_normals, encode_normals
from psvideo.model.surface import Surface
from psvideo.solve.normals.solving import Solving

DRAWS = 10
Change = Callable[[Case, np.random.Generator], Case]


def rows() -> Iterator[Accuracy]:
    """Give every fault for 3 and for 8 lights."""
    for lights in (3, 8):
        for name, change, remedy, mend in FAULTS:
            before = _mean_deg(lights, change)
            after = "" if mend is None else f"{_mean_deg(lights, mend):.2f}°"
            yield Accuracy(f"{lights} lights, {name}", f"{before:.2f}°", remedy, after)
    yield from _storage()


def _mean_deg(lights: int, change: Change) -> float:
    rng = np.random.default_rng(5)
    case = matte_ball(lights)
    return float(np.mean([_off_deg(_solved(change(case, rng)), case) for _ in range(DRAWS)]))


def _off_deg(surface: Surface, case: Case) -> float:
    """Return the mean error of all that three lights gave: of what is wrong enough nothing is trusted."""
    both = surface.measured & case.mask
    return float(angles_deg(surface.normals[both], case.truth[both]).mean())


def _solved(case: Case) -> Surface:
    return Solving().solve(case.plates, case.lit)


def _plates(case: Case, plates: np.ndarray) -> Case:
    return case._replace(plates=list(plates.astype(np.float32)))


def _noise(case: Case, rng: np.random.Generator) -> Case:
    plates = np.array(case.plates)
    return _plates(case, plates + rng.normal(0, 0.01, plates.shape))


def _noise_of_four(case: Case, rng: np.random.Generator) -> Case:
    plates = np.array(case.plates)
    return _plates(case, plates + rng.normal(0, 0.01 / 2, plates.shape))


def _directions(angle_deg: float) -> Change:
    def change(case: Case, rng: np.random.Generator) -> Case:
        true = case.lit.directions
        across = np.cross(true, rng.normal(size=true.shape))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        turned = true * np.cos(np.radians(angle_deg)) + across * np.sin(np.radians(angle_deg))
        return case._replace(lit=type(case.lit)(directions=turned, intensities=case.lit.intensities))

    return change


def _intensities(share: float) -> Change:
    def change(case: Case, rng: np.random.Generator) -> Case:
        plates = np.array(case.plates)
        return _plates(case, plates * (1 + share * rng.normal(size=(len(plates), 1, 1))))

    return change


def _encoded(case: Case) -> np.ndarray:
    plates = np.array(case.plates, np.float64)
    low = plates <= 0.0031308
    return np.where(low, 12.92 * plates, 1.055 * np.maximum(plates, 1e-9) ** (1 / 2.4) - 0.055)


def _srgb(case: Case, rng: np.random.Generator) -> Case:
    return _plates(case, _encoded(case))


def _srgb_decoded(case: Case, rng: np.random.Generator) -> Case:
    return _plates(case, to_light(find_curve("srgb"), _encoded(case).astype(np.float32)))


def _black(level: float) -> Change:
    return lambda case, rng: _plates(case, np.array(case.plates) + level)


def _dark_slot(case: Case, rng: np.random.Generator) -> Case:
    """The dark slot shows the same level, which goes with the ambient light."""
    return _plates(case, (np.array(case.plates) + 0.04) - 0.04)


FAULTS: tuple[tuple[str, Change, str, Change | None], ...] = (
    ("nothing", lambda case, rng: case, "", None),
    ("1 % noise", _noise, "mean of four rounds", _noise_of_four),
    ("directions off by 1°", _directions(1.0), "", None),
    ("directions off by 5°", _directions(5.0), "calibrate mirror-sphere, to 0.5°", _directions(0.5)),
    ("intensities off by 1 %", _intensities(0.01), "", None),
    ("intensities off by 3 %", _intensities(0.03), "", None),
    ("intensities off by 10 %", _intensities(0.1), "calibrate flat-field, to 1 %", _intensities(0.01)),
    ("sRGB taken for linear", _srgb, 'transfer = "srgb" in the plan', _srgb_decoded),
    ("black level off by 1 %", _black(0.01), "", None),
    ("black level off by 4 %", _black(0.04), "a dark slot in the plan", _dark_slot),
)


def _storage() -> Iterator[Accuracy]:
    case = matte_ball(8)
    true = case.truth[case.mask]

    def lost(stored: np.ndarray) -> str:
        stored = stored / np.linalg.norm(stored, axis=-1, keepdims=True)
        return f"{np.degrees(2 * np.arcsin(np.linalg.norm(stored - true, axis=-1) / 2)).mean():.4f}°"

    eight = np.round((true * 0.5 + 0.5) * 255) / 255 * 2 - 1
    sixteen = decode_normals(encode_normals(true)).astype(np.float64)
    half = true.astype(np.float16).astype(np.float64)
    yield Accuracy(
        "normals stored in 8 bits", lost(eight), "half floats; --encode png16", f"{lost(half)}; {lost(sixteen)}"
    )
