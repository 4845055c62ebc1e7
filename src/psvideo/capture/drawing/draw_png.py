"""A picture as PNG bytes, painted by OpenCV at three times the size and averaged down, so that edges are smooth."""

import cv2
import numpy as np

from psvideo.capture.drawing.shapes import Drawing, Label, Polygon
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Pixels

OVERSAMPLING = 3
SCALE = 2
"""Pixels of the PNG per unit of the picture, so that it stays sharp on dense screens."""

FONT = cv2.FONT_HERSHEY_SIMPLEX
FONT_HEIGHT_PX = 30.0
PLAIN = str.maketrans({"×": "x", "µ": "u", "°": " deg", "…": ".", "–": "-"})


def png(picture: Drawing) -> bytes:
    """Return the picture as a PNG file's bytes."""
    grow = SCALE * OVERSAMPLING
    canvas = np.full((round(picture.height * grow), round(picture.width * grow), 3), 255, np.uint8)
    for shape in picture.shapes:
        if isinstance(shape, Label):
            _write(canvas, shape, grow)
        else:
            _paint(canvas, shape, grow)
    size = (round(picture.width * SCALE), round(picture.height * SCALE))
    done, data = cv2.imencode(".png", cv2.resize(canvas, size, interpolation=cv2.INTER_AREA))
    if not done:
        raise PsvideoError("The timing diagram could not be encoded as PNG. Write it as SVG instead.")
    return data.tobytes()


def _paint(canvas: Pixels, shape: Polygon, grow: int) -> None:
    points = np.round(np.array(shape.points, np.float64).reshape(-1, 1, 2) * grow).astype(np.int32)
    if len(points) == 0:
        return
    if shape.fill:
        cv2.fillPoly(canvas, [points], _bgr(shape.fill))
    if shape.stroke:
        width = max(round(shape.width * grow), 1)
        cv2.polylines(canvas, [points], shape.closed, _bgr(shape.stroke), width, cv2.LINE_AA)


def _write(canvas: Pixels, label: Label, grow: int) -> None:
    text = label.text.translate(PLAIN)
    scale, weight = label.size * grow / FONT_HEIGHT_PX, max(round(label.size * grow / 13), 1)
    (width, height), _ = cv2.getTextSize(text, FONT, scale, weight)
    x, y = (round(value * grow) for value in label.at)
    shift = {"start": 0, "middle": width // 2, "end": width}[label.anchor]
    if not label.upright:
        cv2.putText(canvas, text, (x - shift, y), FONT, scale, _bgr(label.colour), weight, cv2.LINE_AA)
        return
    patch = np.full((2 * height, width + height, 3), 255, np.uint8)
    cv2.putText(patch, text, (height // 2, round(1.5 * height)), FONT, scale, _bgr(label.colour), weight, cv2.LINE_AA)
    turned = np.rot90(patch)
    top, left = y - turned.shape[0] // 2, x - turned.shape[1] // 2
    canvas[top : top + turned.shape[0], left : left + turned.shape[1]] = turned


def _bgr(colour: str) -> tuple[int, int, int]:
    return int(colour[5:7], 16), int(colour[3:5], 16), int(colour[1:3], 16)
