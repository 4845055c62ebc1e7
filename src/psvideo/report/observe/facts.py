"""The facts of one round: what its plates and its surface say of the subject, in a few numbers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import quantile
from psvideo.model.arrays import Flags
from psvideo.model.channels import brightest_channel
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.model.surface import Misfit, Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.sequence import Round
from psvideo.report.observe.motion import Motion
from psvideo.report.observe.steadiness import Change
from psvideo.report.observe.thinned import slips, step_of, thin_surface, thinned
from psvideo.solve.filling.filled import holes_in
from psvideo.solve.normals.plate_noise import noise_of
from psvideo.solve.normals.solving import CERTAIN
from psvideo.solve.passes.alpha_matte import lit_from

LIT = 0.01
"""A pixel brighter than this share of saturation under any light is part of the scene, unless it is a dim backdrop's;
of dark takes, than a sixth of their brightest hundredth."""
DARKEST = 1 / 6
FEW, FAR_BRIGHTER = 8, 3.0
"""Of a small subject so many of the points looked at are bright, more than a sensor's hot pixels; they are so many
times as bright as the brightest hundredth where that is not the subject's."""
FAINT = 2.0**-12
SHINES = 0.1
"""A light that gives less than this share of the brightest does not shine on a point: it is in shadow there."""
FEWEST_MOVING = 32
"""Of fewer points that move no share is known."""


@dataclass(frozen=True, kw_only=True, slots=True)
class InstantFacts:
    """What one round gave: which shares of what is lit (or masked) are valid or saturated, and which share of rows no
    frame saw; ``borrowed_share`` is that of rows that other rounds showed. A void background counts as neither.
    ``change`` is what differs from the result before, at rest.

    ``valid_share`` and ``measured_share``, what three lights reach, are None where no normals were solved, or a mask is
    black or slips between the points that are counted, the latter where nothing was filled as well. Of a black mask no
    light is known either: ``levels``, ``clipped`` and ``white`` are empty. ``levels`` (light) is each
    light's mean on the subject, 1.0 = saturation; ``clipped`` (light) the share of what was seen of it that is
    saturated, ``white`` (light) the light at which its plate is.
    ``ambient`` is the ambient light's share of what an exposure holds. ``speed_px_s`` is how fast the fastest parts
    move, and ``moving_share`` how much of the picture does; None where it is not known. What changes too fast to be
    followed has a share and no speed. ``moving_valid_share`` is which share is valid of what moves and three lights
    reach, moving shadows too; None where hardly anything does.
    ``misfit`` is what the robust solver found common to the whole picture, ``slope_deg`` by how much typical normals
    are turned as albedo that goes with the slope shows it, ``likely_deg`` how far off they are likely to be beyond
    noise, None where nothing shows it. ``spoilt_share`` is the share of the subject of which clipping leaves fewer than
    three lights, where three and more shine.
    """

    number: int
    time_s: float
    valid_share: float | None
    clipped_share: float
    unseen_share: float
    borrowed_share: float = 0.0
    change: Change | None = None
    levels: tuple[float, ...] = ()
    clipped: tuple[float, ...] = ()
    white: tuple[float, ...] = ()
    ambient: float | None = None
    speed_px_s: float | None = None
    moving_share: float | None = None
    misfit: Misfit | None = None
    measured_share: float | None = None
    moving_valid_share: float | None = None
    slope_deg: float = 0.0
    likely_deg: float | None = None
    spoilt_share: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Seen:
    """One round, thinned: the lights' ``bright`` (light, row, col) by their brightest channel, which of these pixels
    are known, ``shown`` (light, row, col), and the subject, (row, col); ``beyond`` is by how much brighter than the
    subject's brightest hundredth that of what a mask leaves out is, 0 without a mask."""

    bright: NDArray[np.float32]
    shown: NDArray[np.bool_]
    subject: NDArray[np.bool_]
    beyond: float = 0.0

    @cached_property
    def light(self) -> list[NDArray[np.float32]]:
        """What is known of the subject's light, (sample,) of each light."""
        known = self.subject & self.shown
        return [picture[where] for picture, where in zip(self.bright, known, strict=True)]


@dataclass(frozen=True, kw_only=True)
class Dark:
    """The ambient light of one exposure, thinned: its brightest channel, ``level``, and where it is ``known``, both
    (row, col)."""

    level: NDArray[np.float32]
    known: NDArray[np.bool_]


def thinned_round(one: Round, mask: NDArray[np.bool_] | None) -> Seen:
    """Return a round thinned out, and where its subject is."""
    step = step_of(*one.plates[0].shape[:2])
    bright = np.stack([brightest_channel(plate.picture.thinned(step)) for plate in one.plates])
    shown = np.stack([plate.pixels_seen[::step, ::step] for plate in one.plates])
    most = bright.max(axis=0)
    if mask is not None:
        subject = thinned(mask)
        return Seen(bright=bright, shown=shown, subject=subject, beyond=_beyond(most, subject))
    lit = most > lit_from(most, _least_light(one, most))
    return Seen(bright=bright, shown=shown, subject=lit | holes_in(lit))


def _least_light(one: Round, most: NDArray[np.float32]) -> float:
    """Return from which light on a pixel may be the subject's, LIT at most. The brightest hundredth may be the noise
    around a small subject: where something is far brighter, what does not stand out of noise is none of it."""
    dim, bright = (DARKEST * quantile(some, share) for some, share in (
        (most[::2, ::2], 0.99), (most, 1 - min(FEW / most.size, 0.01))
    ))  # fmt: skip
    if dim >= LIT or bright < FAR_BRIGHTER * dim:
        return min(LIT, dim)
    noise = noise_of([plate.picture for plate in one.plates])
    return min(LIT, max(dim, min(bright, CERTAIN * max(noise.dark, noise.least))))


def share_of(flags: Flags) -> float:
    """Return which share of some flags is set, at least one."""
    return np.count_nonzero(flags) / flags.size


def _beyond(most: NDArray[np.float32], subject: NDArray[np.bool_]) -> float:
    if not subject.any() or subject.all():
        return 0.0
    inside, outside = (quantile(most[where], 0.99) for where in (subject, ~subject))
    return outside / max(inside, FAINT)


def instant_facts(
    one: Round,
    surface: Surface | None,
    mask: NDArray[np.bool_] | None,
    change: Change | None = None,
    *,
    seen: Seen | None = None,
    some: Surface | None = None,
    moving: Motion | None = None,
    stirs: Flags | None = None,
    dark: Dark | None = None,
) -> InstantFacts:
    """Return what to remember of one round; ``change`` is how its surface differs from the one before, ``stirs`` what
    moves in it, on any grid, ``dark`` the ambient light, thinned out as ``seen`` is, and ``some`` the surface, thinned.
    Of a mask that holds none of the points, or is black, nothing is known."""
    seen = seen or thinned_round(one, mask)
    some = thin_surface(surface) if some is None and surface is not None else some
    left_out = mask is not None and not mask.any()
    subject, lights, plates = (seen.subject, [], ()) if left_out else (seen.subject, seen.light, one.plates)
    valid, measured = (None, None) if left_out or slips(mask) else _shares(surface, some, subject)
    whites = [plate.saturation for plate in plates]
    shares = [share_of(light >= white) if light.size else 0.0 for light, white in zip(lights, whites, strict=True)]
    levels = [float(light.mean()) if light.size else 0.0 for light in lights]
    return InstantFacts(
        number=one.number,
        time_s=one.time_s,
        valid_share=valid,
        measured_share=measured,
        clipped_share=float(np.mean(shares)) if shares else 0.0,
        unseen_share=float(np.mean([1 - share_of(plate.lines_seen) for plate in one.plates])),
        borrowed_share=float(np.mean([_borrowed(plate) for plate in one.plates])),
        change=change,
        levels=tuple(level / white for level, white in zip(levels, whites, strict=True)),
        clipped=tuple(shares),
        white=tuple(whites),
        ambient=_ambient_share(
            dark,
            subject,
            [
                level * plate.brightest_share
                for level, light, plate in zip(levels, lights, plates, strict=True)
                if light.size
            ],
        ),
        speed_px_s=None if moving is None else moving.speed_px_s,
        moving_share=None if moving is None else moving.share,
        misfit=None if surface is None else surface.misfit,
        slope_deg=0.0 if surface is None else surface.slope_deg,
        likely_deg=None if surface is None else surface.likely_deg,
        spoilt_share=0.0 if left_out or not any(shares) else _spoilt(seen, whites),
        moving_valid_share=None if some is None or stirs is None else _moving_valid(some, subject, stirs),
    )


def _spoilt(seen: Seen, whites: list[float]) -> float:
    """Return the share of the subject that fewer than three lights show below ``whites`` (light,), of three and more
    that shine on it."""
    shines = seen.shown & (seen.bright > SHINES * seen.bright.max(axis=0))
    clips = shines & (seen.bright >= np.array(whites, np.float32)[:, None, None])
    reached = shines.sum(axis=0)
    spoilt = clips.any(axis=0) & (reached >= LEAST_LIGHTS) & (reached - clips.sum(axis=0) < LEAST_LIGHTS)
    return int(np.count_nonzero(spoilt & seen.subject)) / max(int(np.count_nonzero(seen.subject)), 1)


def _moving_valid(some: Surface, subject: Flags, stirs: Flags) -> float | None:
    """Return which share is valid of what moves and was measured, of a thinned surface."""
    (rows, cols), (high, wide) = subject.shape, stirs.shape
    moves = stirs[np.ix_(np.arange(rows) * high // rows, np.arange(cols) * wide // cols)]
    there = subject & moves & (some.measured if some.source is not None else some.shown)
    count = int(there.sum())
    return float((some.valid & there).sum() / count) if count >= FEWEST_MOVING else None


def _shares(
    surface: Surface | None, some: Surface | None, subject: NDArray[np.bool_]
) -> tuple[float | None, float | None]:
    """Return which shares of the subject are valid and measured, of a surface and the same, thinned. Of a surface that
    was filled, noise is none of it; of one that was emptied, what was measured is not known."""
    if surface is None or some is None:
        return None, None
    filled = surface.source is not None and bool((surface.source > surface.valid.view(np.uint8)).any())
    whole = subject & some.shown if filled else subject
    count = max(int(whole.sum()), 1)
    valid, measured = (float(np.count_nonzero(part & whole) / count) for part in (some.valid, some.measured))
    return valid, measured if filled or valid == 1 else None


def _borrowed(plate: LightPlate) -> float:
    """Return the share of a plate's rows that come from another round: half a round away and more."""
    if plate.shown_s is None:
        return 0.0
    shown_s, seen = np.broadcast_arrays(plate.shown_s.reshape(plate.shape[0], -1), plate.lines_seen)
    times_s, counts = np.unique(shown_s[seen], return_counts=True)
    own = counts[np.abs(times_s - plate.time_s).argmin()] if len(counts) else 0
    return float((counts.sum() - own) / shown_s.size)


def _ambient_share(dark: Dark | None, subject: NDArray[np.bool_], levels: list[float]) -> float | None:
    """Return which share of what a row under one light holds is ambient light, in the mean over subject and lights, of
    what was seen of either."""
    if dark is None or not levels or not (subject & dark.known).any():
        return None
    level = max(float(dark.level[subject & dark.known].mean()), 0.0)
    return level / max(level + float(np.mean(levels)), 1e-9)
