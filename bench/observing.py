"""What judging an instant costs, eight lights at 1080p colour, against a copy of one plate in light."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from bench.table import Row
from bench.whole_run_clips import COLS, ROWS, directions
from psvideo.model.coded import Coded, Tone
from psvideo.model.surface import Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import Mixture
from psvideo.plates.sequence import Round
from psvideo.report.observe.observed import Observed

LIGHTS = 8
TONE = Tone(gain=np.full((1, 1), 1 / 65535))
ROUNDS = 16
"""Rounds 1, 2, 4, 8 and 16 are looked at closely, as in any take."""


def rows() -> Iterator[Row]:
    """Observe rounds in turn, and report the steady ones and those that are looked at closely apart."""
    rounds, surfaces = [_round(n) for n in range(2)], [noisy_surface(n) for n in range(2)]
    for one in rounds:
        assert len(one.plates) == LIGHTS
    observed = Observed(lights=tuple(directions(LIGHTS)))
    plate = np.ones((ROWS, COLS, 3), np.float32)
    spare = np.empty_like(plate)
    copy_s = min(_taken_s(lambda: np.copyto(spare, plate)) for _ in range(9))
    numbered = [replace(rounds[n % 2], number=n) for n in range(ROUNDS)]
    found_s = [_taken_s(partial(_observe, observed, one, surfaces[n % 2])) for n, one in enumerate(numbered)]
    close_s = [found_s[n - 1] for n in (2, 4, 8, 16)]
    steady_s = [one for n, one in enumerate(found_s, start=1) if n.bit_count() != 1]
    yield Row("copying one plate of 25 MB", f"{1e3 * copy_s:.2f} ms", "", None)
    yield Row("observing an instant", f"{1e3 * min(steady_s):.1f} ms", "<= 5 ms", min(steady_s) <= 5e-3)
    yield Row("observing an instant / copying one plate", f"{min(steady_s) / copy_s:.1f}", "", None)
    yield Row("an instant that is looked at closely (1, 2, 4, 8 ...)", f"{1e3 * min(close_s):.1f} ms", "", None)


def _observe(observed: Observed, one: Round, surface: Surface) -> None:
    for plate in one.plates:
        observed.look(plate)
    observed.add(one, surface)


def _taken_s(action: Callable[[], object]) -> float:
    began = time.thread_time()
    action()
    return time.thread_time() - began


def _normals() -> np.ndarray:
    y, x = np.mgrid[0:ROWS, 0:COLS].astype(np.float32) / 240
    normals = np.stack([0.4 * np.sin(9 * x), 0.4 * np.cos(7 * y), np.ones_like(x)], -1)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True), np.float32)


def _round(number: int) -> Round:
    rng, normals, plates = np.random.default_rng(number), _normals(), []
    for name, direction in directions(LIGHTS).items():
        shade = 0.7 * np.maximum(normals @ np.array(direction, np.float32), 0)
        image = np.repeat(shade[..., None], 3, axis=2)
        image += 0.005 * rng.standard_normal(image.shape, dtype=np.float32)
        share = np.linspace(0, 1, ROWS)
        halves = (share[:, None, None] * image, (1 - share)[:, None, None] * image)
        frames = tuple(Coded(codes=np.asarray(half.clip(0, 1) * 65535, np.uint16), tone=TONE) for half in halves)
        picture = Mixture(frames=frames, coefficients=np.ones((2, ROWS)))
        seen = np.ones(ROWS, np.bool_)
        plates.append(LightPlate(light=name, number=number, time_s=0.1 * number, picture=picture, seen=seen))
    return Round(number=number, plates=tuple(plates))


def noisy_surface(number: int) -> Surface:
    """Return a noisy relief as half floats, every channel a plane of its own, as solvers store it."""
    noise = 0.01 * np.random.default_rng(number).standard_normal((ROWS, COLS, 3), dtype=np.float32)
    planes = np.ascontiguousarray(np.moveaxis(_normals() + noise, -1, 0), np.float16)
    return Surface(
        normals=np.moveaxis(planes, 0, -1),
        albedo=np.full((ROWS, COLS, 3), 0.7, np.float16),
        valid=np.ones((ROWS, COLS), np.bool_),
    )
