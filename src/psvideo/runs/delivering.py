"""What a delivery asks of a run before it begins: that the camera is known at every instant, and in which unit."""

from collections import defaultdict

import numpy as np

from psvideo.export.results import Delivery
from psvideo.export.space import Space
from psvideo.pipeline import Take
from psvideo.sequence import round_numbers
from psvideo.timing import Timing


def check_camera(space: Space, take: Take, timing: Timing, start_number: int) -> None:
    """Raise PsvideoError where a moving camera is not known at the clip's first or last round."""
    if space.moving is None:
        return
    times_s: dict[int, list[float]] = defaultdict(list)
    for flash, number in zip(timing.flashes, round_numbers(timing.flashes, start=start_number), strict=True):
        if flash.complete and any(flash.lights.values()):
            times_s[number].append(flash.start_s + flash.duration_s / 2)
    whole = [number for number, times in times_s.items() if len(times) == len(take.plan.lit_slots)]
    for number in (min(whole), max(whole)) if whole else ():
        space.at(float(np.mean(times_s[number])), number, take.plan.camera.fps)


def world_doubts(delivery: Delivery, *, metric: bool) -> tuple[str, ...]:
    """Return in whole sentences what is wrong with points in the world where depth has no scale."""
    moved = delivery.space.name == "world" and (delivery.space.moving is not None or delivery.space.origin is not None)
    if metric or not (moved and delivery.needs_depth):
        return ()
    return (
        "Positions and meshes in world space need depth in metres, and here it is relative: they do not lie where the "
        "scene is. Give the rig [camera] focal_px and a [surface] plane.",
    )
