"""Small charts as inline SVG: colours that colour-blind people can distinguish, dashes too; light and dark pages."""

import html
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles

WIDE, TALL = 560, 170
LEFT, RIGHT, TOP, BELOW = 46, 96, 10, 26
MOST_POINTS = 300
DASHES = ("", "6 3", "2 3", "9 3 2 3", "12 4", "4 2 1 2", "1 4", "14 3 4 3")
"""Series differ in these as well as in their colour class ``s0`` to ``s7``."""
STOP_WIDE, STOP_TALL = 300, 130
SHOWN_STOPS = 10
"""Darker light is drawn in the first bin."""


@dataclass(frozen=True, kw_only=True)
class ChartLine:
    """One series: ``y`` (point,), NaN where it is not known."""

    name: str
    y: Doubles


@dataclass(frozen=True, kw_only=True)
class Axes:
    """Where a chart's numbers lie, and what they are of."""

    x: Doubles
    unit: str
    low: float
    high: float
    label: str


def line_chart(axes: Axes, lines: Sequence[ChartLine]) -> str:
    """Return one chart over time. More points than a screen shows are drawn as their span, so no spike is lost."""
    right, bottom = WIDE - RIGHT, TALL - BELOW
    first, last = float(axes.x[0]), float(max(axes.x[-1], axes.x[0] + 1e-9))
    span = max(axes.high - axes.low, 1e-12)
    parts = [_grid(axes, right, bottom, first, last)]
    ends: list[tuple[float, int, str]] = []
    for n, line in enumerate(lines):
        x, low, high = _decimated(axes.x, line.y)
        across = LEFT + (x - first) / (last - first) * (right - LEFT)
        top, under = (
            bottom - (np.clip(y, axes.low, axes.high) - axes.low) / span * (bottom - TOP) for y in (high, low)
        )
        if not len(across):
            continue
        path = _path(across, 0.5 * (top + under))
        if np.any(under - top > 0.75):
            band = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, top, strict=True))
            back = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across[::-1], under[::-1], strict=True))
            parts.append(f'<polygon class="f{n % 8}" points="{band} {back}"/>')
        parts.append(f'<path class="s{n % 8}" stroke-dasharray="{DASHES[n % 8]}" d="{path}"/>')
        if len(across) == 1:
            parts.append(f'<circle class="p{n % 8}" cx="{across[0]:.1f}" cy="{top[0]:.1f}" r="3"/>')
        ends.append((float(0.5 * (top[-1] + under[-1])), n, line.name))
    parts += _names(ends, right)
    return _svg(WIDE, TALL, axes.label, "".join(parts))


def _decimated(x: Doubles, y: Doubles) -> tuple[Doubles, Doubles, Doubles]:
    """Return at most MOST_POINTS moments, and the least and greatest value at each; unknown values are left out."""
    known = np.isfinite(y)
    x, y = x[known], y[known]
    if len(x) <= MOST_POINTS:
        return x, y, y
    parts = np.array_split(np.arange(len(x)), MOST_POINTS)
    low, high = (np.array([pick(y[part]) for part in parts]) for pick in (np.min, np.max))
    return np.array([x[part].mean() for part in parts]), low, high


def _path(across: Doubles, down: Doubles) -> str:
    return "M" + " L".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, down, strict=True))


def _grid(axes: Axes, right: int, bottom: int, first: float, last: float) -> str:
    parts = []
    for share in (0.0, 0.5, 1.0):
        y = bottom - share * (bottom - TOP)
        value = axes.low + share * (axes.high - axes.low)
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{value:.3g}{axes.unit}</text>')
    for share in (0.0, 0.5, 1.0):
        x = LEFT + share * (right - LEFT)
        anchor = ("start", "middle", "end")[round(2 * share)]
        moment = first + share * (last - first)
        parts.append(f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="{anchor}">{moment:.3g} s</text>')
    return "".join(parts)


def _names(ends: list[tuple[float, int, str]], right: int) -> list[str]:
    """Write each series' name at its end, moved apart where they would meet."""
    parts, last = [], -np.inf
    for y, n, name in sorted(ends):
        last = max(y + 4, last + 15)
        shown = html.escape(name if len(name) <= 11 else name[:10] + "…")
        parts.append(
            f'<line class="s{n % 8}" stroke-dasharray="{DASHES[n % 8]}" x1="{right + 4}" x2="{right + 22}" '
            f'y1="{last - 4:.1f}" y2="{last - 4:.1f}"/><text x="{right + 26}" y="{last:.1f}">{shown}</text>'
        )
    return parts


def stops_chart(shares: Doubles, name: str, *, stops: int) -> str:
    """Return a histogram of light in stops below saturation; the last of ``shares`` (bin,) is what is clipped."""
    hidden = (stops - SHOWN_STOPS) * (len(shares) - 1) // stops
    inner, clipped, stops = shares[hidden:-1].copy(), float(shares[-1]), SHOWN_STOPS
    inner[0] += shares[:hidden].sum()
    left, right, bottom = 8, STOP_WIDE - 66, STOP_TALL - 22
    tallest = max(float(inner.max()), 1e-9)
    step = (right - left) / len(inner)
    heights = inner / tallest * (bottom - TOP)
    corners = "".join(
        f"L{left + n * step:.1f},{bottom - height:.1f} L{left + (n + 1) * step:.1f},{bottom - height:.1f} "
        for n, height in enumerate(heights)
    )
    ticks = "".join(
        f'<text x="{left + (stops - below) / stops * (right - left):.1f}" y="{bottom + 15}" '
        f'text-anchor="middle">{-below or 0}</text>'
        for below in range(0, stops - 1, 2)
    )
    percent = f"{100 * clipped:.1f} %"
    high = min(clipped / tallest, 1.0) * (bottom - TOP)
    return _svg(
        STOP_WIDE,
        STOP_TALL,
        f"Light of {name} in stops below saturation; {percent} clipped",
        f'<path class="area" d="M{left},{bottom} {corners}L{right},{bottom}Z"/>'
        f'<line class="grid" x1="{left}" x2="{STOP_WIDE - 8}" y1="{bottom}" y2="{bottom}"/>{ticks}'
        f'<rect class="clip" x="{right + 20}" y="{bottom - high:.1f}" width="30" height="{high:.1f}"/>'
        f'<text x="{right + 35}" y="{bottom + 15}" text-anchor="middle">clipped</text>'
        f'<text x="{right + 35}" y="{max(bottom - high - 4, 12):.1f}" text-anchor="middle">{percent}</text>',
    )


def _svg(wide: int, tall: int, label: str, inner: str) -> str:
    return (
        f'<svg viewBox="0 0 {wide} {tall}" role="img" aria-label="{html.escape(label)}">'
        f"<title>{html.escape(label)}</title>{inner}</svg>"
    )
