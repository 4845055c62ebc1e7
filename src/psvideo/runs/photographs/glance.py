"""A few pixels of every photograph: how well a matte surface explains them under a transfer curve."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode.decoders import opened
from psvideo.clip.decoded import Header
from psvideo.clip.in_file import RowsInFile
from psvideo.clip.stills import Photographs
from psvideo.clip.transfer import find_curve, to_light
from psvideo.model.arrays import Doubles, Integers
from psvideo.model.rig import Light

POINTS = 6000
"""This many pixels of every picture are looked at, evenly spread."""
LEAST, MOST = 0.1, 0.97
"""Of a pixel's brightest light, and of saturation: between them a sample counts."""
LIGHTS_FOR_CURVE = 4
CODES, LEAST_STEEP = np.linspace(0, 1, 4097), 1e-3
"""Codes at which a curve's steepness is found, and the least that is believed: gamma curves begin level."""
SUBJECT = 1 / 6
"""What is darker than this share of the picture's brightest hundredth says little."""


@dataclass(frozen=True, kw_only=True)
class Glance:
    """Signals of a few pixels, (light, pixel), 0 to 1 as the files code them, and the distant lights' vectors; ``dark``
    (pixel,) are those of the ambient light alone, of which each picture holds ``dark_times`` as much, (light,)."""

    signals: Doubles
    directions: Doubles
    strengths: Doubles
    dark: Doubles | None = None
    dark_times: Doubles | None = None

    def exposed(self, relative: Doubles) -> "Glance":
        """Return the same, taken to be exposed so: (picture,), the dark one last."""
        count = len(self.strengths)
        times = None if self.dark is None else relative[:count] / relative[count]
        return replace(self, strengths=self.strengths * relative[:count], dark_times=times)

    def left_over(self, transfer: str) -> float:
        """Return the share of a typical pixel's light that no matte surface explains."""
        lit = self._lit(transfer)
        brightest, used = lit.max(axis=0), self._used(lit)
        enough = _enough(used, brightest)
        lit, used = lit[:, enough], used[:, enough]
        if lit.shape[1] < POINTS // 100:
            return float("nan")
        residual = _residual(lit, self.directions, used.astype(np.float64))
        return float(np.median(np.sqrt((residual**2).sum(axis=0) / np.maximum(((lit * used) ** 2).sum(axis=0), 1e-12))))

    def left_of_codes(self, transfer: str, other: str) -> tuple[float, float]:
        """Return, under each of two curves, the share of a typical pixel's codes that no matte surface explains, over
        the same samples."""
        lit = [self._lit(name) for name in (transfer, other)]
        used = self._used(lit[0]) & self._used(lit[1])
        enough = _enough(used, lit[0].max(axis=0))
        if enough.sum() < POINTS // 100:
            return float("nan"), float("nan")
        sizes = np.linalg.norm(self.signals * used, axis=0)[enough]
        shares = []
        for name, light in zip((transfer, other), lit, strict=True):
            steepness = np.interp(self.signals, CODES, np.gradient(to_light(find_curve(name), CODES), CODES))
            weights = used * self.strengths[:, None] / np.maximum(steepness, LEAST_STEEP)
            residual = _residual(light[:, enough], self.directions, weights[:, enough])
            shares.append(float(np.median(np.linalg.norm(residual, axis=0) / np.maximum(sizes, 1e-12))))
        return shares[0], shares[1]

    def _lit(self, transfer: str) -> Doubles:
        """Return what the lights gave, (light, pixel), each as if it were of strength 1."""
        curve = find_curve(transfer)
        light = to_light(curve, self.signals)
        if self.dark is not None:
            times = np.ones(len(light)) if self.dark_times is None else self.dark_times
            light = np.maximum(light - times[:, None] * to_light(curve, self.dark), 0)
        return np.asarray(light / self.strengths[:, None], np.float64)

    def _used(self, lit: Doubles) -> NDArray[np.bool_]:
        return np.asarray((lit > LEAST * lit.max(axis=0)) & (self.signals < MOST))


def _enough(used: NDArray[np.bool_], brightest: Doubles) -> NDArray[np.bool_]:
    return np.asarray((used.sum(axis=0) >= LIGHTS_FOR_CURVE) & (brightest > SUBJECT * np.percentile(brightest, 99)))


def _residual(lit: Doubles, directions: Doubles, weights: Doubles) -> Doubles:
    """Return what of (light, pixel) no matte surface explains, in least squares with these weights, and times them."""
    normal = np.einsum("lp,li,lj->pij", weights**2, directions, directions) + 1e-6 * np.eye(3)
    right = np.einsum("lp,li->pi", lit * weights**2, directions)
    found = np.linalg.solve(normal, right[..., None])[..., 0]
    return np.asarray((lit - directions @ found.T) * weights)


def glance_at(pictures: Photographs, lights: Sequence[Light]) -> Glance | None:
    """Look at a few pixels of every picture; None where lights are near, or too few to check each other."""
    directions = [light.direction for light in lights if light.direction is not None]
    if len(directions) < max(len(lights), LIGHTS_FOR_CURVE) or pictures.header.bits is None:
        return None
    signals = [few_signals(pictures, file) for file in pictures.files]
    green = [light.intensity[min(1, len(light.intensity) - 1)] for light in lights]
    dark = signals.pop() if len(signals) > len(lights) else None
    return Glance(signals=np.array(signals), dark=dark, directions=np.array(directions), strengths=np.array(green))


def few_signals(pictures: Photographs, file: Path) -> Doubles:
    """Return the signals of a few pixels of a picture of such a kind, in its second channel, shape (pixel,)."""
    codes = opened(pictures.kind, file).codes
    step = max(int(np.sqrt(codes.shape[0] * codes.shape[1] / POINTS)), 1)
    rows = np.arange(step // 2, codes.shape[0], step)
    some = codes.some(rows)[rows - rows[0]] if isinstance(codes, RowsInFile) else codes[rows]
    cols = np.arange(step // 2, codes.shape[1], step)
    head = replace(pictures.header, white=pictures.white or pictures.header.white)
    thin = _signals(some[:, cols].astype(np.float64), head, rows, cols)
    return np.asarray((thin if thin.ndim == 2 else thin[..., 1]).ravel(), np.float64)


def _signals(codes: Doubles, head: Header, rows: Integers, cols: Integers) -> Doubles:
    """Return which signals the codes of some rows and columns stand for: 0 is black and 1 white, as raw files say."""
    largest = float(2 ** (head.bits or 0) - 1)
    zero, one = 0.0 if head.black is None else np.array(head.black), head.white or largest
    pattern = np.atleast_2d(zero)
    black = pattern[np.ix_(rows % pattern.shape[0], cols % pattern.shape[1])]
    black = black if codes.ndim == 2 else black[..., None]
    found: Doubles = np.clip((codes - black) / (one - black), 0.0, 1.0)
    return found
