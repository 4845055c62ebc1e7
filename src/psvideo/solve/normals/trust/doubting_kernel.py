"""The compiled loop that makes one doubt of all signs: by how many degrees each normal may be off beyond noise."""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Floats

ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)
LEAST_SHOWN = np.float32(1e-9)
"""Powers of less are slow: numbers as small are stored in another way."""
MISFIT, TORN, LIKELY_MISFIT, LIKELY_TORN, AROUND, LOST, NOISE = range(7)
"""The planes of signs that ``fill_doubt`` reads, in degrees: a misfit and what is torn, surely and likely; light from
around; what noise makes more where few lights reach; and what noise makes."""
UNEVEN, UNCHECKED, AT_LEAST, TORN_SHARE, BESIDE_MISFIT, BY_CAUSE = range(7, 13)
"""Which share of the misfit is uneven; what cannot be checked; what the whole error is at least; by which share of
themselves torn normals count whatever else shows; what albedo and shadows show where lights hardly check each other,
other signs of a misfit, which count where they are more; and by how much what a misfit comes of turns normals, where
that is known."""
SIGNS = 13


class Factors(NamedTuple):
    """How much the signs of ``fill_doubt`` count, float32: a misfit m as ``misfit`` times m^(1 + ``power``) over
    m + ``little_deg``, as far as it is not ``explained``; light from ``around``; and ``torn`` normals, up to the share
    ``torn_beside`` of the other doubt and ``torn_alone_deg``. What explains it counts up to ``most`` times the square
    of what a misfit does."""

    misfit: np.float32
    power: np.float32
    little_deg: np.float32
    around: np.float32
    torn: np.float32
    torn_beside: np.float32
    torn_alone_deg: np.float32
    explained: np.float32
    most: np.float32


@FUSED.kept
def fill_doubt(signs: Floats, factors: Factors, out: Floats) -> None:
    """Fill ``out`` (point,) with degrees of doubt, from ``signs`` (``SIGNS``, point), in degrees but for shares: by
    what is sure and what noise makes more, or by what is likely without noise, whichever is more."""
    by_roots, unexplained = factors.power == HALF, ONE - factors.explained
    for i in range(len(out)):
        around, unchecked = factors.around * signs[AROUND, i], signs[UNCHECKED, i]
        hidden = np.sqrt(around * around + unchecked * unchecked)
        torn_alone, torn_share = factors.torn_alone_deg + unchecked, signs[TORN_SHARE, i]
        torn, likely_torn = unexplained * signs[TORN, i], unexplained * signs[LIKELY_TORN, i]
        by_cause = factors.explained * signs[BY_CAUSE, i] * signs[BY_CAUSE, i]
        sure = _turned(signs[MISFIT, i], factors, by_roots, signs[UNEVEN, i], hidden, by_cause)
        likely = _turned(signs[LIKELY_MISFIT, i], factors, by_roots, signs[UNEVEN, i], hidden, by_cause)
        shown = signs[BESIDE_MISFIT, i] * signs[BESIDE_MISFIT, i] + hidden * hidden
        more, likely_more = max(shown - sure * sure, ZERO), max(shown - likely * likely, ZERO)
        sure = _with_torn(sure, torn, factors, torn_alone, torn_share)
        likely = _with_torn(likely, likely_torn, factors, torn_alone, torn_share)
        lost, noise = signs[LOST, i], signs[NOISE, i]
        least = max(likely * likely + likely_more, signs[AT_LEAST, i] * signs[AT_LEAST, i])
        out[i] = np.sqrt(max(sure * sure + more + lost * lost, least - noise * noise))


@FUSED.inlined
def _turned(
    misfit_deg: np.float32, factors: Factors, by_roots: bool, uneven: np.float32, hidden_deg: np.float32,
    by_cause: np.float32,
) -> np.float32:  # fmt: skip
    """Return by how many degrees a misfit turns normals, of whose ``uneven`` share nothing is hidden, beside what shows
    in no misfit, ``hidden_deg``, and the square of what is known to turn them, ``by_cause``. ``by_roots``: its power is
    a half, and a root is far quicker."""
    shows = max(misfit_deg, LEAST_SHOWN)
    shows = shows * np.sqrt(shows) if by_roots else shows ** (ONE + factors.power)
    misfit = factors.misfit * shows / (misfit_deg + factors.little_deg) if misfit_deg > ZERO else ZERO
    misfit -= uneven * max(misfit - misfit_deg, ZERO)
    unknown = (ONE - factors.explained) * misfit * misfit
    turned = min(unknown + by_cause, factors.most * misfit * misfit)
    return np.float32(np.sqrt(turned + hidden_deg * hidden_deg))


@FUSED.inlined
def _with_torn(
    doubt_deg: np.float32, torn_deg: np.float32, factors: Factors, alone_deg: np.float32, share: np.float32
) -> np.float32:
    """Return a doubt with what normals show that belong to no surface by ``torn_deg``: limited by the doubt itself and
    ``alone_deg``, but not below a ``share`` of it."""
    limited = min(torn_deg, factors.torn_beside * doubt_deg + alone_deg)
    return np.float32(doubt_deg + factors.torn * max(limited, share * torn_deg))
