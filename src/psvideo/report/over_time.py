"""The report's charts over time: what is valid and saturated, each light's level, and what changes at rest."""

import html
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.pictures.charts import Axes, ChartLine, line_chart
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.run_report import steadiness_of

LEAST_SPAN, LEAST_CHANGE, LEAST_TURN = 5.0, 0.5, 0.1
"""Per cent, per cent and degrees that an axis spans at least, so that what is steady looks steady."""
Chart = tuple[Axes, Sequence[ChartLine]]


def over_time(facts: Sequence[InstantFacts], names: Sequence[str]) -> str:
    """Return charts of a run's instants as HTML, and a sentence on how steady they are; ``names`` are the lights'."""
    if not facts:
        return "<p>No result.</p>"
    x = np.array([one.time_s for one in facts])
    charts = [_shares(facts, x), _levels(facts, names, x), *_changes(facts, x)]
    drawn = "".join(
        f"<figure>{line_chart(axes, lines)}<figcaption>{html.escape(axes.label)}</figcaption></figure>"
        for axes, lines in charts
    )
    return f'<div class="grid2">{drawn}</div>{_steadiness(facts)}'


def _shares(facts: Sequence[InstantFacts], x: NDArray[np.float64]) -> Chart:
    lines = [
        ChartLine(name="saturated", y=np.array([100 * one.clipped_share for one in facts])),
        ChartLine(name="rows unseen", y=np.array([100 * one.unseen_share for one in facts])),
    ]
    valid = np.array([np.nan if one.valid_share is None else 100 * one.valid_share for one in facts])
    if np.isfinite(valid).any():
        lines.insert(0, ChartLine(name="valid", y=valid))
    return Axes(x=x, unit=" %", low=0, high=100, label="Valid and saturated shares of the subject, unseen rows"), lines


def _levels(facts: Sequence[InstantFacts], names: Sequence[str], x: NDArray[np.float64]) -> Chart:
    """Return each light's level in per cent of its own median; a gap where not every light was seen."""
    whole = [one.levels if len(one.levels) == len(names) else (np.nan,) * len(names) for one in facts]
    levels = np.array(whole, np.float64)
    usual, span = np.ones(len(names)), LEAST_SPAN
    if np.isfinite(levels).any():
        usual = np.maximum(np.nanmedian(levels, axis=0), 1e-11)
        span = float(np.clip(np.nanmax(np.abs(100 * levels / usual - 100)), LEAST_SPAN, 100))
    lines = [ChartLine(name=name, y=100 * levels[:, n] / usual[n]) for n, name in enumerate(names)]
    return Axes(
        x=x, unit=" %", low=100 - span, high=100 + span, label="Each light's level, against its own median"
    ), lines


def _changes(facts: Sequence[InstantFacts], x: NDArray[np.float64]) -> Iterator[Chart]:
    """Yield what changes from result to result where nothing moves; nothing where everything does."""
    change = np.array([np.nan if one.change is None else one.change.level_percent for one in facts])
    turn = np.array([np.nan if one.change is None else one.change.normals_deg for one in facts])
    if not np.isfinite(turn).any():
        return
    most = max(float(np.nanmax(np.abs(change))), LEAST_CHANGE)
    label = "Flicker: change of light at rest, result to result"
    yield Axes(x=x, unit=" %", low=-most, high=most, label=label), [ChartLine(name="light", y=change)]
    high = max(float(np.nanmax(turn)), LEAST_TURN)
    label = "Noise: change of normals at rest, result to result"
    yield Axes(x=x, unit="°", low=0, high=high, label=label), [ChartLine(name="normals", y=turn)]


def _steadiness(facts: Sequence[InstantFacts]) -> str:
    steady = steadiness_of(facts)
    if steady is None:
        return ""
    return (
        f"<p>At rest, in the median from result to result: normals {steady.normals_deg:.2f} degrees, albedo "
        f"{steady.albedo_percent:.2f} %, its level {steady.level_percent:.2f} % (worst: "
        f"{', '.join(map(str, steady.worst))}).</p>"
    )
