"""Depth over a clip: one view, plane and scale for all instants, so that each can be integrated by itself."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.model.rig import Rig, check_rig
from psvideo.model.surface import Distances, Surface, check_surface
from psvideo.solve.depth.anchors import Plane
from psvideo.solve.depth.cao2022 import BILATERAL, Before, Height, Integration, integrate, laid_together
from psvideo.solve.depth.placing import stays
from psvideo.solve.depth.scale import Depth, depth_of_height
from psvideo.solve.depth.torn_surfaces import layers_of
from psvideo.solve.depth.view import View, view_of

MOST_NAMED = 4
"""Of the surfaces that near lights' falloff put somewhere, the largest are named."""
DOUBTFUL = 0.1
"""Distances that may be off by more than this share are named in the report."""


@dataclass(frozen=True, kw_only=True)
class Shaping:
    """How a clip's surfaces become depth. ``first`` is the first instant's, whose scale the others keep, and
    ``before`` what its integration leaves to theirs.

    known_m: depth (row, col) in metres that is known from elsewhere, 0 where it is not; comes before plane and first.
    spare: a folder in whose files large pictures lie in part.
    """

    view: View
    plane: Plane | None = None
    how: Integration = BILATERAL
    first: Depth | None = None
    before: Before | None = None
    known_m: NDArray[np.float32] | None = None
    spare: Path | None = None

    @property
    def metric(self) -> bool:
        """Whether depth is in metres: a perspective view, and a plane or depth that says how far away things are."""
        return self.view.perspective and (self.plane is not None or self.known_m is not None)

    def distances_of(self, surface: Surface) -> Distances | None:
        """Return how far away near lights' falloff puts a surface, None where depth that was given comes before."""
        return surface.distances if self.view.perspective and self.known_m is None else None


def depth_of(shaping: Shaping, surface: Surface) -> Depth:
    """Return the depth of one instant; safe to call from several threads."""
    return _scaled(shaping, _height_of(shaping, surface), surface)


def find_depth(surface: Surface, rig: Rig | None = None) -> Depth:
    """Return the depth of one surface by integrating its normals.

    Parameters
    ----------
    surface
        What was solved; depth is found wherever there is a normal, measured or not.
    rig
        Gives the lens (``focal_px``) and the plane on which the subject lies. Without a lens the view is orthographic.

    Returns
    -------
    Depth
        ``depth`` (row, col), float32, along the camera's axis, 0 where there is none. In metres where ``metric`` is
        True: the rig has lens and plane. Else relative: its median is 1, and without a lens the unit is the width of
        the picture. ``view.points(depth)`` gives the points (row, col, 3) in the camera's frame, and ``cut_east`` and
        ``cut_south`` say where the surface jumps. Each of its ``parts`` pieces has a distance of its own.

    Raises
    ------
    PsvideoError
        Where ``surface`` is no Surface or ``rig`` no Rig, or the rig's plane lies nowhere before the camera.

    Examples
    --------
    A plane that is tilted by 45 degrees comes nearer by one pixel a row, in widths of the picture of 32 pixels:

    >>> import numpy as np
    >>> import psvideo as ps
    >>> normals = np.zeros((32, 32, 3), np.float32)
    >>> normals[...] = np.sqrt(0.5) * np.array([0, 1, 1])
    >>> surface = ps.Surface(normals=normals, albedo=np.ones((32, 32)), valid=np.ones((32, 32), bool))
    >>> depth = ps.find_depth(surface).depth
    >>> round(float(depth[0, 16] - depth[31, 16]) * 32, 2)
    31.0
    """
    check_surface(surface)
    if rig is not None:
        check_rig(rig)
    return depth_of(
        Shaping(view=View() if rig is None else view_of(rig), plane=None if rig is None else rig.plane), surface
    )


def _height_of(shaping: Shaping, surface: Surface) -> Height:
    """Return the height of a surface; what near lights' falloff puts apart is integrated apart."""
    how, view, before, spare = shaping.how, shaping.view, shaping.before, shaping.spare
    distances = shaping.distances_of(surface)
    if distances is None:
        return integrate(surface.normals, surface.shown, view, how=how, before=before, spare=spare)
    if before is not None and shaping.first is not None:
        before = before.where(stays(distances, shaping.first.depth))
    layers = layers_of(distances, surface.normals, surface.shown, view, how)
    return laid_together(
        [integrate(surface.normals, layer, view, how=how, before=before, spare=spare) for layer in layers]
    )


def _scaled(shaping: Shaping, height: Height, surface: Surface) -> Depth:
    return depth_of_height(
        height,
        shaping.view,
        plane=shaping.plane,
        reference=shaping.first,
        known_m=shaping.known_m,
        distances=shaping.distances_of(surface),
    )


def begun(shaping: Shaping, surface: Surface) -> Shaping:
    """Return the shaping with the first instant's depth, which fixes the scale; raises PsvideoError as ``scaled``.

    All later instants begin from the first one, and never from each other: each can be done by itself.
    """
    shaping = replace(shaping, first=None, before=None)
    height = _height_of(shaping, surface)
    first = _scaled(shaping, height, surface)
    before = Before(height=replace(height, layers=()), normals=surface.normals)
    return replace(shaping, first=first.kept_in(shaping.spare), before=before.kept_in(shaping.spare))


def kept_beside(shaping: Shaping | None, spare: Path) -> Shaping | None:
    """Return a clip's shaping, of which large pictures lie in a folder's files from now on; None stays None."""
    if shaping is None:
        return None
    first = None if shaping.first is None else shaping.first.kept_in(spare)
    before = None if shaping.before is None else shaping.before.kept_in(spare)
    return replace(shaping, first=first, before=before, spare=spare)


def scale_note(shaping: Shaping) -> str:
    """Return in a sentence or two what a clip's depth is measured in: from normals alone nothing knows its scale."""
    placed = () if shaping.first is None else shaping.first.placed
    if shaping.metric and placed:
        parts = sorted(placed, key=lambda part: -part.share)[:MOST_NAMED]
        named = "; ".join(f"{part.words}, {_percent(part.share)} of the picture" for part in parts)
        return (
            "Depth is in metres. How far away each surface is as a whole was found by how the near lights fall off "
            "over all of it, as well as these are known to the rig; single pixels may be farther off. In the first "
            f"result: {named}."
        )
    if shaping.metric and shaping.known_m is not None:
        return "Depth is in metres: its scale is that of the depth given."
    if shaping.metric:
        return (
            "Depth is in metres: its scale is the rig's [surface] plane's, on which the middle of each part is put. It "
            "is off by as much as the subject stands before or behind that plane."
        )
    if shaping.view.perspective:
        return (
            "Depth is relative, its median 1, because the rig has no [surface] plane: give one (in metres) for scale."
        )
    return (
        "Depth is relative, in widths of the picture about a median of 1: metres need focal_px in the rig's [camera] "
        "and a [surface] plane."
    )


def _percent(share: float) -> str:
    return "less than 1 %" if share < 0.01 else f"{100 * share:.0f} %"


def reservations(shaping: Shaping) -> tuple[str, ...]:
    """Return in whole sentences what is not known of a clip's depth."""
    said = []
    if not shaping.view.perspective:
        said.append(
            "Depth was integrated for an orthographic view, because the rig has no [camera] focal_px: a subject near "
            "the camera is bent. Give the focal length."
        )
    first = shaping.first
    if first is not None and first.placed:
        doubtful = sum(part.share for part in first.placed if part.unsure > DOUBTFUL)
        if doubtful >= 0.01:
            said.append(
                f"How far away the surfaces are that fill {_percent(doubtful)} of the picture, the falloff of the near "
                f"lights hardly tells: their depth may be off by more than {100 * DOUBTFUL:.0f} % as a whole. A known "
                "depth (`depth`), more lights or a rig that is measured better would say."
            )
    elif first is not None and first.parts > 1:
        said.append(
            f"What is valid falls into {first.parts} parts, and how they lie to each other normals cannot "
            "say: each was given its depth by itself."
        )
    return tuple(said)
