"""What a run found and what to distrust: report.json for machines, report.html for people.

The first sentence says whether the take is usable, and if not, what to change on set.
"""

import base64
import functools
import html
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.sequence import Round
from psvideo.surface import Surface
from psvideo.timing import Timing
from psvideo.view.steadiness import Change

SURE_ENOUGH_ROWS = 0.3
MOST_CLIPPED = 0.02
LEAST_VALID = 0.3
MOST_UNSEEN = 0.02
HARDLY_VALID = 0.05
MOST_FLICKER_PERCENT = 1.0
LIT = 0.01
"""A pixel brighter than this share of saturation under any light is part of the scene."""


@dataclass(frozen=True, kw_only=True)
class InstantFacts:
    """What one round gave: which shares of what is lit (or masked) are valid or saturated, and which share of rows no
    frame saw. A void background counts as neither. ``change`` is what differs from the result before, at rest."""

    number: int
    time_s: float
    valid_share: float
    clipped_share: float
    unseen_share: float
    change: Change | None = None


@dataclass(frozen=True, kw_only=True)
class RunReport:
    """One run over one clip. ``trust`` says what a valid normal can be relied on for; ``warnings`` are whole sentences,
    the gravest first."""

    clip: str
    version: str
    timing: Timing
    lights: tuple[str, ...]
    condition: float
    instants: tuple[InstantFacts, ...]
    solver: str
    trust: str
    warnings: tuple[str, ...] = ()


STRIDE = 4
"""Shares are counted over every fourth row and column, which is plenty and costs a sixteenth."""


def instant_facts(
    one: Round, surface: Surface, mask: NDArray[np.bool_] | None, change: Change | None = None
) -> InstantFacts:
    """Return what to remember of one solved round; ``change`` is how it differs from the one before."""
    bright = [_brightest(plate.image[::STRIDE, ::STRIDE]) for plate in one.plates]
    solved = np.any([picture > LIT for picture in bright], axis=0) if mask is None else mask[::STRIDE, ::STRIDE]
    clipped = np.mean(
        [_share(picture >= plate.saturation, solved) for picture, plate in zip(bright, one.plates, strict=True)]
    )
    return InstantFacts(
        number=one.number,
        time_s=one.time_s,
        valid_share=_share(surface.valid[::STRIDE, ::STRIDE], solved),
        clipped_share=float(clipped),
        unseen_share=float(np.mean([1 - plate.rows_seen.mean() for plate in one.plates])),
        change=change,
    )


def _brightest(image: NDArray[np.float32]) -> NDArray[np.float32]:
    # channel by channel: numpy is slow along a short last axis
    return image if image.ndim == 2 else functools.reduce(np.maximum, np.moveaxis(image, -1, 0))


def _share(flags: NDArray[np.bool_], within: NDArray[np.bool_]) -> float:
    return float((flags & within).sum() / max(int(within.sum()), 1))


def findings(report: RunReport) -> tuple[str, ...]:
    """Return what to distrust and what to change on set, the gravest first; empty where nothing is wrong."""
    found = []
    timing, instants = report.timing, report.instants
    if timing.order == "guess":
        found.append(
            "Which light is which is a guess, so normals may be wrong everywhere: shoot with a dark slot as marker, or "
            "name the first light with --first-light." + (f" {timing.order_note}" if timing.order_note else "")
        )
    if timing.phase_error_rows > SURE_ENOUGH_ROWS:
        found.append(
            f"Flash times are sure to {timing.phase_error_rows:.2f} row only: plates may be torn near the dark row. "
            "Fix the exposure, switch stabilisation off, and check that plan.toml is what the strobe played."
        )
    clipped = max((facts.clipped_share for facts in instants), default=0.0)
    if clipped > MOST_CLIPPED:
        found.append(f"{100 * clipped:.1f} % of a plate is saturated: lower power, flash duration, gain or aperture.")
    unseen = max((facts.unseen_share for facts in instants), default=0.0)
    if unseen > MOST_UNSEEN:
        found.append(
            f"Up to {100 * unseen:.0f} % of a round's rows were seen by no frame: frames are missing, or the shutter "
            "is open for less than the frame. Use all frames (no steps in --frames), and shoot at 360 degrees."
        )
    valid = min((facts.valid_share for facts in instants), default=0.0)
    if instants and valid < LEAST_VALID and unseen <= MOST_UNSEEN:
        found.append(
            f"Only {100 * valid:.0f} % of what is lit has a normal to be trusted: give the subject more light, place "
            "the lights nearer to the camera's axis, or use more of them, so that three reach every part."
        )
    worst = _by_level(instants)
    if worst and abs(_change(worst[0]).level_percent) > MOST_FLICKER_PERCENT:
        found.append(
            "The scene flickers: from one result to the next, albedo at rest changes by up to "
            f"{abs(_change(worst[0]).level_percent):.1f} % as a whole (number {worst[0].number}). Check the LEDs' "
            "supply and the camera's automatics."
        )
    found += [
        f"{hole.count} frame(s) are missing after number {hole.after}; rows that they held are not valid."
        for hole in timing.dropped_frames
    ]
    return (*found, *report.warnings)


@dataclass(frozen=True, kw_only=True)
class Flicker:
    """How much results in turn differ at rest: medians over the clip, and the numbers of the worst instants."""

    normals_deg: float
    albedo_percent: float
    level_percent: float
    worst: tuple[int, ...]


def flicker(instants: Sequence[InstantFacts]) -> Flicker | None:
    """Return the flicker of a clip; None where there are no two results in turn with anything at rest."""
    known = _by_level(instants)
    if not known:
        return None
    changes = [_change(facts) for facts in known]
    return Flicker(
        normals_deg=float(np.median([one.normals_deg for one in changes])),
        albedo_percent=float(np.median([one.albedo_percent for one in changes])),
        level_percent=float(np.median([abs(one.level_percent) for one in changes])),
        worst=tuple(facts.number for facts in known[:3]),
    )


def _by_level(instants: Sequence[InstantFacts]) -> list[InstantFacts]:
    """Return the instants of which a change is known, the largest change of level first."""
    known = [facts for facts in instants if facts.change is not None]
    return sorted(known, key=lambda facts: -abs(_change(facts).level_percent))


def _change(facts: InstantFacts) -> Change:
    if facts.change is None:
        raise ValueError(f"the change to instant {facts.number} is not known")
    return facts.change


def verdict(report: RunReport) -> str:
    """Return in one sentence whether the take is usable."""
    if not report.instants:
        return "This take gave no normals: it holds no round in which every light is complete."
    if max(facts.valid_share for facts in report.instants) < HARDLY_VALID:
        return "This take is not usable: hardly a pixel has a normal to be trusted."
    if report.timing.order == "guess" or report.timing.phase_error_rows > SURE_ENOUGH_ROWS:
        return "This take is doubtful: see below before using it."
    return "This take is usable." if not findings(report) else "This take is usable, with reservations."


def report_record(report: RunReport) -> dict[str, object]:
    """Return the report as what report.json holds."""
    timing = report.timing
    return {
        "schema": "psvideo-report/1",
        "clip": report.clip,
        "version": report.version,
        "verdict": verdict(report),
        "findings": list(findings(report)),
        "flashes": len(timing.flashes),
        "complete_flashes": sum(flash.complete for flash in timing.flashes),
        "clock_offset_ppm": timing.clock_offset_ppm,
        "phase_error_rows": timing.phase_error_rows,
        "order": timing.order,
        "order_note": timing.order_note,
        "lights": list(report.lights),
        "condition": report.condition,
        "solver": report.solver,
        "trust": report.trust,
        "flicker": None if (steady := flicker(report.instants)) is None else asdict(steady),
        "instants": [asdict(facts) for facts in report.instants],
    }


def report_page(report: RunReport, pictures: Sequence[tuple[str, NDArray[np.uint8]]]) -> str:
    """Return the report as one self-contained HTML page; ``pictures`` are (caption, 8-bit sRGB pixels)."""
    found = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in findings(report)) or "<li>Nothing.</li>"
    facts = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in _facts(report)
    )
    rounds = "".join(
        f"<tr><td>{one.number}</td><td>{one.time_s:.4f}</td><td>{100 * one.valid_share:.1f} %</td>"
        f"<td>{100 * one.clipped_share:.2f} %</td><td>{100 * one.unseen_share:.2f} %</td></tr>"
        for one in report.instants
    )
    figures = "".join(_figure(caption, picture) for caption, picture in pictures)
    return PAGE.format(
        title=html.escape(report.clip),
        verdict=html.escape(verdict(report)),
        found=found,
        facts=facts,
        rounds=rounds,
        figures=figures,
    )


def _facts(report: RunReport) -> list[tuple[str, str]]:
    timing = report.timing
    complete = sum(flash.complete for flash in timing.flashes)
    return [
        ("Flashes", f"{len(timing.flashes)}, of which {complete} complete"),
        ("Rounds solved", str(len(report.instants))),
        ("Strobe's clock", f"{timing.clock_offset_ppm:+.1f} ppm"),
        ("Flash times sure to", f"{timing.phase_error_rows:.3f} row"),
        ("Order of the lights", f"{timing.order}. {timing.order_note}" if timing.order_note else timing.order),
        ("Lights", ", ".join(report.lights)),
        ("Condition of the lights", f"{report.condition:.2f}"),
        ("Solver", report.solver),
        ("What valid means", report.trust),
        ("Flicker at rest, from result to result", _flicker_words(report.instants)),
        ("Made with", f"psvideo {report.version}"),
    ]


def _flicker_words(instants: Sequence[InstantFacts]) -> str:
    found = flicker(instants)
    if found is None:
        return "not known: no two results in turn, or nothing at rest"
    return (
        f"normals {found.normals_deg:.2f} degrees, albedo {found.albedo_percent:.2f} %, its level "
        f"{found.level_percent:.2f} % (medians; worst: {', '.join(map(str, found.worst))})"
    )


def _figure(caption: str, picture: NDArray[np.uint8]) -> str:
    done, data = cv2.imencode(".png", picture[..., ::-1])
    if not done:
        raise ValueError(f"a picture of shape {picture.shape} cannot be encoded")
    text = base64.b64encode(data.tobytes()).decode("ascii")
    escaped = html.escape(caption)
    return (
        f'<figure><img alt="{escaped}" src="data:image/png;base64,{text}"><figcaption>{escaped}</figcaption></figure>'
    )


PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{title}: psvideo report</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1rem; color: #222 }}
h1 {{ font-size: 1.5rem }} table {{ border-collapse: collapse }} th {{ text-align: left }}
th, td {{ padding: .2rem .8rem .2rem 0; border-bottom: 1px solid #ddd }}
img {{ max-width: 100% }} figure {{ margin: 1rem 0 }} figcaption {{ color: #666 }}
</style></head><body>
<h1>{title}</h1>
<p><strong>{verdict}</strong></p>
<h2>What to distrust</h2><ul>{found}</ul>
{figures}
<h2>What was found</h2><table>{facts}</table>
<h2>Rounds</h2>
<table><tr><th>number</th><th>time, s</th><th>valid</th><th>saturated</th><th>rows unseen</th></tr>{rounds}</table>
</body></html>
"""
