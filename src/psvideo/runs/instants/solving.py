"""Solves the instants of a run, or of a piece of it, and writes each at once; returns what the report needs of them."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import MOST_WAITING, writing
from psvideo.export.sequences.result_files import is_written
from psvideo.model.arrays import Pixels
from psvideo.plates.ambient.ambient_shown import has_one_dark_slot
from psvideo.plates.flash_plates import first_ambient
from psvideo.plates.gather import gather
from psvideo.plates.part import Part
from psvideo.plates.spread import rounds_spread
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.watched_motion import WatchedMotion
from psvideo.runs.delivery.delivering import surface_job, write_plates, write_specular
from psvideo.runs.delivery.look import SAMPLE_ROUND, instant_sheet
from psvideo.runs.delivery.relit import blur_of
from psvideo.runs.instants.depths import shape_of
from psvideo.runs.instants.job import Beginning, Found, Job, Piece
from psvideo.runs.instants.reporting import observing
from psvideo.solve.denoised import denoised
from psvideo.solve.depth import kept_beside, reservations, scale_note
from psvideo.solve.instants import Instant, subject_of, surfaces

SPECULAR_OF_LIGHTS = "specular_of_lights"
"""The folder of what exceeds the diffuse model under each light, sequences as those of the plates."""


def write_instants(
    job: Job,
    folder: Path,
    *,
    piece: Piece | None = None,
    resume: bool = False,
    watch: Watch = unwatched,
    picture_of: Callable[[Instant], Pixels] | None = None,
    beside: Callable[[Path, Instant], None] | None = None,
) -> Found:
    """Write the files of every instant of a run, or of a piece of it, into a folder; return what was found.

    ``resume`` leaves out files that are there. ``picture_of`` makes the picture of one round; left out, it shows plates
    and surface. ``beside`` writes more of every instant.
    """
    beginning = None if piece is None else piece.beginning
    observed = observing(job.take, job.lighting.rig, job.lighting.masks)
    if piece is not None:
        observed.only = piece.numbers
    if beginning is not None:
        observed.first = beginning.number
        observed.motion = WatchedMotion(watched=beginning.watched, white=beginning.white)
    shaping = kept_beside(job.shaping if beginning is None else beginning.shaping, folder)
    found = Found(observed=observed)
    ambient = first_ambient(job.take, job.timing) if job.mixes_ambient else None
    with writing(most_waiting=_most_waiting(job)) as write:
        part = None if piece is None else piece.part
        for instant in instants_of(job, observed, part=part, spare=folder, watch=watch):
            ambient = (instant.round.ambient or ambient) if job.mixes_ambient else None
            number = instant.round.number
            if piece is not None and number >= piece.numbers.stop:
                break
            if piece is None or number in piece.numbers:
                shaping, shaped = shape_of(shaping, job.lighting, instant)
                _write_light_by_light(job, folder, instant, write, resume=resume)
                if not (resume and is_written(folder, job.take.clip.name, number, job.delivery)):
                    # the surface only: plates are many times larger, and must not wait for the files
                    clip, out, tags, blur = job.take.clip, job.delivery, job.tags, _blur_of(job, instant)
                    write(surface_job(folder, clip, instant, out, tags, depth=shaped, ambient=ambient, blur=blur))
                del shaped  # it holds the surface too
                if beside is not None:
                    beside(folder, instant)
            observed.add(instant.round, instant.surface)
            if observed.first is not None and number - observed.first in (0, SAMPLE_ROUND - 1) and observed.facts:
                found.picture = (picture_of or instant_sheet)(instant)
            del instant  # its plates would be held while the next round gathers
    if shaping is not None:
        found.reserved, found.scale = reservations(shaping), scale_note(shaping)
    return found


def _most_waiting(job: Job) -> int:
    """Return how many files may wait to be written. Instants of which depth is found wait for each other, and where
    nothing else is written each that waits would only hold its surface."""
    return 1 if job.shaping is not None and not job.delivery.plates else MOST_WAITING


def _blur_of(job: Job, instant: Instant) -> NDArray[np.float32] | None:
    """Return what an open shutter adds to the relit movie's picture, where one is made."""
    if "relit" not in job.delivery.previews:
        return None
    return blur_of(instant.round, job.take.plan, job.lighting.rig, job.tags.fps)


def _write_light_by_light(
    job: Job, folder: Path, instant: Instant, write: Callable[[Callable[[], None]], None], *, resume: bool
) -> None:
    """Hand an instant's plates, and what exceeds the diffuse model in them, to the writing threads, if asked for."""
    if not job.delivery.plates:
        return
    name, compression = job.take.clip.name, job.delivery.compression
    write_plates(folder / "plates", name, instant.round, job.tags, compression=compression, resume=resume, write=write)
    write_specular(folder / SPECULAR_OF_LIGHTS, name, instant, job.tags, compression=compression, write=write)


def instants_of(
    job: Job, observed: Observed, *, part: Part | None = None, spare: Path | None = None, watch: Watch = unwatched
) -> Iterator[Instant]:
    """Give a job's instants one after the other, or those of a part of the frames; plates are shown to ``observed``.

    ``spare`` is a folder for what memory need not hold.
    """
    rounds = gather(
        job.take,
        job.timing,
        aligning=job.aligning,
        with_ambient=job.mixes_ambient or job.delivery.plates or has_one_dark_slot(job.take, job.timing),
        start_number=job.start_number,
        part=part,
        watch=watch,
        each_plate=observed.look,
        each_window=observed.look_at_window,
    )
    found = surfaces(
        rounds,
        job.take.plan,
        job.lighting.rig,
        masks=job.lighting.masks,
        solving=replace(job.solving, spare=spare),
        near=job.lighting.near,
        falloff=job.lighting.falloff,
        asked=job.asked,
        one_by_one=job.over_time.aligning.align == "none",
    )
    return found if job.over_time.denoise < 2 else denoised(found, job.over_time.denoise)


def knowing_subject(job: Job, *, spare: Path | None = None, watch: Watch = unwatched) -> Job:
    """Return the job with what its rounds share of their subject, unless that is known or nothing would use it: found
    from a few rounds that are spread over the take, whichever part of it is solved. Decodes their frames."""
    take, aligning = job.take, job.aligning
    if job.subject is not None or not job.solving.looks_at_subject(len(take.plan.lights)):
        return job
    rounds = rounds_spread(take, job.timing, aligning=aligning, start_number=job.start_number, watch=watch)
    subject = subject_of(
        rounds,
        take.plan,
        job.lighting.rig,
        masks=job.lighting.masks,
        solving=replace(job.solving, spare=spare),
        near=job.lighting.near,
        falloff=job.lighting.falloff,
    )
    return replace(job, subject=subject)


def beginning_of(job: Job) -> Beginning | None:
    """Return what a clip's first instant leaves to the others, None where there is no instant; decodes its frames."""
    take = replace(job.take, kept=None)
    part = Part(numbers=take.numbers)
    observed = observing(take, job.lighting.rig, job.lighting.masks)
    for instant in instants_of(replace(job, take=take), observed, part=part):
        shaping, _ = shape_of(job.shaping, job.lighting, instant)
        observed.motion.watch_brightest(observed.lights)
        return Beginning(
            number=instant.round.number,
            whites=dict(part.whites),
            watched=observed.motion.watched,
            white=observed.motion.white,
            shaping=shaping,
        )
    return None
