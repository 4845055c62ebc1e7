"""Whether photographs contradict what was assumed of them: their transfer curve and the exposures in their files.

A matte surface under known lights leaves small residuals; a wrong assumption makes them larger.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from psvideo.clip.decode.decoders import read_header
from psvideo.clip.folder import KINDS
from psvideo.clip.reading import looks
from psvideo.clip.stated import Stated, are_uneven, relative_exposures, says_as
from psvideo.clip.stills import Photographs
from psvideo.model.arrays import Doubles
from psvideo.runs.photographs.glance import Glance, few_signals

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
        shown = few_signals(pictures, file)
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
