"""A mirror sphere at one place, seen in one or several sets of pictures: its outline, and one highlight per light."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.mirror.highlights import FoundHighlight, find_highlights
from psvideo.calibrate.mirror.spots import Spot
from psvideo.calibrate.sphere.marked import held_against_picture
from psvideo.calibrate.sphere.outline import Outline, find_outlines, follow_outline, given_outline
from psvideo.calibrate.sphere.sphere_view import Looking
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.arrays import Doubles, Floats

MOST_CUT = 0.15
"""Share of the outline that may lie outside the picture."""
LEAST_RADIUS_PX = 15.0


class SphereNotFoundError(PsvideoError):
    """No usable sphere in the pictures; ``picture`` (row, col), linear, shows where it was looked for."""

    def __init__(self, message: str, picture: Floats) -> None:
        """Keep the picture beside the message."""
        super().__init__(message)
        self.picture = picture


@dataclass(frozen=True, kw_only=True)
class Highlight:
    """A light's highlight on one sphere over all sets: place (x, y), standard error in pixels, and what spoke against.

    ``fault`` says why there is none; ``alike`` are other spots that could be it; ``rejected`` those that could not.
    """

    light: str
    place: Doubles | None
    error_px: float = 0.0
    radius_px: float = 0.0
    clipped: bool = False
    sets: int = 0
    fault: str = ""
    alike: tuple[Spot, ...] = ()
    rejected: tuple[Spot, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Sighting:
    """A sphere at one place. ``picture`` (row, col), linear, is the brightest of all lights, for showing it.

    ``moved_px`` is how far the outline moved between sets, root mean square; ``doubt`` what the pictures say against an
    outline that was marked by hand.
    """

    where: str
    outline: Outline
    highlights: tuple[Highlight, ...]
    picture: Floats
    sets: int
    moved_px: float = 0.0
    doubt: str = ""


def size_px(sighting: Sighting) -> tuple[int, int]:
    """Return width and height of the pictures on which a sphere was seen."""
    rows, cols = sighting.picture.shape
    return cols, rows


def cut_differently(sightings: Sequence[Sighting]) -> str:
    """Return the sizes of the spheres' pictures where they differ: where the lens's axis is in them is not known."""
    sizes = dict.fromkeys(map(size_px, sightings))
    return " and ".join(f"{cols} x {rows}" for cols, rows in sizes) if len(sizes) > 1 else ""


def lacking_for_positions(sightings: Sequence[Sighting]) -> str:
    """Return what is to be given for near lights to get positions, where it was not."""
    return "pictures that are not cropped" if cut_differently(sightings) else "`radius_mm` and the focal length"


def sight_spheres(
    sets: Iterable[LightPictures], looking: Looking, *, where: str, room: NDArray[np.float32] | None = None
) -> list[Sighting]:
    """Return every sphere of a scene that stood still, with the mean place of each light's highlight.

    ``room`` is a picture of the same scene on which the outline shows well, such as one under room light. Raises
    SphereNotFoundError where fewer spheres than expected are found, or one is cut by the frame.
    """
    outlines: list[Outline] = []
    doubts: list[str] = []
    fits: list[list[Doubles]] = []
    found: list[list[list[FoundHighlight]]] = []
    shown: Floats | None = None
    for count, pictures in enumerate(sets, start=1):
        brightest = pictures.grey.max(axis=0)
        if shown is None:
            shown = brightest
            outlines, doubts = _first_outlines(pictures, looking, where, room)
            fits, found = [[] for _ in outlines], [[] for _ in outlines]
        for n, outline in enumerate(outlines):
            fits[n].append(outline.place if outline.given or count == 1 else follow_outline(pictures, outline))
            found[n].append(find_highlights(pictures, outline))
    if shown is None:
        raise PsvideoError(f"{where}: holds no pictures of lights. Name a folder of stills or plates, or a clip.")
    return [
        replace(_sighting(_where(where, n, len(outlines)), outline, np.array(places), seen, shown), doubt=doubt)
        for n, (outline, doubt, places, seen) in enumerate(zip(outlines, doubts, fits, found, strict=True))
    ]


def _where(where: str, n: int, count: int) -> str:
    return where if count == 1 else f"{where}, sphere {n + 1}"


def _first_outlines(
    pictures: LightPictures, looking: Looking, where: str, room: NDArray[np.float32] | None
) -> tuple[list[Outline], list[str]]:
    """Return the outlines from left to right, and what the pictures say against each that was marked by hand."""
    view = looking.view(width_px=pictures.width_px, height_px=pictures.height_px)
    shown = pictures.grey.max(axis=0)
    bright = room.mean(axis=2, dtype=np.float32) if room is not None and room.ndim == 3 else room
    fits = bright is not None and bright.shape == shown.shape
    if looking.circles:
        outlines = [given_outline(view, circle) for circle in looking.circles]
    else:
        if bright is not None and not fits:
            raise UsageError(
                f"{where}: the picture for the outline is {bright.shape[1]} x {bright.shape[0]} pixels, and those of "
                f"the lights are {shown.shape[1]} x {shown.shape[0]}. Take both with the same camera and mode."
            )
        outlines = find_outlines(pictures, view, count=looking.spheres, room=bright)
    if len(outlines) < max(looking.spheres, 1) and not looking.circles:
        raise SphereNotFoundError(_not_found(where, len(outlines), looking.spheres), shown)
    for outline in outlines:
        _refuse_cut(outline, where, shown)
    outlines.sort(key=lambda outline: float(outline.place[0]))
    if not looking.circles:
        return outlines, ["" for _ in outlines]
    held = [held_against_picture(pictures, one, room=bright if fits else None, others=outlines) for one in outlines]
    return [outline for outline, _ in held], [doubt for _, doubt in held]


def _not_found(where: str, found: int, wanted: int) -> str:
    what = "no sphere" if not found else f"{found} of {wanted} spheres"
    return (
        f"{where}: {what} found: no round outline stands out from its background on a third of its length. Put "
        "something lighter or darker behind the sphere, keep all of it in the picture, add a picture with the room "
        "light on (named room, or `outline_picture`), or mark the outline by hand with `circle` x,y,radius."
    )


def _refuse_cut(outline: Outline, where: str, shown: Floats) -> None:
    rows, cols = shown.shape
    x, y, radius = outline.place[:3]
    if radius < LEAST_RADIUS_PX:
        raise SphereNotFoundError(
            f"{where}: the sphere at {x:.0f},{y:.0f} has a radius of {radius:.1f} pixels, on which a highlight's place "
            f"says nothing; expected {LEAST_RADIUS_PX:.0f} at least, better 100. Go nearer, or use a larger sphere.",
            shown,
        )
    rim = outline.view.curve(outline.place)
    outside = 1.0 - float(((rim >= -0.5) & (rim <= (cols - 0.5, rows - 0.5))).all(axis=1).mean())
    if outside > MOST_CUT:
        raise SphereNotFoundError(
            f"{where}: the sphere (centre {x:.0f},{y:.0f}, radius {radius:.0f} pixels) is cut by the frame of {cols} x "
            f"{rows} pixels: {outside:.0%} of its outline lies outside. Frame the whole sphere with some room around "
            "it; or, if that is not the sphere, mark it with `circle` x,y,radius.",
            shown,
        )


def _sighting(
    where: str, outline: Outline, places: Doubles, seen: Sequence[Sequence[FoundHighlight]], picture: Floats
) -> Sighting:
    moved = float(np.sqrt(places[:, :2].var(axis=0).sum())) if len(places) > 2 else 0.0
    if len(places) > 1 and not outline.given:
        outline = replace(outline, place=np.median(places, axis=0))
    lights = tuple(_over_sets([one[n] for one in seen]) for n in range(len(seen[0])))
    return Sighting(where=where, outline=outline, highlights=lights, picture=picture, sets=len(places), moved_px=moved)


def _over_sets(founds: Sequence[FoundHighlight]) -> Highlight:
    """Return the mean place of one light's highlight over sets; frames in which it is elsewhere are left out."""
    last, alike = founds[-1], _alike_in_most(founds)
    spots = [found.highlight for found in founds if found.highlight is not None]
    rejected = tuple(spot for spot in last.others if spot not in alike)
    if len(spots) * 2 <= len(founds):
        fault = next((found.fault for found in founds if found.fault), "no highlight in most of the frames")
        return Highlight(light=last.light, place=None, sets=len(spots), fault=fault, rejected=last.others)
    places = np.array([spot.place for spot in spots])
    away = np.linalg.norm(places - np.median(places, axis=0), axis=1)
    near = away <= max(5 * float(np.median(away)), 2.0)
    kept = [spot for spot, is_near in zip(spots, near, strict=True) if is_near]
    scatter = places[near].var(axis=0, ddof=1).sum() / 2 / len(kept) if len(kept) > 1 else 0.0
    shape = float(np.mean([spot.error_px for spot in kept]))
    return Highlight(
        light=last.light,
        place=places[near].mean(axis=0),
        error_px=float(np.sqrt(shape**2 + scatter)),
        radius_px=float(np.mean([spot.radius_px for spot in kept])),
        clipped=any(spot.clipped for spot in kept),
        sets=len(kept),
        alike=alike,
        rejected=rejected,
    )


def _alike_in_most(founds: Sequence[FoundHighlight]) -> tuple[Spot, ...]:
    """Return other spots that could be the highlight, of the last set that shows some, where at least half of the sets
    in which it was found do; a reflection that is there in one alone is passed over."""
    doubtful = [found.alike for found in founds if found.alike]
    found = sum(one.highlight is not None for one in founds)
    return doubtful[-1] if doubtful and 2 * len(doubtful) >= found else ()
