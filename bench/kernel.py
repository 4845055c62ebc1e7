"""Least squares from 16-bit codes to half-float normals at 1080p, against the floor that memory sets, in the same run.

The floor is the time of moving 2 bytes per light and pixel in and 8 out, at the speed with which a copy of as many
bytes runs over as many threads. Plates and copies go in turn through more memory than the processor's cache holds.
"""

import itertools
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from bench.table import Row
from psvideo.compute.compiled import FUSED
from psvideo.model.coded import Coded, Tone
from psvideo.plates.ambient.ambient_level import AmbientLevel
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares.kernel import solve_rows
from psvideo.solve.normals.least_squares.woodham1980 import solve
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.loops.blocks import working_memory
from psvideo.solve.normals.result import empty_result
from psvideo.solve.normals.task import Usable, task

ROWS, COLS = 1080, 1920
PIXELS = ROWS * COLS
BEYOND_CACHE_BYTES = 160_000_000
REPEATS = 40
FRAMES_OF_A_ROUND = 11
THREADS = os.cpu_count() or 1
BANDS = 4 * THREADS


def rows() -> Iterator[Row]:
    """Time the kernel for 3, 8 and 16 lights, beside a copy and the plain numpy solution."""
    with ThreadPoolExecutor(THREADS) as pool:
        for lights in (3, 8, 16):
            yield from _rows_for(lights, pool)
    yield from _colour_rows()
    yield from _round_rows()


def _rows_for(lights: int, pool: ThreadPoolExecutor) -> Iterator[Row]:
    sets = max(2, BEYOND_CACHE_BYTES // (2 * lights * PIXELS))
    clean = [_codes(lights, seed) for seed in range(sets)]
    kernel, copy = _kernel(clean, pool), _copy((2 * lights + 8) * PIXELS // 2, pool)
    shadowed = _kernel([_with_faults(plates) for plates in clean[:2]] * 2, pool)
    clean_s, copy_s, shadowed_s = _best_of((kernel, copy, shadowed))
    numpy_s = _timed(lambda: _plain_numpy(clean[0], _ring(lights)))
    ratio = clean_s / copy_s
    yield Row(f"{lights} lights: kernel", f"{1e3 * clean_s:.2f} ms", "", None)
    yield Row(f"{lights} lights: copy of as many bytes", f"{1e3 * copy_s:.2f} ms", "", None)
    yield Row(f"{lights} lights: kernel / copy", f"{ratio:.2f}", "<= 1.5", ratio <= 1.5)
    slower = shadowed_s / clean_s
    yield Row(f"{lights} lights: shadow or saturation in every block / none", f"{slower:.2f}", "<= 3", slower <= 3)
    faster = numpy_s / clean_s
    yield Row(
        f"{lights} lights: L2 in numpy / kernel", f"{faster:.0f} ({1e3 * numpy_s:.0f} ms)", ">= 100", faster >= 100
    )


def _round_rows() -> Iterator[Row]:
    """One pass from the codes of a round's frames to normals: eight lights, a dark slot, ambient light taken off."""
    rng, lights = np.random.default_rng(0), 8
    base = rng.integers(9_000, 40_000, (ROWS, COLS, 3)).astype(np.uint16)
    tone = Tone(gain=np.full((1, 1), 1 / 65535))
    frames = [Coded(codes=np.roll(base, 7 * n, axis=1), tone=tone) for n in range(FRAMES_OF_A_ROUND)]
    dark = AmbientLevel.of(np.full(base.shape, 0.02, np.float32))
    plates = []
    for light in range(lights):
        first = (np.arange(ROWS) < ROWS * (light + 1) // lights).astype(np.float64)  # a dark row that rolls
        two = (frames[light], frames[light + 1])
        plates.append(
            Mixture(frames=two, coefficients=np.stack([first, 1 - first])).without((dark,), np.ones((1, ROWS)))
        )
    lit = Illumination(directions=_ring(lights), intensities=np.ones((lights, 3)))
    targets = [np.empty_like(base) for _ in frames]

    def one_pass() -> None:
        solve(LitPlates(plates, lit), asked=AskedSurface(half=True, residual=False), usable=Usable(shadow_ratio=0.0))

    def copy() -> None:
        for frame, target in zip(frames, targets, strict=True):
            target[:] = frame.codes

    one_pass()
    pass_s, copy_s = _best_of((one_pass, copy))
    ratio = pass_s / copy_s
    name = f"round of {FRAMES_OF_A_ROUND} colour frames"
    yield Row(f"{name}: codes to normals and albedo, {THREADS} threads", f"{1e3 * pass_s:.1f} ms", "", None)
    yield Row(f"{name}: one thread copies them", f"{1e3 * copy_s:.1f} ms", "", None)
    yield Row(f"{name}: codes to normals / copy", f"{ratio:.2f}", "<= 1.5", ratio <= 1.5)


def _colour_rows() -> Iterator[Row]:
    rng = np.random.default_rng(0)
    plates = [0.3 + 0.3 * rng.random((ROWS, COLS, 3), dtype=np.float32) for _ in range(3)]
    lit = Illumination(directions=_ring(3), intensities=np.ones((3, 3)))
    best_s = _best_of((lambda: solve(LitPlates(plates, lit), asked=AskedSurface(half=True, residual=False)),))[0]
    yield Row("3 lights, colour, float32 in: solve()", f"{1e3 * best_s:.1f} ms", "<= 25 ms", best_s <= 0.025)


def _ring(lights: int) -> np.ndarray:
    """Unit directions evenly around the camera's axis, 35 degrees off it."""
    around, slant = np.arange(lights) * 2 * np.pi / lights, np.radians(35)
    up = np.full(lights, np.cos(slant))
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), up], axis=-1)


def _codes(lights: int, seed: int) -> list[np.ndarray]:
    return list(np.random.default_rng(seed).integers(15_000, 40_000, (lights, ROWS, COLS), dtype=np.uint16))


def _with_faults(plates: list[np.ndarray]) -> list[np.ndarray]:
    """Shadow in one pixel of fifty and saturation in another, all over the picture."""
    rng = np.random.default_rng(9)
    spoilt = [plate.copy() for plate in plates]
    spoilt[0][rng.random((ROWS, COLS)) < 0.02] = 0
    spoilt[1][rng.random((ROWS, COLS)) < 0.02] = 65_535
    return spoilt


def _kernel(sets: list[list[np.ndarray]], pool: ThreadPoolExecutor) -> Callable[[], None]:
    """What solves one set of plates after another, into memory that is there."""
    lights = len(sets[0])
    lit = Illumination(directions=_ring(lights), intensities=np.ones((lights, 1)))
    result = empty_result(PIXELS, 1, half=True, residual=False)
    tasks = [task(plates, lit, None, None, Usable(), 0.0, 1 / 65535) for plates in sets]
    given = itertools.cycle(zip(tasks, sets, strict=True))  # a task holds its plates' addresses only
    edges = np.linspace(0, ROWS, BANDS + 1).astype(int).tolist()

    def run() -> None:
        now, _ = next(given)
        list(
            pool.map(
                lambda band: solve_rows(now, result, working_memory(now), band[0], band[1]), itertools.pairwise(edges)
            )
        )

    return run


@FUSED.kept
def _move(source: np.ndarray, target: np.ndarray) -> None:
    for i in range(len(source)):
        target[i] = source[i]


def _copy(count: int, pool: ThreadPoolExecutor) -> Callable[[], None]:
    """What copies so many bytes, from one place after another in more memory than the cache holds."""
    words = count // 8
    places = max(2, BEYOND_CACHE_BYTES // (2 * count))
    sources, targets = np.ones((places, words)), np.ones((places, words))
    edges = np.linspace(0, words, BANDS + 1).astype(int).tolist()
    turns = itertools.cycle(range(places))

    def run() -> None:
        n = next(turns)
        parts = itertools.pairwise(edges)
        list(pool.map(lambda part: _move(sources[n, part[0] : part[1]], targets[n, part[0] : part[1]]), parts))

    return run


def _plain_numpy(plates: list[np.ndarray], directions: np.ndarray) -> np.ndarray:
    """The L2 of RobustPhotometricStereo, written again: one lstsq over all pixels in float64, then unit length."""
    measurements = np.stack([plate.reshape(-1) for plate in plates], axis=1).astype(np.float64)
    scaled = np.linalg.lstsq(directions, measurements.T, rcond=None)[0].T
    return np.asarray(scaled / np.linalg.norm(scaled, axis=1, keepdims=True))


def _timed(action: Callable[[], object]) -> float:
    began = time.perf_counter()
    action()
    return time.perf_counter() - began


def _best_of(actions: tuple[Callable[[], object], ...]) -> list[float]:
    """The shortest time of each, all taken in turn so that other work on the machine meets them alike."""
    for action in actions:
        action()  # compiles, and touches the memory
    times = [[_timed(action) for action in actions] for _ in range(REPEATS)]
    return [min(column) for column in zip(*times, strict=True)]
