"""By how much normals may be off because plates that were brought to one instant do not agree."""

from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Floats, Mask
from psvideo.plates.align.doubt.own_means import own_mean
from psvideo.solve.normals.evidence import Evidence, Left
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.trust.thin_surface import ThinSurface, width_of
from psvideo.solve.normals.trust.witness import SOLVED, Checked, left_over, noise_share

MOST_DEG = np.float32(180)
"""What turns a normal by more is no angle: nothing is known of its plates."""
EXPLAINED = np.float32(0.05)
"""What nobody knows of plates is known after all where it is less likely than this that they are off."""
MOST_ODDS = np.float32(30)
MOST_CHECKS = 2
"""More lights than this beyond three say no more of what is around."""
OUTLINE = (17, 17)
"""Normals on either side of an outline are called torn over this many points."""
NOISELESS = PlateNoise(read=0.0, photon=0.0)


@dataclass(frozen=True, kw_only=True)
class MovingDoubt:
    """How plates before and after an instant that disagree along the motion become degrees of doubt.

    own: how much of the angle that this makes in a pixel itself.
    around_deg, around: where the mean angle over a square of such a share of the subject's size is so large, it counts
        as well, and the square of it elsewhere: where most of what is around is not explained, what fits does so by
        chance. Under four lights that takes twice the angle, under five and more three times: they check each other.
    torn, least_torn_deg: how much of the angle counts by which normals belong to no surface, beyond what creases and
        outlines of a painted bust at rest make of it; less where one normal explains the plates of more than three
        lights, for there it is a crease.
    outline, agreed_deg: how much of that counts just within the outlines of what moves, where plates agree along the
        motion, turning a normal by less than such an angle: normals of two surfaces are torn anyway.
    torn_around, least_around_deg, torn_around_deg: and of its mean over a square of such a share, beyond the first, the
        square over the second: what is wrong throughout (blades, a checker) is hardly torn in the middle of a facet.
    torn_itself_deg: where one normal explains the plates of more than three lights, that mean counts only as far as the
        point is torn itself, wholly where it is by so much beyond ``least_torn_deg``: rods and posts are narrower than
        what is around them, of which their outlines are torn.
    near, stirring_deg, stirring_share: all of that where anything stirs: motion turns at least such a share of a square
        so wide by more than such an angle, or is followed there.
    most_deg: no more is claimed. Where plates are not explained at all, a normal is one that some of them show, and
        lies no farther off however far they disagree: of what is doubted by more than 20, 35 or 50 degrees, two thirds
        are within 21.4 to 23.5 on either half of 58 clips.

    Fitted on a mottled ball, a painted bust and a bare box of 3, 5 and 8 lights that slide, spin and tumble by 1 to 16
    px from flash to flash: nine tenths of what is measured is off by no more than twice what is predicted. What is torn
    counts by turning fans as well. Outlines and lights that check each other were chosen on 25 clips of cloths, fans,
    boxes, balls, busts and a vase, and checked on 29 others.
    """

    own: float = 1.6
    around_deg: float = 3.0
    around: float = 0.1
    torn: float = 1.0
    outline: float = 0.25
    agreed_deg: float = 1.0
    least_torn_deg: float = 3.0
    least_around_deg: float = 2.0
    torn_around: float = 0.15
    torn_around_deg: float = 2.0
    torn_itself_deg: float = 6.0
    near: float = 0.3
    stirring_deg: float = 0.5
    stirring_share: float = 0.02
    most_deg: float = 23.0


def moved_deg(points: ThinSurface, one: Evidence, noise: PlateNoise = NOISELESS) -> Floats | None:
    """Return by which angle what is unsure of the plates turns the points' normals, in degrees; None where nothing
    moved. More than MOST_DEG is no angle: nothing is known there.

    The errors of lights are taken as independent, and spread as least squares spreads them across the normal. Where one
    normal explains the plates of more than three lights as it explains what stands still, they are hardly off.
    """
    if one.unsure is None or not one.moved:
        return None
    normals = points.surface.normals.astype(np.float32)
    strength = one.lit.intensities.mean(axis=1)
    matrix = one.lit.directions * strength[:, None]
    pulls = np.linalg.pinv(matrix).T.astype(np.float32)
    size = np.maximum(points.brightness, np.float32(1e-6))
    turned, likely, shown = np.zeros((3, *points.known.shape), np.float32)
    for pull, plane, row, lamp in zip(pulls, one.unsure, matrix, strength, strict=True):
        across = np.maximum(np.float32(pull @ pull) - (normals @ pull) ** 2, 0)
        off = cv2.resize(plane, points.known.shape[::-1], interpolation=cv2.INTER_LINEAR)
        most = np.minimum(off, size * np.float32(lamp))  # a plate is off by no more light than a lamp gives
        turned += across * off * off
        likely += across * most * most
        shown += np.float32((1 - row @ pull) / lamp**2) * most * most
    scale = np.float32(np.rad2deg(1)) * points.known / size
    turned, likely = np.sqrt(turned) * scale, np.sqrt(likely) * scale
    if one.left is None or len(one.plates) <= SOLVED:
        return np.asarray(turned, np.float32)
    dark = noise_share(points, noise, float(strength.mean()))
    share = _off_share(one.left, points.known, shown / (size * size), dark)
    known = (turned <= MOST_DEG) | (share < EXPLAINED)
    return np.asarray(np.where(known, likely * share, turned), np.float32)


def _off_share(left: Left, known: Mask, off: Floats, noise: Floats) -> Floats:
    """Return how likely plates are off by as much as is unsure of them: what a normal leaves of them is Gaussian and so
    large then, and else as large as of what stands still; before anything is seen, either is as likely.

    ``off`` is the sum of squares that would be left, ``noise`` what is left of noise, both in units of albedo.
    """
    free, usual, seen = left_over(left, known, noise)
    square = off / np.maximum(free, 1) + usual
    odds = free * np.log(square / usual) - seen * (1 / usual - 1 / square)
    return np.asarray(np.where(free > 0, 1 / (1 + np.exp(np.clip(odds / 2, -MOST_ODDS, MOST_ODDS))), 1), np.float32)


def moving_doubt_deg(
    turned_deg: Floats,
    torn_deg: Floats,
    known: Floats,
    moves: Mask | None = None,
    *,
    steadied: bool = False,
    check: Checked | None = None,
    how: MovingDoubt = MovingDoubt(),
) -> Floats:
    """Return by how many degrees normals may be off for motion, (row, col) of the points.

    ``torn_deg`` is by how much normals belong to no surface: where motion was followed to the wrong place, plates of
    the lights show edges beside each other, and normals between them fit nothing around. What moves and what stands
    still, on a grid of its own, ``moves``, do not speak for each other. Of plates that were ``steadied`` nothing else
    was followed, and what is torn is an edge as at rest. ``check`` is what more than three lights say.
    """
    size, own = (width_of(known, how.around),) * 2, at_points(moves, known.shape)
    tells = known * (turned_deg <= MOST_DEG)  # beyond that nothing is known, and nothing is said of what is around
    turned = own_mean(np.minimum(turned_deg, np.float32(60)) * tells, size, own)
    around = turned / np.maximum(own_mean(tells, size, own), np.float32(1e-6))
    stirs = stirring(turned_deg, tells, own, steadied=steadied, how=how)
    apart = stirs * _torn_doubt(turned_deg, torn_deg, tells, own, check, how)
    enough_deg = how.around_deg * (1 if check is None else 1 + min(check.beyond, MOST_CHECKS))
    doubt = np.float32(how.own) * turned_deg + around * around / np.float32(enough_deg) + apart
    return np.asarray(np.minimum(doubt, np.float32(how.most_deg)), np.float32)


def at_points(moves: Mask | None, shape: tuple[int, ...]) -> Mask:
    """Return what ``moves``, on a grid of its own, at points of this ``shape``; None moves nowhere."""
    if moves is None:
        return np.zeros(shape, np.bool_)
    grown = cv2.resize(moves.astype(np.uint8), shape[::-1], interpolation=cv2.INTER_NEAREST)
    return np.asarray(grown > 0)


def stirring(
    turned_deg: Floats, known: Floats, moves: Mask, *, steadied: bool = False, how: MovingDoubt = MovingDoubt()
) -> Floats:
    """Return how far anything stirs near the points, 0 to 1 (row, col): what ``moves``, at the points themselves, and
    what motion turns; of plates that were ``steadied`` only the former."""
    stirs = moves if steadied else (turned_deg > how.stirring_deg) | moves
    share = cv2.blur(stirs.astype(np.float32), (width_of(known, how.near),) * 2)
    return np.asarray(np.minimum(share / np.float32(how.stirring_share), 1), np.float32)


def _torn_doubt(
    turned_deg: Floats,
    torn_deg: Floats,
    known: Floats,
    moves: Mask,
    check: Checked | None,
    how: MovingDoubt,
) -> Floats:
    size = (width_of(known, how.torn_around),) * 2
    around = cv2.blur(torn_deg * known, size) / np.maximum(cv2.blur(known, size), np.float32(1e-6))
    own = np.maximum(torn_deg - np.float32(how.least_torn_deg), 0)
    around = np.maximum(around - np.float32(how.least_around_deg), 0)
    around *= around / np.float32(how.torn_around_deg)
    if check is not None:
        around *= np.maximum(check.puzzling, np.minimum(own / np.float32(how.torn_itself_deg), 1))
        own *= check.puzzling
    agreed = _on_outline(moves) & (turned_deg < how.agreed_deg)
    own *= np.where(agreed, np.float32(how.outline), 1)
    return np.asarray(np.float32(how.torn) * own + around, np.float32)


def _on_outline(moves: Mask) -> Mask:
    """Return what moves and lies beside its outline: what it comes from behind is torn by shadows and false motion."""
    return np.asarray(moves & (cv2.erode(moves.view(np.uint8), np.ones(OUTLINE, np.uint8)) == 0))
