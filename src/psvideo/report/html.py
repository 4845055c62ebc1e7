"""report.html: the report as one self-contained page, read from top to bottom, in light and dark."""

import base64
import html
from collections.abc import Sequence

import cv2
import numpy as np

from psvideo.model.arrays import Pixels
from psvideo.pictures.charts import stops_chart
from psvideo.pictures.on_screen import normal_colours
from psvideo.report.judgement import Judgement, gravest_first, usable
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.levels import STOPS, TARGET_QUANTILE
from psvideo.report.observe.worst import Thumbnail, badness
from psvideo.report.over_time import over_time
from psvideo.report.run_report import RunReport
from psvideo.report.style import STYLE

MOST_ROUNDS = 20
MARKS = {"good": "✓", "doubtful": "△", "bad": "✕", "unknown": "–"}
JPEG_QUALITY = 90


def report_page(report: RunReport, pictures: Sequence[tuple[str, Pixels]]) -> str:
    """Return the report as one self-contained HTML page; ``pictures`` are (caption, 8-bit sRGB pixels)."""
    sections = [
        _section("Line by line", judgement_lines(report.judgements)),
        "".join(_figure(caption, picture) for caption, picture in pictures),
        _section("What was shot", _table(report.shot)),
        _section("Timing", _timing(report)) if "Strobe" in report.shot else "",  # photographs have none
        _section("Lights and exposure", _lights(report)),
        _over_time(report),
        _section("Worst results", _worst(report)),
        _section("To make this again", _table(report.settings)),
    ]
    return PAGE.format(
        title=html.escape(report.clip), style=STYLE, head=_head(report), body="".join(sections), version=report.version
    )


def _over_time(report: RunReport) -> str:
    """Return the charts of more than one instant; of one there is nothing over time."""
    if len(report.instants) == 1:
        return ""
    return _section("Over time", over_time(report.instants, [light.name for light in report.lights]))


def _head(report: RunReport) -> str:
    words = report.verdict
    kind = "bad" if not usable(report.judgements) else "good" if words == "This take is usable." else "doubtful"
    found = gravest_first(report.judgements)
    items = "".join(
        f"<li><span>{html.escape(one.found)}</span> <strong>{html.escape(one.advice)}</strong></li>" for one in found
    )
    items += "".join(f"<li>{html.escape(sentence)}</li>" for sentence in report.warnings)
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in report.timing.notes)
    notes = f'<p class="soft">Also seen in the picture:</p><ul>{notes}</ul>' if notes else ""
    rest = f"<ol>{items}</ol>" if items else "<p>Nothing was found that speaks against it.</p>"
    return (
        f'<div class="verdict {kind}"><p class="word"><i>{MARKS[kind]}</i> {html.escape(words)}</p>{rest}{notes}</div>'
    )


def judgement_lines(judgements: Sequence[Judgement]) -> str:
    """Return a table with a line per judgement: mark and word, subject, sentence."""
    rows = "".join(
        f'<tr><td class="grade {one.grade}"><i>{MARKS[one.grade]}</i> {one.grade}</td>'
        f"<th>{html.escape(one.subject)}</th><td>{html.escape(one.sentence)}</td></tr>"
        for one in judgements
    )
    return f'<table class="lines">{rows}</table>'


def _timing(report: RunReport) -> str:
    timing = report.timing
    complete = sum(flash.complete for flash in timing.flashes)
    readout_s = abs(timing.row_time_s)
    facts = {
        "Flashes": f"{len(timing.flashes)}, of which {complete} complete",
        "Flash times known to": timing.known_to or "not fitted",
        "Strobe's clock": f"{timing.clock_offset_ppm:+.1f} ppm off the camera's",
        "Order of the lights": f"{timing.order}. {timing.order_note}".strip(" ."),
        "Exposure": f"{timing.exposure_s * 1e3:.4g} ms ({360 * timing.exposure_s / timing.frame_period_s:.0f} degrees)",
        "Row time": f"{readout_s * 1e6:.4g} µs" if readout_s else "all rows together",
        "Dropped frames": ", ".join(f"{hole.count} after {hole.after}" for hole in timing.dropped_frames) or "none",
        "Repeated frames": ", ".join(map(str, timing.repeated_frames[:20])) or "none",
    }
    if timing.row_time_error_s is not None:
        facts["Row time"] += f" ± {timing.row_time_error_s * 1e6:.2g} µs"
    return _table(facts)


def _lights(report: RunReport) -> str:
    rows = "".join(
        f"<tr><th>{html.escape(light.name)}</th><td>{html.escape(light.where)}</td>"
        f"<td>{'not known' if light.error_deg is None else f'{light.error_deg:.2g}°'}</td>"
        f"<td>{light.levels.stops(0.5):.1f}</td><td>{light.levels.stops(0.95):.1f}</td>"
        f"<td>{light.levels.stops(TARGET_QUANTILE):.1f}</td><td>{100 * light.levels.clipped_share:.2f} %</td></tr>"
        for light in report.lights
    )
    charts = "".join(
        f"<figure>{stops_chart(light.levels.by_stop(), light.name, stops=STOPS)}"
        f"<figcaption>{html.escape(light.name)}</figcaption></figure>"
        for light in report.lights
    )
    condition = ""
    if report.condition is not None:
        condition = (
            f"<p>Condition of the lights' directions: {report.condition:.2f} (1 is best; noise in the plates becomes "
            "about this many times larger in the normals).</p>"
        )
    return (
        '<div class="wide"><table class="figures"><tr><th>light</th><th>stands at</th><th>direction known to</th>'
        f"<th>half of the subject below</th><th>95 %</th><th>99.5 %</th><th>clipped</th></tr>{rows}</table></div>"
        f"{condition}<p>Light on the subject in stops below saturation (0 is saturation, -1 half of it):</p>"
        f'<div class="grid4">{charts}</div>'
    )


def _worst(report: RunReport) -> str:
    tiles = "".join(_thumbnail(one) for one in report.thumbnails)
    grid = f'<div class="grid4">{tiles}</div>' if tiles else "<p>No result stands out as bad.</p>"
    ordered = sorted(report.instants, key=lambda one: (-badness(one)[0], one.number))[:MOST_ROUNDS]
    rows = "".join(_round_row(one) for one in ordered)
    count, of_all = len(ordered), len(report.instants)
    several = f"All {count} results, the worst first" if count == of_all else f"The {count} worst of {of_all} results"
    shown = ("No results", "The only result")[count] if count < 2 else several
    head = (
        "<tr><th>number</th><th>time, s</th><th>valid</th><th>saturated</th><th>rows unseen</th><th>ambient</th></tr>"
    )
    table = f'<div class="wide"><table class="figures">{head}{rows}</table></div>'
    return f"{grid}<details><summary>{shown}</summary>{table}</details>"


def _round_row(one: InstantFacts) -> str:
    valid = "–" if one.valid_share is None else f"{100 * one.valid_share:.1f} %"
    ambient = "–" if one.ambient is None else f"{100 * one.ambient:.1f} %"
    return (
        f"<tr><td>{one.number}</td><td>{one.time_s:.4f}</td><td>{valid}</td><td>{100 * one.clipped_share:.2f} %</td>"
        f"<td>{100 * one.unseen_share:.2f} %</td><td>{ambient}</td></tr>"
    )


def _thumbnail(one: Thumbnail) -> str:
    colours = normal_colours(one.normals)
    flags = np.repeat(np.where(one.valid, 235, 20).astype(np.uint8)[..., None], 3, axis=2)
    beside = np.concatenate([colours, flags], axis=0 if colours.shape[1] > colours.shape[0] else 1)
    caption = f"{one.number}: {one.why}"
    return _figure(caption, beside, alt=f"{caption}; normals, and white where they are valid")


def _table(facts: object) -> str:
    rows = "".join(
        f"<tr><th>{html.escape(str(name))}</th><td>{html.escape(str(value))}</td></tr>"
        for name, value in dict(facts).items()  # type: ignore[call-overload]
    )
    return f'<table class="facts">{rows}</table>'


def _section(title: str, body: str) -> str:
    return f"<section><h2>{html.escape(title)}</h2>{body}</section>"


def _figure(caption: str, picture: Pixels, *, alt: str | None = None) -> str:
    done, data = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not done:
        raise ValueError(f"a picture of shape {picture.shape} cannot be encoded")
    text = base64.b64encode(data.tobytes()).decode("ascii")
    return (
        f'<figure><img alt="{html.escape(alt or caption)}" src="data:image/jpeg;base64,{text}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
    )


PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><link rel="icon" href="data:,">
<title>{title}: psvideo report</title><style>{style}</style></head><body><main>
<header><p class="made">psvideo {version}</p><h1>{title}</h1></header>
{head}{body}
</main></body></html>
"""
