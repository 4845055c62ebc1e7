"""Predicted errors: how many pixels hold them, and the constants of doubt fitted with every subject left out in turn.

``python -m bench.predicted fit`` fits them to all subjects as well, and prints them.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import cv2
import numpy as np
import scipy.optimize

from bench.accuracy_measure import (
    SHARED_DATA,
    Case,
    angles_deg,
    diligent_ball,
    photographed,
    rendered_bunny,
    ring,
    turned,
    washington_sphere,
)
from bench.accuracy_whole import bust
from bench.table import table
from psvideo.solve.normals.illumination import MAX_CONDITION, Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.doubting import Doubting, doubt_deg
from psvideo.solve.normals.trust.judging import Judging, looked_at
from psvideo.solve.normals.trust.noise_spread import SURE
from psvideo.solve.normals.trust.signs import Signs

COUNTS = (5, 8, 12, 12, 24, 48, 96, 4)
"""So many lights of a subject's, three sets of each. Four are solved by least squares."""
FLAT = 6.5
"""Lights of a larger condition number lie nearly in a plane, up to what solving accepts."""
FITTED = ("misfit_deg", "misfit_power", "little_deg", "few_power", "plain", "indirect", "torn", "torn_beside")
MOST_OVER, OF_OVER = 0.02, 3.0
"""Of what is trusted, the share that may be off by more than 10 degrees, and how much more of it counts."""
POINTS = 400
VIRTUAL_WEIGHT = 0.3
"""A virtual subject counts less than a photographed one: of the world it knows what was put into it."""
SIZE = 96


class Held(NamedTuple):
    """A subject under about so many lights: the share of pixels within the predicted error and within twice, what is
    predicted over what is true (medians), their correlation, and the share that is trusted, with how many of it are
    off by more than 10 degrees; ``left_out`` is the same with constants that were fitted to the others."""

    subject: str
    lights: str
    as_it_is: str
    left_out: str
    bar: str
    met: bool


@dataclass(frozen=True)
class Seen:
    """Points of one subject under one set of lights: true errors, and what they are predicted from, degrees."""

    subject: str
    lights: int
    flat: bool
    true_deg: np.ndarray
    noise_deg: np.ndarray
    fit_deg: np.ndarray
    signs: Signs

    def predicted_deg(self, how: Doubting) -> np.ndarray:
        """Return the predicted errors, as ``judge_rows`` makes them."""
        own_deg = np.maximum(self.fit_deg - how.own * self.signs.misfit_deg, 0)
        return np.asarray(np.hypot(self.noise_deg, doubt_deg(self.signs, how=how) + own_deg))

    def some(self) -> "Seen":
        """Return a few of the points."""
        some = np.random.default_rng(0).permutation(len(self.true_deg))[:POINTS]
        signs = self.signs.at(some)
        return Seen(
            self.subject, self.lights, self.flat, self.true_deg[some], self.noise_deg[some], self.fit_deg[some], signs
        )


def rows() -> Iterator[Held]:
    """Give every subject as it is, and as predicted from the others."""
    seen = [each for subject, case in subjects() for each in looked(subject, case)]
    for subject in dict.fromkeys(each.subject for each in seen):
        how = fitted([each for each in seen if each.subject != subject])
        own = [each for each in seen if each.subject == subject]
        for few, most, flat in ((4, 4, False), (5, 8, False), (12, 12, False), (13, 96, False), (5, 12, True)):
            sets = [each for each in own if few <= each.lights <= most and each.flat == flat]
            if sets:
                now, other = _held(sets, Doubting()), _held(sets, how)
                said = (f"{few}" if few == most else f"{few} to {most}") + (", nearly in a plane" if flat else "")
                met = bool(60 <= now[0] <= 76 and now[1] >= 90 and now[5] <= 3)
                yield Held(subject, said, _words(now), _words(other), "60-76 %, 90 %, <= 3 % over 10°", met)


def subjects() -> Iterator[tuple[str, Case]]:
    """Give photographs with their true normals, another renderer's bunny, and virtual shapes."""
    if SHARED_DATA.is_dir():
        yield "bear", photographed("bear")
        yield "cat", photographed("cat")
        yield "ball", diligent_ball()
        yield "grey sphere", washington_sphere()
        yield "bunny", rendered_bunny()
    for width_px in (96, 192, 384, 768):
        case, reached = bust((0, 1, 2, 3, 4), width_px=width_px)
        yield f"virtual bust, {width_px} px", case._replace(mask=reached)
    for name, normals, inside in shapes():
        for slant_deg in (30, 50):
            ways = np.concatenate([ring(8, slant_deg), ring(4, slant_deg / 2)])
            yield f"virtual {name}", shot(normals, inside, ways)
            yield f"virtual {name}", shot(normals, inside, ways, noise=0.01)
            yield f"virtual {name}", shot(normals, inside, ways, around=0.05)
            yield f"virtual {name}", shot(normals, inside, ways, gloss=0.15)
            yield f"virtual {name}", turned(shot(normals, inside, ways), 2)


def shapes() -> tuple[tuple[str, np.ndarray, np.ndarray], ...]:
    """Return virtual shapes: their names, normals (row, col, 3) and where they are, (row, col)."""
    return _ball(), _waves(), _bumps()


def _ball() -> tuple[str, np.ndarray, np.ndarray]:
    rows, cols = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    x, y = cols / (0.48 * SIZE), -rows / (0.48 * SIZE)
    inside = x * x + y * y < 0.92
    normals = np.stack([x, y, np.sqrt(np.where(inside, 1 - x * x - y * y, 1))], axis=-1)
    return "ball", normals * inside[..., None], inside


def _waves() -> tuple[str, np.ndarray, np.ndarray]:
    v, u = np.mgrid[:SIZE, :SIZE] / SIZE
    return "waves", *_of_height(0.04 * np.sin(6 * np.pi * u) * np.cos(5 * np.pi * v))


def _bumps() -> tuple[str, np.ndarray, np.ndarray]:
    soft = cv2.GaussianBlur(np.random.default_rng(4).normal(size=(SIZE, SIZE)), (0, 0), 6)
    return "bumps", *_of_height(np.asarray(0.04 * soft / soft.std()))


def _of_height(height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    down, across = np.gradient(height, 1 / SIZE)
    normals = np.stack([-across, down, np.ones_like(height)], axis=-1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True), np.ones(height.shape, bool)


def shot(
    normals: np.ndarray, inside: np.ndarray, ways: np.ndarray, *,
    noise: float = 0.002, around: float = 0.0, gloss: float = 0.0,
) -> Case:  # fmt: skip
    """Return a painted surface; ``around`` is the share of its albedo that it gives under every light by way of others,
    ``gloss`` how bright highlights are."""
    rng = np.random.default_rng(1)
    paint = cv2.GaussianBlur(np.random.default_rng(9).normal(size=(SIZE, SIZE, 3)), (0, 0), 3)
    albedo = np.clip(np.array([0.55, 0.45, 0.4]) + 0.08 * paint / paint.std(), 0.1, 0.9) * inside[..., None]
    half = ways + np.array([0, 0, 1])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    plates = []
    for way, between in zip(ways, half, strict=True):
        shine = gloss * np.maximum(normals @ between, 0) ** 25 * (normals @ way > 0)
        light = albedo * (np.maximum(normals @ way, 0) + around)[..., None] + (shine * inside)[..., None]
        plates.append(np.minimum(light + rng.normal(0, noise, light.shape), 1).astype(np.float32))
    lit = Illumination(directions=ways, intensities=np.ones((len(ways), 3)))
    return Case("virtual", plates, lit, normals, inside)


def looked(subject: str, case: Case) -> Iterator[Seen]:
    """Look at a subject under sets of its lights that are well spread, and nearly in a plane."""
    directions, rng = case.lit.directions, np.random.default_rng(3)
    for count in COUNTS:
        for _ in range(3 if count < len(directions) else count == len(directions)):
            for flat in (False, True):
                chosen = random_lights(directions, count, rng, flat=flat)
                if chosen is not None:
                    yield _looked(subject, case.choose(chosen), flat=flat)


def random_lights(directions: np.ndarray, count: int, rng: np.random.Generator, *, flat: bool) -> np.ndarray | None:
    """Return the numbers of so many lights that lie nearly in a plane, or do not; None where no such are found."""
    for _ in range(2000):
        chosen = np.sort(rng.choice(len(directions), count, replace=False))
        values = np.linalg.svd(directions[chosen], compute_uv=False)
        if values[0] <= MAX_CONDITION * values[2] and (values[0] > FLAT * values[2]) == flat:
            return chosen
    return None


def _looked(subject: str, case: Case, *, flat: bool) -> Seen:
    surface, one, noise = Solving().measured(LitPlates(case.plates, case.lit, mask=case.mask))
    points, signs = looked_at(surface, one, noise)
    truth = case.truth[:: points.step, :: points.step]
    known = points.known & (np.linalg.norm(truth, axis=-1) > 0.5)
    sure = np.maximum(points.fit_deg**2 - (SURE * points.fit_of_noise_deg) ** 2, 0)
    return Seen(
        subject=subject,
        lights=len(case.plates),
        flat=flat,
        true_deg=angles_deg(points.surface.normals[known], truth[known]),
        noise_deg=points.noise_deg[known],
        fit_deg=np.sqrt(sure)[known],
        signs=signs.at(known),
    )


def fitted(seen: list[Seen]) -> Doubting:
    """Return the constants under which two thirds of the errors are within the predicted ones, every subject alike
    (quantile regression of their logarithms), and hardly any that is trusted is far off."""
    some = [each.some() for each in seen]
    subjects = dict.fromkeys(each.subject for each in some)
    counts = {one: sum(len(each.true_deg) for each in some if each.subject == one) for one in subjects}

    def loss(logs: np.ndarray) -> float:
        how, total = _constants(logs), 0.0
        trusted, over = dict.fromkeys(subjects, 1e-9), dict.fromkeys(subjects, 0.0)
        for each in some:
            predicted = each.predicted_deg(how)
            off = np.log(each.true_deg + 0.05) - np.log(predicted + 1e-3)
            total += _weight(each.subject) / counts[each.subject] * float(np.maximum(0.68 * off, -0.32 * off).sum())
            nearly = 1 / (1 + np.exp((predicted - Judging().most_error_deg) / 0.3))  # a step has no slope
            trusted[each.subject] += float(nearly.sum())
            over[each.subject] += float(nearly[each.true_deg > 10].sum())
        return total + sum(OF_OVER * _weight(one) * max(over[one] / trusted[one] - MOST_OVER, 0.0) for one in subjects)

    start = Doubting()
    first = np.log([getattr(start, name) for name in FITTED])
    search: Any = scipy.optimize.minimize
    return _constants(search(loss, first, method="Nelder-Mead", options={"maxiter": 300}).x)


def _weight(subject: str) -> float:
    return VIRTUAL_WEIGHT if "virtual" in subject else 1.0


def _constants(logs: np.ndarray) -> Doubting:
    values = (float(value) for value in np.exp(np.clip(logs, -6, 4)))
    return replace(Doubting(), **dict(zip(FITTED, values, strict=True)))


def _held(sets: list[Seen], how: Doubting) -> np.ndarray:
    """Return the figures of ``Held``, means over sets."""
    found, limits = [], Judging()
    for each in sets:
        predicted, true = each.predicted_deg(how), each.true_deg
        trusted = predicted <= limits.most_error_deg
        over = float(np.mean(true[trusted] > 10)) if trusted.any() else 0.0
        alike = float(np.corrcoef(predicted, true)[0, 1])
        within = [100 * float(np.mean(true <= times * predicted)) for times in (1, 2)]
        ratio = float(np.median(predicted) / np.median(true))
        found.append((*within, ratio, alike, 100 * float(trusted.mean()), 100 * over))
    return np.asarray(np.mean(found, axis=0))


def _words(held: np.ndarray) -> str:
    once, twice, ratio, alike, trusted, over = held
    return (
        f"{once:.0f} %, {twice:.0f} % within twice; ratio {ratio:.2f}, correlation {alike:.2f}; {trusted:.0f} % "
        f"trusted, {over:.1f} % of them over 10°"
    )


if __name__ == "__main__":
    if "fit" in sys.argv:
        print(fitted([each for subject, case in subjects() for each in looked(subject, case)]))
    else:
        print(table(rows()))
