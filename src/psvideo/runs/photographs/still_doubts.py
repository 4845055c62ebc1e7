"""Whether photographs contradict what was assumed of them: their transfer curve and the exposures in their files.

A matte surface under known lights leaves small residuals; a wrong assumption makes them larger.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode.decoders import opened, read_header
from psvideo.clip.folder import KINDS
from psvideo.clip.in_file import RowsInFile
from psvideo.clip.reading import looks
from psvideo.clip.record import Header
from psvideo.clip.stated import Stated, are_uneven, relative_exposures, says_as
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
TELLING_LIGHTS = 5
"""Of four lights one value a pixel is left over, which a little gloss brings down under a wrong curve: by two thirds on
pictures of a rendered scene that were sRGB."""
CLEARLY = 0.85
"""Another assumption is named where it leaves less than this share of what is left over."""
EXPLAINED = 0.12
"""Another assumption is named only where it leaves no more than this: what neither explains shines, as metal does, and
says nothing of a curve. (Right curves leave 6 to 9 % on photographs of plaster and stone; a coin's 43 % become 15 %
under a wrong one.)"""
MOST_BENT = 0.25
"""A wrong curve leaves no more than this over. (Metal leaves 25 to 45 %, and a wrong curve explains it better.)"""
IN_CODES = 0.98
"""Another assumption is named only where, in the pictures' codes, it leaves less than this share of
what is left: where a surface bends little, every curve explains it, and in light that is a straight line of codes their
noise is less. (Linear pictures that were read as sRGB: 0.29 to 0.96; sRGB as it is: 1.00 and more.)"""
ALIKE, NEARLY_ALL, LEAST_AMBIENT = 0.02, 0.99, 0.05
"""A picture of the room's light is brighter than no other by more than noise of 8 bits, at nearly all of its pixels,
and brighter than black: this share of a typical signal."""


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
    signals = [_thin(pictures, file) for file in pictures.files]
    green = [light.intensity[min(1, len(light.intensity) - 1)] for light in lights]
    dark = signals.pop() if len(signals) > len(lights) else None
    return Glance(signals=np.array(signals), dark=dark, directions=np.array(directions), strengths=np.array(green))


def _thin(pictures: Photographs, file: Path) -> Doubles:
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


def dark_doubt(glance: Glance | None, pictures: Photographs, aside: Sequence[Path]) -> str | None:
    """Say which picture that belongs to no light (``aside``) may show the scene with every light off: it is as large
    and of the same kind, brighter than none of the others anywhere, and not black."""
    if glance is None or glance.dark is not None:
        return None
    least, black = glance.signals.min(axis=0), np.median(glance.signals) * LEAST_AMBIENT
    for file in aside:
        if KINDS.get(file.suffix.lower()) != pictures.kind or looks(read_header(pictures.kind, file)) != looks(
            pictures.header
        ):
            continue
        shown = _thin(pictures, file)
        if np.mean(shown <= least + ALIKE) > NEARLY_ALL and np.median(shown) > black:
            return (
                f"{file.name} belongs to no light and is nowhere brighter than the others. If it shows the scene with "
                f"every light off, say `dark={str(file)!r}`: its light is in all pictures then, and tilts normals."
            )
    return None


def curve_doubt(glance: Glance | None, pictures: Photographs) -> str | None:
    """Say where another curve explains the pictures clearly better than the one that was assumed. Under four lights
    gloss alone does that, and nothing is said."""
    if glance is None or len(glance.directions) < TELLING_LIGHTS:
        return None
    mine, other = pictures.transfer, "linear" if pictures.transfer != "linear" else "srgb"
    left, better = glance.left_over(mine), glance.left_over(other)
    if left > MOST_BENT or not better < min(CLEARLY * left, EXPLAINED):
        return None
    of_codes, better_of_codes = glance.left_of_codes(mine, other)
    if not better_of_codes < IN_CODES * of_codes:
        return None
    return (
        f"The pictures were read as {mine!r}, {pictures.because}; but read as {other!r} they fit the lights better: "
        f"{100 * better:.1f} % of the light is left over instead of {100 * left:.1f} %. If that is how they were made, "
        f"say `transfer={other!r}`."
    )


def _not_all_say(lights: Sequence[Stated]) -> str | None:
    """Say that only some pictures say how they were exposed, or not all of them by the same tags of EXIF."""
    known = [one for one in lights if one.exposure is not None]
    if known and len(known) < len(lights):
        return f"Only {len(known)} of {len(lights)} pictures say how they were exposed; none is scaled."
    tags = sorted({one.exposed_by for one in known}, key=len)
    if len(tags) < 2:
        return None
    few, many = (" and ".join(one) for one in (tags[0], tags[-1]))
    return f"Some pictures say how they were exposed by {many}, others by {few} alone; none is scaled."


def exposures_of(
    glance: Glance | None, pictures: Photographs, count: int
) -> tuple[Doubles | None, str | None, str | None]:
    """Return by how much more each picture, the dark one last, was exposed than the usual one of ``count`` lights; None
    where all are alike or their files cannot be believed. With what to note, and what to warn of."""
    relative = relative_exposures(pictures.stated[:count], pictures.stated[count:])
    if relative is None:
        return None, _not_all_say(pictures.stated[:count]), None
    lights = relative[:count]
    odd = pictures.files[int(np.argmax(np.abs(np.log(relative))))].name
    times = float(np.exp(np.abs(np.log(relative)).max()))
    said = f"By their EXIF the pictures were exposed differently ({odd} by a factor {times:.2g} from the usual)"
    scaled = "their lights' strengths were" if are_uneven(lights) else "the ambient light was"
    silent = None
    if not all(says_as(one, pictures.stated[0]) for one in pictures.stated[count:]):
        silent = (
            f"{pictures.files[count].name} does not say how it was exposed, and the other pictures differ. Its light "
            "is taken off as of one exposed as most are. Give it as the camera wrote it."
        )
    plain = float("nan") if glance is None else glance.left_over(pictures.transfer)
    if glance is None or np.isnan(plain):
        return relative, f"{said}; {scaled} scaled by it.", silent
    left = glance.exposed(relative).left_over(pictures.transfer)
    if left < (plain if are_uneven(lights) else plain / CLEARLY):  # a dim room says little of the dark picture alone
        return relative, f"{said}, and the pictures agree: {scaled} scaled by it.", silent
    return (
        None,
        None,
        f"{said}, but the pictures do not show it: scaled by it, {100 * left:.1f} % of the light is left over, and "
        f"{100 * plain:.1f} % as they are. EXIF was not believed; check whether the files were developed or edited.",
    )
