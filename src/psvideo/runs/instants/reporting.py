"""Writes the report of a run beside its results, from what was observed while it went on."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from psvideo import __version__
from psvideo.clip import Masks, Take
from psvideo.formats.whole_files import write_text
from psvideo.model.arrays import Pixels
from psvideo.model.rig import Rig
from psvideo.model.timing import Timing
from psvideo.plates.several_lights.unmixed import slot_names
from psvideo.report.html import report_page
from psvideo.report.judge.every_line import judgements
from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points
from psvideo.report.observe.rig_and_curve.yuille1997 import Lens
from psvideo.report.observe.watched_motion import WatchedMotion
from psvideo.report.run_report import LightFacts, RunReport, report_record
from psvideo.runs.instants.shot_and_settings import Solved, settings_words, shot_words, where_words
from psvideo.runs.steps.levels import levels_of
from psvideo.runs.steps.output import Output
from psvideo.runs.steps.saturation import saturation_of


def observing(take: Take, rig: Rig | None = None, masks: Masks | None = None) -> Observed:
    """Return what gathers the facts of a take's rounds; with a rig, it is compared with the plates.

    Near lights are so only on the rig's plane: where depth is known instead, there may be none.
    """
    clip = take.clip
    points = None
    near = rig is not None and any(light.position_m is not None for light in rig.lights)
    size = {"height_px": clip.height_px, "width_px": clip.width_px}
    if rig is not None and not (near and None in (rig.focal_px, rig.principal_px, rig.plane)):
        points = rig_points(clip.shown_plan, rig, channels=clip.channels, **size)
        if take.unmixing is not None:  # whose lamps are of strength 1 by themselves, whatever was measured
            points = replace(points, strengths_all_one=False)
    watched = "" if take.unmixing is None else slot_names(clip.plan)[0]
    return Observed(
        lights=clip.plan.lights,
        motion=WatchedMotion(watched=watched),
        masks=masks,
        points=points,
        lens=Lens.of(rig, **size),
        stills=clip.plan.mode == "synced",
        turn=clip.turn,
    )


def run_report(
    take: Take, timing: Timing, observed: Observed, output: Output, *, solved: Solved | None = None
) -> RunReport:
    """Return the report of a run over a take."""
    clip, spell = take.clip, output.caller.spell
    warned = (one for one in clip.warnings if one != clip.curve_doubt)  # which is judged
    warnings = (*warned, *(() if solved is None else solved.warnings))
    return RunReport(
        clip=clip.name,
        version=__version__,
        kind="split" if solved is None else "normals",
        timing=timing,
        lights=_lights(clip.plan.lights, observed, None if solved is None else solved.lighting.rig),
        instants=tuple(observed.facts),
        judgements=tuple(one.spelled(spell) for one in _judged(take, timing, observed, solved)),
        condition=None if solved is None else solved.lighting.condition,
        solver="" if solved is None else solved.solver,
        trust="" if solved is None else spell(solved.trust),
        warnings=tuple(map(spell, warnings)),
        shot={name: spell(words) for name, words in shot_words(clip, take.numbers).items()},
        settings=settings_words(take, output, solved),
        thumbnails=observed.thumbnails,
    )


def _lights(names: Sequence[str], observed: Observed, rig: Rig | None) -> tuple[LightFacts, ...]:
    """Return what is known of every light, from its plates and from the rig, where there is one."""
    by_name = {} if rig is None else {light.name: light for light in rig.lights}
    return tuple(
        LightFacts(
            name=name,
            levels=observed.levels(name),
            where=where_words(by_name.get(name)),
            error_deg=by_name[name].error_deg if name in by_name else None,
        )
        for name in names
    )


def _judged(take: Take, timing: Timing, observed: Observed, solved: Solved | None) -> Sequence[Judgement]:
    return judgements(
        take.clip.plan,
        timing,
        observed,
        curve_doubt=take.clip.curve_doubt,
        saturation=saturation_of(take),
        levels=levels_of(take),
        aligned=solved is not None and solved.aligned,
        opened=solved is not None and solved.opened,
    )


def write_report(folder: Path, report: RunReport, pictures: Sequence[tuple[str, Pixels]]) -> None:
    """Write report.json and report.html into a folder of results."""
    write_text(folder / "report.json", json.dumps(report_record(report), indent=1) + "\n")
    write_text(folder / "report.html", report_page(report, pictures))
