"""A clip's own frames on the page, and before and after: plates by Algorithm 1 beside plates by the rows' weights."""

from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

from psvideo.clip import Clip, demosaic, open_clip, read_frames
from psvideo.model.choices import SplitMethod
from psvideo.page.picture import Look, PagePicture, shown
from psvideo.page.show import Show, ShownSequence
from psvideo.page.split_comparison import ComparedPlates

METHODS: tuple[tuple[SplitMethod, str], ...] = (
    ("weights", "Plates by the rows' weights"),
    ("hudon2015", "Plates by Algorithm 1"),
)
FAMILY = "camera"


def show_of_clip(path: Path, *, plan: Path | None = None) -> Show:
    """Return what a clip has to show: its frames, and the plates of the round that is nearest to each."""
    clip = open_clip(path, plan=plan)
    camera = clip.plan.camera
    frames = _frames(clip)
    plates = ComparedPlates(path, plan=plan)
    return Show(
        name=clip.name,
        kind="clip",
        fps=float(camera.fps),
        width_px=clip.width_px,
        height_px=clip.height_px,
        sequences=(frames, *_compared(clip, plates, frames)),
        notes=clip.warnings,
        facts={"Lights": ", ".join(clip.plan.lights), "Frames": str(len(clip.numbers))},
        timing=plates.record,
    )


def with_clip(show: Show, path: Path, *, timing: Path, plan: Path | None = None) -> Show:
    """Return a show of results or plates with the frames of their clip, and before and after of every round."""
    clip = open_clip(path, plan=plan)
    plates = ComparedPlates(path, plan=plan, timing=timing if timing.is_file() else None)
    beside = (_frames(clip), *_compared(clip, plates, show.sequences[0]))
    notes = (*show.notes, f"Frames are those of {path.name}{'/' if path.is_dir() else ''}.")
    return replace(show, sequences=(*show.sequences, *beside), notes=notes, timing=plates.record)


def _frames(clip: Clip) -> ShownSequence:
    """Return the frames of a clip, each at the time of the middle of its exposures."""
    camera = clip.plan.camera
    return ShownSequence(
        id="frames",
        label="Frames",
        kind="light",
        group="Clip",
        timeline="frames",
        numbers=clip.numbers,
        times_s=tuple(clip.index_of(number) * camera.frame_period_s + camera.middle_s for number in clip.numbers),
        read=partial(_frame, clip),
        family=FAMILY,
    )


def _frame(clip: Clip, number: int, look: Look) -> PagePicture:
    image = next(iter(read_frames(clip, [number], ahead=1, threads=1))).image
    if clip.cfa is not None:
        image = demosaic(image, clip.cfa)
    return page_picture(image, look)


def page_picture(image: np.ndarray, look: Look, **facts: object) -> PagePicture:
    """Return linear light (row, col[, channel]) as the page shows it."""
    planes = [image] if image.ndim == 2 else [image[..., channel] for channel in range(image.shape[2])]
    return PagePicture(pixels=shown(planes, look), facts=facts)


def _compared(clip: Clip, plates: ComparedPlates, beside: ShownSequence) -> chain[ShownSequence]:
    """Return one sequence per method and light, on the timeline of another sequence."""
    times_s = dict(zip(beside.numbers, beside.times_s, strict=True))
    return chain.from_iterable(
        [
            replace(
                beside,
                id=f"{method}-{place}",
                label=f"{light}, Algorithm 1" if method == "hudon2015" else f"{light}, weights",
                kind="light",
                group=group,
                read=partial(_plate, plates, method, light, _flash_of(beside, light), times_s),
                slow=True,
                family=FAMILY,
            )
            for place, light in enumerate(clip.plan.lights)
        ]
        for method, group in METHODS
    )


def _flash_of(beside: ShownSequence, light: str) -> str | None:
    """Return the light at whose flashes the pictures of a sequence are; None: in the middle of rounds, as results are.

    Beside a frame stands of every light the plate that is nearest to it; beside a plate, what is of the same round.
    """
    if beside.timeline == "frames":
        return light
    return beside.label if beside.group == "Plates" else None


def _plate(
    plates: ComparedPlates,
    method: SplitMethod,
    light: str,
    of: str | None,
    times_s: dict[int, float],
    number: int,
    look: Look,
) -> PagePicture:
    found = plates.plate(method, light, times_s[number], of=of)
    return page_picture(found.image, look, time_s=found.time_s, round=found.number)
