"""A take in, the surface at one instant after the other out: decoding, plates, alignment and solving in one stream."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Masks, Take, check_take
from psvideo.compute.progress import Watch, unwatched
from psvideo.model.choices import NEAR_ITERATIONS, Align, Solver
from psvideo.model.irradiance.colours import unmixing_of
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.rig import Rig, check_rig
from psvideo.model.timing import Timing
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.gather import gather
from psvideo.plates.naming import named_by_rig
from psvideo.plates.spread import rounds_spread
from psvideo.solve.instants import Instant, subject_of, surfaces
from psvideo.solve.near_surface import near_surface_of
from psvideo.solve.normals.solving import Solving
from psvideo.sync.take_timing import find_timing


def solve(
    take: Take,
    rig: Rig,
    timing: Timing | None = None,
    *,
    mask: NDArray[np.bool_] | None = None,
    solver: Solver = "auto",
    fill: bool = True,
    align: Align = "auto",
    watch: Watch = unwatched,
) -> Iterator[Instant]:
    """Solve a take round by round, in constant memory: one surface for every round of flashes.

    Parameters
    ----------
    take
        What ``open_take`` gives.
    rig
        Where the lights are, by the names of the take's plan.
    timing
        When every flash fired; found from the picture where it is left out. Where the plan has no marker, the rig shows
        the order of the lights, as far as it can.
    mask
        Shape (row, col), bool: True where to solve; everywhere left out.
    solver
        "robust" weighs highlights and shadows down, "least-squares" takes the surface as matte, "auto" is robust from
        five lights on.
    fill
        Give what fewer than three lights reach a best estimate, which is not valid; else it is 0.
    align
        "auto" brings the plates of a round to one instant where something moves, "flow" looks for motion everywhere,
        "none" leaves them as they are.
    watch
        Is handed every long loop, to show progress.

    Yields
    ------
    Instant
        ``surface``, a Surface with ``residual``, ``error_deg`` and ``source``; and ``round``, the plates
        that it was solved from: ``round.number`` counts from 1001 as the files do, ``round.time_s`` is the instant on
        the camera's clock in seconds, ``round.plates`` hold ``light`` and ``image`` (row, col[, 3]).

    Raises
    ------
    PsvideoError
        Where no strobe is found, the rig lacks a light of the plan, or its lights give no normals.

    Examples
    --------
    >>> import psvideo as ps
    >>> take, rig = ps.open_take("take3/"), ps.read_rig("take3/rig.toml")
    >>> for instant in ps.solve(take, rig, ps.find_timing(take)):
    ...     print(instant.round.number, instant.surface.normals.shape, instant.surface.valid.any())
    1002 (120, 160, 3) True
    1003 (120, 160, 3) True
    """
    check_take(take)
    check_rig(rig)
    found = named_by_rig(take, timing or find_timing(take, watch=watch), rig)
    if (unmixing := unmixing_of(take.plan, rig, channels=take.clip.channels)) is not None:
        take, rig = take.unmixed(unmixing), unmixing.rig
    plan, clip = take.plan, take.clip
    lights = lights_as_planned(rig, plan)
    near = near_surface_of(rig, lights, height_px=clip.height_px, width_px=clip.width_px, iterations=NEAR_ITERATIONS)
    how = Aligning(align=align, lights=() if unmixing else lights, ground=None if near is None else near.ground)
    masks = None if mask is None else Masks(still=mask)
    solving = Solving(solver=solver, residual=True, error=True, fill=fill)
    if solving.looks_at_subject(len(lights)):
        few = rounds_spread(take, found, aligning=how, watch=watch)
        solving = replace(solving, subject=subject_of(few, plan, rig, masks=masks, solving=solving, near=near))
    rounds = gather(take, found, aligning=how, with_ambient=False, watch=watch)
    return surfaces(rounds, plan, rig, masks=masks, solving=solving, near=near)
