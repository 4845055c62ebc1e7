"""Time per 1080p frame, 8 lights, 16-bit codes: plain numpy least squares (before), the solvers, and a per-pixel L1.

Best of several runs taken in turn; processor time shows what other work on the machine hides. The L1 reference is timed
over a few pixels and scaled to the frame.
"""

import time
from collections.abc import Callable, Iterator

import numpy as np

from bench.accuracy_l1 import l1_normals
from bench.accuracy_measure import Accuracy, Case, gloss
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust import huber1981

ROWS, COLS, REPEATS, L1_PIXELS, CORES = 1080, 1920, 7, 2000, 2


def rows() -> Iterator[Accuracy]:
    """Time solvers on the scene gloss.toml in grey, repeated to the size of a frame."""
    case = _grey_frame()
    codes = [(plate * 65535).astype(np.uint16) for plate in case.plates]
    given, small = LitPlates(codes, case.lit, scale=1 / 65535), AskedSurface(half=True, residual=False)
    plain_s, careful_s, numpy_s = _best_of(
        lambda: woodham1980.solve(given, asked=small),
        lambda: huber1981.solve(given, asked=small),
        lambda: _numpy(codes, case.lit.directions),
    )
    pixels = np.random.default_rng(0).choice(ROWS * COLS, L1_PIXELS, replace=False)
    l1_s = _timed(lambda: l1_normals(case, pixels)) * ROWS * COLS / L1_PIXELS
    yield Accuracy("plain numpy least squares", f"{1e3 * numpy_s:.0f} ms", "compiled", f"{1e3 * plain_s:.1f} ms")
    yield Accuracy(
        "L1 by reweighting in numpy", f"{l1_s:.0f} s", "robust, 3 reweightings", f"{1e3 * careful_s:.0f} ms",
        "<= 80 ms", careful_s <= 0.08,
    )  # fmt: skip
    began = time.process_time()
    huber1981.solve(given, asked=small, threads=1)
    share_s = (time.process_time() - began) / CORES
    done = share_s <= 0.08
    yield Accuracy(f"robust, processor time / {CORES} cores", "", "", f"{1e3 * share_s:.0f} ms", "<= 80 ms", done)
    ratio = careful_s / numpy_s
    yield Accuracy("robust / numpy least squares", "", "", f"{ratio:.2f}", "<= 0.25", ratio <= 0.25)


def _grey_frame() -> Case:
    small = gloss()
    times = (ROWS // small.mask.shape[0] + 1, COLS // small.mask.shape[1] + 1)
    plates = [np.ascontiguousarray(np.tile(plate.mean(axis=2), times)[:ROWS, :COLS]) for plate in small.plates]
    lit = Illumination(directions=small.lit.directions, intensities=small.lit.intensities[:, :1])
    return Case("a frame", plates, lit, np.zeros((ROWS, COLS, 3)), np.ones((ROWS, COLS), bool))


def _numpy(codes: list[np.ndarray], directions: np.ndarray) -> np.ndarray:
    measured = np.stack([plate.reshape(-1) for plate in codes], axis=1).astype(np.float64)
    scaled = np.linalg.lstsq(directions, measured.T, rcond=None)[0].T
    return np.asarray(scaled / np.maximum(np.linalg.norm(scaled, axis=1, keepdims=True), 1e-12))


def _timed(action: Callable[[], object]) -> float:
    began = time.perf_counter()
    action()
    return time.perf_counter() - began


def _best_of(*actions: Callable[[], object]) -> list[float]:
    for action in actions:
        action()
    return [
        min(column) for column in zip(*[[_timed(action) for action in actions] for _ in range(REPEATS)], strict=True)
    ]
