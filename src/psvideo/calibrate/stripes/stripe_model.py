"""The model of stripes in row profiles, and its Gauss-Newton equations with what is each profile's own eliminated.

    profile[i] = B[i] + E[i] * sum over h of (a_h cos(2 pi h f x) + b_h sin(2 pi h f x)),   x = i - (rows - 1) / 2

B and E are smooth; B, E, a and b are each profile's own, and f is what all share: see ``waveform``.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from psvideo.model.arrays import Doubles

SPLINE_DEGREE = 2
PERIODS_PER_SPAN = 2.0
MOST_SPANS = 8
ROBUST_SCALE = 3.0
MODEL_ERROR = 0.2
"""Share of a profile's spread by which the model may be off at edges without a row losing weight for it: without
noise, robust weights would else throw out the edges themselves, which show the frequency."""
DULLEST = 1e-3
"""What a profile without any change, a black one, is taken to be unsure by, as a share of all profiles' spread."""
ENVELOPE_PULL = 0.01
"""Weight of the expectation that an envelope is 1, as a share of the stripes' energy: it fixes the envelope's scale."""


class Nuisance(NamedTuple):
    """What each profile of one frame has of its own: coefficients (group, knot) and harmonics (group, cos then sin)."""

    background: Doubles
    envelope: Doubles
    harmonics: Doubles

    def moved(self, step: Doubles) -> "Nuisance":
        """Add a step (group, unknown) in the order of the fields."""
        ends = np.cumsum([part.shape[1] for part in self])[:-1]
        return Nuisance(*(part + move for part, move in zip(self, np.split(step, ends, axis=1), strict=True)))


class Equations(NamedTuple):
    """One frame's Gauss-Newton equations: pull on the frequency and its information (group,) with the nuisance
    eliminated, the rows' shares of the pull, what the nuisance moves by itself and per unit of frequency, residuals."""

    pull: Doubles
    information: Doubles
    row_pull: Doubles
    row_information: Doubles
    move: Doubles
    drag: Doubles
    residual: Doubles


def spline_basis(rows: int, frequency: float) -> Doubles:
    """Return smooth functions of the row, shape (row, knot), that add up to 1 and cannot follow the stripes."""
    spans = int(np.clip(rows * frequency / PERIODS_PER_SPAN, 1, MOST_SPANS))
    inner = np.linspace(0, rows - 1, spans + 1)
    knots = np.concatenate([inner[:1].repeat(SPLINE_DEGREE), inner, inner[-1:].repeat(SPLINE_DEGREE)])
    design: Any = BSpline.design_matrix(np.arange(rows, dtype=np.float64), knots, SPLINE_DEGREE)  # type: ignore[no-untyped-call]
    return np.asarray(design.toarray(), np.float64)


def waves_of(rows: int, frequency: float, harmonics: int) -> Doubles:
    """Return cosines, then sines, of all harmonics, shape (row, 2 * harmonic)."""
    phase = 2 * np.pi * frequency * _places(rows)[:, None] * np.arange(1, harmonics + 1)
    return np.concatenate([np.cos(phase), np.sin(phase)], axis=1)


def _places(rows: int) -> Doubles:
    return np.arange(rows, dtype=np.float64) - (rows - 1) / 2


def start(frame: Doubles, waves: Doubles, smooth: Doubles) -> Nuisance:
    """Fit one frame's profiles (group, row) by ``waves_of`` and ``spline_basis`` of its rows, with an envelope of 1."""
    found = np.asarray(np.linalg.lstsq(np.hstack([smooth, waves]), frame.T, rcond=None)[0].T, np.float64)
    knots = smooth.shape[1]
    return Nuisance(found[:, :knots], np.ones((len(frame), knots)), found[:, knots:])


def stripe_equations(frame: Doubles, own: Nuisance, waves: Doubles, smooth: Doubles) -> Equations:
    """Set up the equations of one frame's profiles (group, row) around the present state."""
    shape, slope, change = _changes(own, waves, smooth)
    residual = frame - own.background @ smooth.T - shape
    weight = _weights(residual, shape)
    weighted = change * weight[:, :, None]
    normal = weighted.transpose(0, 2, 1) @ change
    wish = np.einsum("gnp,gn->pg", weighted, residual).T
    knots = np.arange(smooth.shape[1], 2 * smooth.shape[1])
    hold = ENVELOPE_PULL * (weight * shape**2).sum(axis=1, keepdims=True) / knots.size
    normal[:, knots, knots] += hold
    wish[:, knots] -= hold * (own.envelope - 1)
    diagonal = np.arange(normal.shape[1])
    normal[:, diagonal, diagonal] = normal[:, diagonal, diagonal] * (1 + 1e-9) + 1e-9
    tie = np.einsum("gnp,gn->gp", weighted, slope)
    move, drag = np.moveaxis(np.linalg.solve(normal, np.stack([wish, tie], axis=2)), 2, 0)
    free = weight * (slope - np.einsum("gnp,gp->gn", change, drag))
    return Equations(
        pull=(weight * slope * residual).sum(axis=1) - (tie * move).sum(axis=1),
        information=(free * slope).sum(axis=1),
        row_pull=(free * residual).sum(axis=0),
        row_information=(free * slope).sum(axis=0),
        move=move,
        drag=drag,
        residual=residual,
    )


def _changes(own: Nuisance, waves: Doubles, smooth: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """Return the stripes (group, row), and their changes with the frequency and with all else (group, row, unknown)."""
    turn = 2 * np.pi * np.arange(1, waves.shape[1] // 2 + 1)
    cosines, sines = np.split(own.harmonics, 2, axis=1)
    wave, envelope = own.harmonics @ waves.T, own.envelope @ smooth.T
    slope = envelope * _places(len(waves)) * (np.hstack([sines * turn, -cosines * turn]) @ waves.T)
    still = np.broadcast_to(smooth, (len(wave), *smooth.shape))
    change = np.concatenate([still, smooth * wave[:, :, None], waves * envelope[:, :, None]], axis=2)
    return envelope * wave, slope, change


def _weights(residual: Doubles, stripes: Doubles) -> Doubles:
    """Return each row's robust weight, shape (group, row), in units of each profile's own noise."""
    noise = 1.4826 * np.median(np.abs(residual), axis=1, keepdims=True)
    uneven = stripes + residual
    scale = np.hypot(noise, MODEL_ERROR * uneven.std(axis=1, keepdims=True)) + DULLEST * uneven.std() + 1e-12
    weight: Doubles = 1 / (scale**2 + (residual / ROBUST_SCALE) ** 2)
    return weight
