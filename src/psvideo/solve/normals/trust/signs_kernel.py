"""The compiled loops of the signs of doubt: what lies between one mean over squares and the next, in one pass each.

Numpy took a pass of a small picture for every operation, sixty of them. All are planes of the points in one line,
(point,), but those that look at neighbours, (row, col).
"""

import math

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Bytes, Floats

ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)
TINY = np.float32(1e-9)
"""Means over squares are this much larger, so that they can be divided by."""
TO_DEG = np.float32(180 / math.pi)


@FUSED.kept
def fill_squares(
    fit_deg: Floats, of_noise_deg: Floats, known: Bytes, albedo: Floats, wider: Floats, plain: bool,
    unsure: float, most_deg: float, squares: Floats, noise: Floats, shown: Floats,
) -> None:  # fmt: skip
    """Fill ``squares`` with what residuals predict beyond ``unsure`` times what they would of noise, ``noise``, the
    square of that, and ``shown``, the albedo where anything is known.

    ``wider`` is by how much noise grows with the lights that reach a point, unless the fit is ``plain``, which uses all
    of them.
    """
    margin, most = np.float32(unsure), np.float32(most_deg)
    for i in range(len(squares)):
        grows = ONE if plain else wider[i]
        noise[i] = of_noise_deg[i] * of_noise_deg[i] * grows
    for i in range(len(squares)):
        fit = min(fit_deg[i], most)
        squares[i] = fit * fit - margin * noise[i] if known[i] else ZERO
        shown[i] = albedo[i] if known[i] else ZERO


@FUSED.kept
def fill_weighed(
    noise: Floats, shown: Floats, counts: Floats, lights: int, plain: bool, most_shown: float, most_noise: float,
    weighed: Floats,
) -> None:  # fmt: skip
    """Limit ``shown`` to ``most_shown``, and fill ``weighed`` (4, point) with it, with whether it is any, with it times
    the noise, and times as much of that as is not sure, up to ``most_noise``: nothing where a fit that is not ``plain``
    used no more lights than it has unknowns."""
    most, limit, four = np.float32(most_shown), np.float32(most_noise), np.float32(lights - 3)
    for i in range(len(noise)):
        weight = min(shown[i], most)
        checked = plain or counts[i] < four
        shown[i] = weight
        weighed[0, i] = weight
        weighed[1, i] = ONE if weight > ZERO else ZERO
        weighed[2, i] = noise[i] * weight
        weighed[3, i] = min(noise[i], limit) * weight if checked else ZERO


@FUSED.kept
def fill_levels(means: Floats, points: float, certain: float, unsure: float, levels: Floats) -> None:
    """Fill ``levels`` (3, point), from the means over squares of so many ``points`` of what ``fill_weighed`` gave: the
    mean weight, what chance could leave of noise, ``certain`` standard errors, and what was taken off as ``unsure`` of
    it."""
    count_of, errors, share = np.float32(points), np.float32(certain), np.float32(unsure)
    for i in range(levels.shape[1]):
        here, count = means[0, i] + TINY, (means[1, i] + TINY) * count_of
        levels[0, i] = here
        levels[1, i] = errors * np.sqrt(np.float32(2) / max(count, ONE)) * (means[2, i] + TINY) / here
        levels[2, i] = share * (means[3, i] + TINY) / here


@FUSED.kept
def fill_limited(
    squares: Floats, shown: Floats, noise: Floats, weight: Floats, means: Floats, outlying: float, passed: float,
    least: float, limited: Floats,
) -> None:  # fmt: skip
    """Fill ``limited`` with the weighed squares, up to ``outlying`` times what is typical by the means so far, or
    ``least``, and ``passed`` times the noise."""
    times, passes, low = np.float32(outlying), np.float32(passed), np.float32(least)
    for i in range(len(squares)):
        typical = (means[i] + TINY) / weight[i]
        limited[i] = min(squares[i], times * max(typical, low) + passes * noise[i]) * shown[i]


@FUSED.kept
def raise_to_roots(
    means: Floats, weight: Floats, by_chance: Floats, margin: Floats, surely: Floats, likely: Floats
) -> None:
    """Raise ``surely`` and ``likely`` to the root of what is typical by the means, without what chance could leave, and
    with the margin back."""
    for i in range(len(means)):
        typical = (means[i] + TINY) / weight[i]
        surely[i] = max(surely[i], np.sqrt(max(typical - by_chance[i], ZERO)))
        likely[i] = max(likely[i], np.sqrt(max(typical + margin[i], ZERO)))


@FUSED.kept
def fill_changes(
    fit: Floats, known: Bytes, noise: Floats, apart: int, most_deg: float, scale: float, unsure: float, out: Floats
) -> None:
    """Fill ``out`` with the mean square of half the differences to the points so far ``apart`` below and to the right,
    times ``scale``, beyond ``unsure`` times the noise."""
    rows, cols = out.shape
    most, times, margin = np.float32(most_deg), np.float32(scale), np.float32(unsure)
    for row in range(rows):
        below = row + apart if row + apart < rows else row
        for col in range(cols):
            beside = col + apart if col + apart < cols else col
            here, total, count = min(fit[row, col], most), ZERO, TINY
            if known[row, col] and known[below, col] and below > row:
                change = here - min(fit[below, col], most)
                total += change * change * HALF
                count += ONE
            if known[row, col] and known[row, beside] and beside > col:
                change = here - min(fit[row, beside], most)
                total += change * change * HALF
                count += ONE
            out[row, col] = total / count * times - margin * noise[row, col]


@FUSED.kept
def fill_torn(planes: Floats, known: Bytes, least_facing: float, most_torn: float, torn: Floats) -> None:
    """Fill ``torn`` (2, row, col) with what slopes of normals (3, row, col) around four points add up to, as they are
    seen, and with 1 where these four are known, else zeros."""
    least, most, quarter = np.float32(least_facing), np.float32(most_torn), np.float32(0.25)
    rows, cols = known.shape
    facing, right, down = (
        np.empty((2, cols), np.float32),
        np.empty((2, cols), np.float32),
        np.empty((2, cols), np.float32),
    )
    torn[:, rows - 1] = ZERO
    for row in range(rows):
        new, old = row % 2, 1 - row % 2
        for col in range(cols):
            facing[new, col] = max(planes[2, row, col], least)
            right[new, col] = -planes[0, row, col] / facing[new, col]
            down[new, col] = planes[1, row, col] / facing[new, col]
        if row == 0:
            continue
        for col in range(cols - 1):
            along = right[old, col] + right[old, col + 1] - right[new, col] - right[new, col + 1]
            over = down[old, col + 1] + down[new, col + 1] - down[old, col] - down[new, col]
            seen = (facing[old, col] + facing[new, col] + facing[old, col + 1] + facing[new, col + 1]) * quarter
            whole = (along + over) * HALF * seen * np.sqrt(seen)
            within = known[row - 1, col] & known[row, col] & known[row - 1, col + 1] & known[row, col + 1]
            torn[0, row - 1, col] = min(max(whole, -most), most) if within else ZERO
            torn[1, row - 1, col] = ONE if within else ZERO
        torn[0, row - 1, cols - 1] = ZERO
        torn[1, row - 1, cols - 1] = ZERO


@FUSED.kept
def square_torn(means: Floats, torn: Floats, scale: float) -> None:
    """Put in the place of what slopes add up to, ``torn`` (2, point), the square of its mean over squares of points,
    in units that ``scale`` makes, where it is known."""
    times = np.float32(scale)
    for i in range(torn.shape[1]):
        each = (means[0, i] + TINY) / (means[1, i] + TINY) * times
        torn[0, i] = each * each * torn[1, i]


@FUSED.kept
def fill_torn_deg(
    means: Floats, noise_deg: Floats, misfit_deg: Floats, uneven: Floats, surely: float, of_noise: float,
    torn_deg: Floats,
) -> None:  # fmt: skip
    """Fill ``torn_deg`` (2, point) with the angle by which normals ``surely`` belong to no surface, beyond what this
    share of noise and of an ``uneven`` misfit makes of it, and that by which they likely do not, beyond the share
    ``of_noise`` of noise; the means are of what ``square_torn`` gave."""
    sure, likely = np.float32(surely * surely), np.float32(of_noise * of_noise)
    for i in range(torn_deg.shape[1]):
        squared, noise = (means[0, i] + TINY) / (means[1, i] + TINY), noise_deg[i] * noise_deg[i]
        squared -= sure * uneven[i] * misfit_deg[i] * misfit_deg[i]
        torn_deg[0, i] = np.sqrt(max(squared - sure * noise, ZERO))
        torn_deg[1, i] = np.sqrt(max(squared - likely * noise, ZERO))


@FUSED.kept
def fill_indirect_deg(
    planes: Floats, sums: Floats, counts: Floats, near: Floats, far: Floats, noise_deg: Floats, added: Floats,
    least: float, out: Floats,
) -> None:  # fmt: skip
    """Fill by how many degrees light from around turns normals (3, point): its share of the albedo, ``sums`` over
    ``counts`` of lights, in the means over squares, ``near`` and ``far`` (2, point), and what a point itself shows
    beyond noise, times how far least squares turns a normal for light that every lamp adds, which it takes for the
    vector ``added``."""
    x, y, z, few = added[0], added[1], added[2], np.float32(least)
    size, noisy = x * x + y * y + z * z, np.float32(2) / TO_DEG
    for i in range(len(out)):
        farther = (far[0, i] + TINY) / max(far[1, i] + TINY, few)
        around = max((near[0, i] + TINY + few * farther) / (near[1, i] + TINY + few), ZERO)
        own = max(sums[i] / max(counts[i], ONE) - noisy * noise_deg[i], ZERO)
        along = x * planes[0, i] + y * planes[1, i] + z * planes[2, i]
        out[i] = TO_DEG * (around + own) * np.sqrt(max(size - along * along, ZERO))
