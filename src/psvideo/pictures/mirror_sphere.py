"""What was found on mirror spheres, as a picture: the outline, the highlights chosen and rejected, the directions."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.mirror.measured import MirrorCalibration
from psvideo.calibrate.mirror.sighting import Sighting
from psvideo.model.arrays import Doubles, Pixels
from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.on_screen import srgb

WIDTH_PX = 1200
TALLEST_PX = 1000
OUTLINE, EDGE, CHOSEN, REJECTED, DOUBTFUL = (
    (90, 230, 120),
    (255, 210, 90),
    (90, 220, 255),
    (255, 110, 90),
    (255, 170, 40),
)
MARGIN = 1.25
LABELS_PX = 340
"""Columns at the right that are left free for the lights' names and directions."""


def sphere_picture(found: MirrorCalibration) -> Pixels:
    """Return 8-bit pixels (row, col, 3): every sphere with its outline, highlights and directions, and the faults."""
    labels = {light.name: _direction(light.direction) for light in found.lights if not light.fault}
    strips = [Strip(_title(sighting), [Tile(_key(sighting), _drawn(sighting, labels))]) for sighting in found.sightings]
    return sheet(strips, width_px=WIDTH_PX)


def faulty_picture(picture: NDArray[np.float32]) -> Pixels:
    """Return the picture (row, col), linear, in which no sphere was found, brightened for eyes, as (row, col, 3)."""
    strip = Strip("No usable sphere was found in this picture (brightest of all lights)", [Tile("", _shown(picture))])
    return sheet([strip], width_px=WIDTH_PX)


def _title(sighting: Sighting) -> str:
    x, y, radius = sighting.outline.place[:3]
    made = "marked by hand" if sighting.outline.given else f"{sighting.outline.coverage:.0%} of the outline seen"
    name = Path(sighting.where).name
    error_px = sighting.outline.error_px
    return f"{name}: sphere at {x:.1f}, {y:.1f}, radius {radius:.1f} +- {error_px:.2f} px; {made}"


def _key(sighting: Sighting) -> str:
    return (
        f"green: outline; yellow: its edges; blue: highlights; orange: doubtful; red: rejected ({sighting.sets} frames)"
    )


def _direction(direction: Doubles | None) -> str:
    return "" if direction is None else "(" + ", ".join(f"{value:+.2f}" for value in direction) + ")"


def _shown(picture: NDArray[np.float32]) -> Pixels:
    """Return a picture as pixels, its dim parts lifted: an outline before black cloth must show."""
    level = max(float(np.percentile(picture, 90)), 1e-4)
    return srgb(np.asarray(np.sqrt(np.clip(picture / (4 * level), 0, 1)), np.float32))


def _drawn(sighting: Sighting, labels: dict[str, str]) -> Pixels:
    corner, canvas, scale = _cut_out(sighting)

    def at(point: Doubles) -> tuple[int, int]:
        x, y = (np.asarray(point) - corner + 0.5) * scale
        return round(float(x)), round(float(y))

    outline = sighting.outline
    rim = np.array([at(point) for point in outline.view.curve(outline.place, 720)], np.int32)
    for point in outline.points[:: max(len(outline.points) // 400, 1)]:
        cv2.circle(canvas, at(point), 1, EDGE, -1)
    cv2.polylines(canvas, [rim], True, OUTLINE, 1, cv2.LINE_AA)
    for one in sighting.highlights:
        for spot in one.rejected:
            cv2.circle(canvas, at(spot.place), max(round(spot.radius_px * scale), 4), REJECTED, 1, cv2.LINE_AA)
        for spot in one.alike:
            cv2.circle(canvas, at(spot.place), max(round(spot.radius_px * scale), 5), DOUBTFUL, 2, cv2.LINE_AA)
    for one in sighting.highlights:
        if one.place is not None:
            colour = DOUBTFUL if one.alike else CHOSEN
            cv2.drawMarker(canvas, at(one.place), colour, cv2.MARKER_CROSS, 16, 1, cv2.LINE_AA)
    _label(canvas, [(one.light, at(one.place)) for one in sighting.highlights if one.place is not None], labels)
    return canvas


def _cut_out(sighting: Sighting) -> tuple[Doubles, Pixels, float]:
    """Return the sphere cut out with a margin: its top left corner (x, y), the pixels, and how much they grew."""
    x, y, radius = sighting.outline.place[:3]
    rows, cols = sighting.picture.shape
    left, right = max(int(x - MARGIN * radius), 0), min(int(x + MARGIN * radius) + 1, cols)
    top, bottom = max(int(y - MARGIN * radius), 0), min(int(y + MARGIN * radius) + 1, rows)
    part = _shown(sighting.picture)[top:bottom, left:right]
    scale = min((WIDTH_PX - 24 - LABELS_PX) / part.shape[1], TALLEST_PX / part.shape[0])
    size = (round(part.shape[1] * scale), round(part.shape[0] * scale))
    grown = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC), np.uint8)
    canvas = np.zeros((size[1], WIDTH_PX - 24, 3), np.uint8)
    canvas[:, : size[0]] = grown
    return np.array([left, top], np.float64), canvas, scale


def _label(canvas: Pixels, places: list[tuple[str, tuple[int, int]]], labels: dict[str, str]) -> None:
    """Write the lights' names and directions in a column on the right, each tied to its highlight by a line."""
    places = sorted(places, key=lambda one: one[1][1])
    step = min(canvas.shape[0] / (len(places) + 1), 40.0)
    begin = max((canvas.shape[0] - step * len(places)) / 2, 10)
    for n, (name, (x, y)) in enumerate(places):
        spot = (canvas.shape[1] - LABELS_PX + 20, round(begin + step * (n + 0.5)))
        text = f"{name} {labels.get(name, 'left out')}"
        cv2.line(canvas, (x + 6, y), (spot[0] - 6, spot[1] - 4), CHOSEN, 1, cv2.LINE_AA)
        cv2.putText(canvas, text, spot, cv2.FONT_HERSHEY_SIMPLEX, 0.5, (235, 235, 235), 1, cv2.LINE_AA)
