"""What a run found and what to distrust: report.json for machines, report.html (``report_page``) for people.

The first sentence says whether the take is usable, and if not, what to change on set.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from psvideo.model.timing import Timing
from psvideo.report.judge.of_steadiness import by_level, change_of
from psvideo.report.judgement import Judgement, gravest_first, usable, verdict_of
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.levels import STOPS, TARGET_QUANTILE, Levels
from psvideo.report.observe.worst import Thumbnail

SCHEMA = "psvideo-report/1"
Facts = Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class LightFacts:
    """One light of the take: how its plates are exposed, and what the rig knows of it (``where`` in words)."""

    name: str
    levels: Levels
    where: str = ""
    error_deg: float | None = None


@dataclass(frozen=True, kw_only=True)
class RunReport:
    """One run over one clip. ``kind`` is ``normals`` or ``split``; ``trust`` says what a valid normal can be relied on
    for; ``warnings`` are whole sentences, the gravest first, beside the ``judgements``. ``shot`` is what was filmed
    and ``settings`` what the run was made with, as names and values for people; ``condition`` is the rig's."""

    clip: str
    version: str
    timing: Timing
    lights: tuple[LightFacts, ...]
    instants: tuple[InstantFacts, ...]
    judgements: tuple[Judgement, ...]
    kind: str = "normals"
    condition: float | None = None
    solver: str = ""
    trust: str = ""
    warnings: tuple[str, ...] = ()
    shot: Facts
    settings: Facts
    thumbnails: tuple[Thumbnail, ...] = ()

    @property
    def verdict(self) -> str:
        """The sentence that the report begins with."""
        return verdict_of(self.judgements, warned=bool(self.warnings))

    @property
    def findings(self) -> tuple[str, ...]:
        """What to distrust and what to change on set, the gravest first; empty where nothing is wrong."""
        return (*(one.sentence for one in gravest_first(self.judgements)), *self.warnings)


def report_record(report: RunReport) -> dict[str, object]:
    """Return the report as what report.json holds."""
    timing = report.timing
    return {
        "schema": SCHEMA,
        "kind": report.kind,
        "clip": report.clip,
        "version": report.version,
        "verdict": report.verdict,
        "usable": usable(report.judgements),
        "findings": list(report.findings),
        "judgements": [asdict(one) for one in report.judgements],
        "shot": dict(report.shot),
        "settings": dict(report.settings),
        "flashes": len(timing.flashes),
        "complete_flashes": sum(flash.complete for flash in timing.flashes),
        "clock_offset_ppm": timing.clock_offset_ppm,
        "phase_error_rows": timing.phase_error_rows,
        "order": timing.order,
        "order_note": timing.order_note,
        "timing_notes": list(timing.notes),
        "dropped_frames": [asdict(hole) for hole in timing.dropped_frames],
        "repeated_frames": list(timing.repeated_frames),
        "lights": [light.name for light in report.lights],
        "exposure": [_exposure_row(light) for light in report.lights],
        "condition": report.condition,
        "solver": report.solver,
        "trust": report.trust,
        "flicker": None if (steady := steadiness_of(report.instants)) is None else asdict(steady),
        "worst": [{"number": one.number, "why": one.why} for one in report.thumbnails],
        "instants": [asdict(facts) for facts in report.instants],
    }


def _exposure_row(light: LightFacts) -> dict[str, object]:
    levels = light.levels
    stops = {name: round(levels.stops(share), 2) for name, share in QUANTILES.items()}
    return {
        "light": light.name,
        "error_deg": light.error_deg,
        "clipped_share": levels.clipped_share,
        "stops_below_saturation": stops,
        "shares_by_quarter_stop": [round(float(share), 5) for share in levels.by_stop()],
        "stops": STOPS,
    }


QUANTILES = {"p5": 0.05, "p50": 0.5, "p95": 0.95, "p99_5": TARGET_QUANTILE}


@dataclass(frozen=True, kw_only=True)
class Steadiness:
    """How much results in turn differ at rest: medians over the clip, and the numbers of the worst instants."""

    normals_deg: float
    albedo_percent: float
    level_percent: float
    worst: tuple[int, ...]


def steadiness_of(instants: Sequence[InstantFacts]) -> Steadiness | None:
    """Return how steady a clip's results are; None where there are no two results in turn with anything at rest."""
    known = by_level(instants)
    if not known:
        return None
    changes = [change_of(facts) for facts in known]
    return Steadiness(
        normals_deg=float(np.median([one.normals_deg for one in changes])),
        albedo_percent=float(np.median([one.albedo_percent for one in changes])),
        level_percent=float(np.median([abs(one.level_percent) for one in changes])),
        worst=tuple(facts.number for facts in known[:3]),
    )
