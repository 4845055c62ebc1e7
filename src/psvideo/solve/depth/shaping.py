"""Depth over a clip: one view, plane and scale for all instants, so that each can be integrated by itself."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.model.rig import Rig, check_rig
from psvideo.model.surface import Surface, check_surface
from psvideo.solve.depth.anchors import Plane
from psvideo.solve.depth.cao2022 import BILATERAL, Before, Height, Integration, integrate
from psvideo.solve.depth.scale import Depth, depth_of_height
from psvideo.solve.depth.view import View, view_of


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


def depth_of(shaping: Shaping, surface: Surface) -> Depth:
    """Return the depth of one instant; safe to call from several threads."""
    how, before, spare = shaping.how, shaping.before, shaping.spare
    return _scaled(
        shaping, integrate(surface.normals, surface.shown, shaping.view, how=how, before=before, spare=spare)
    )


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


def _scaled(shaping: Shaping, height: Height) -> Depth:
    return depth_of_height(height, shaping.view, plane=shaping.plane, reference=shaping.first, known_m=shaping.known_m)


def begun(shaping: Shaping, surface: Surface) -> Shaping:
    """Return the shaping with the first instant's depth, which fixes the scale; raises PsvideoError as ``scaled``.

    All later instants begin from the first one, and never from each other: each can be done by itself.
    """
    height = integrate(surface.normals, surface.shown, shaping.view, how=shaping.how, spare=shaping.spare)
    first = _scaled(replace(shaping, first=None), height)
    before = Before(height=height, normals=surface.normals)
    return replace(shaping, first=first.kept_in(shaping.spare), before=before.kept_in(shaping.spare))


def kept_beside(shaping: Shaping | None, spare: Path) -> Shaping | None:
    """Return a clip's shaping, of which large pictures lie in a folder's files from now on; None stays None."""
    if shaping is None:
        return None
    first = None if shaping.first is None else shaping.first.kept_in(spare)
    before = None if shaping.before is None else shaping.before.kept_in(spare)
    return replace(shaping, first=first, before=before, spare=spare)


def scale_note(shaping: Shaping) -> str:
    """Return in a sentence what a clip's depth is measured in: from normals alone nothing knows its scale."""
    if shaping.metric:
        return "Depth is in metres: its scale is the rig's [surface] plane's, or that of the depth given."
    if shaping.view.perspective:
        return (
            "Depth is relative, its median 1, because the rig has no [surface] plane: give one (in metres) for scale."
        )
    return (
        "Depth is relative, in widths of the picture about a median of 1: metres need focal_px in the rig's [camera] "
        "and a [surface] plane."
    )


def reservations(shaping: Shaping) -> tuple[str, ...]:
    """Return in whole sentences what is not known of a clip's depth."""
    said = []
    if not shaping.view.perspective:
        said.append(
            "Depth was integrated for an orthographic view, because the rig has no [camera] focal_px: a subject near "
            "the camera is bent. Give the focal length."
        )
    if shaping.first is not None and shaping.first.parts > 1:
        said.append(
            f"What is valid falls into {shaping.first.parts} parts, and how they lie to each other normals cannot "
            "say: each was given its depth by itself."
        )
    return tuple(said)
