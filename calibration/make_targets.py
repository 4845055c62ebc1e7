"""Draw the calibration pages for A4 and Letter paper: seats for a sphere, crosses, a scale bar and grey patches.

Run it in this folder's parent: ``python calibration/make_targets.py`` writes ``calibration/targets/*.svg``. Both pages
carry the same marks at the same distances in millimetres, so that it does not matter which of them was printed.
"""

import math
from collections.abc import Iterator
from pathlib import Path

from psvideo.capture.drawing.draw_svg import svg
from psvideo.capture.drawing.shapes import Drawing, Label, Polygon

PAPERS_MM = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
CROSS_DISTANCES_MM = (160.0, 220.0)
CROSS_ARM_MM = 6.0
SPHERE_DIAMETERS_MM = (25, 40, 50, 60, 80)
REFLECTANCES = (0.05, 0.10, 0.20, 0.40, 0.60, 0.80)
PATCH_MM = 20.0
BAR_MM = 100
INK, SOFT = "#000000", "#888888"


def page(width_mm: float, height_mm: float) -> Drawing:
    """Return one page; a unit of the picture is a millimetre."""
    middle = (width_mm / 2, height_mm / 2)
    shapes = [*_crosses(middle), *_seats(middle), *_patches(middle), *_bar(middle), *_words(middle)]
    paper = Polygon(points=((0, 0), (width_mm, 0), (width_mm, height_mm), (0, height_mm)), fill="#ffffff")
    return Drawing(width=width_mm, height=height_mm, shapes=(paper, *shapes))


def _line(x0: float, y0: float, x1: float, y1: float, *, width: float = 0.25, colour: str = INK) -> Polygon:
    return Polygon(points=((x0, y0), (x1, y1)), stroke=colour, width=width, closed=False)


def _box(
    left: float, top: float, width: float, height: float, *, fill: str | None = None, stroke: str | None = None
) -> Polygon:
    right, bottom = left + width, top + height
    corners = ((left, top), (right, top), (right, bottom), (left, bottom))
    return Polygon(points=corners, width=0.2, fill=fill, stroke=stroke)


def _crosses(middle: tuple[float, float]) -> Iterator[Polygon]:
    for across in (-1, 1):
        for down in (-1, 1):
            x = middle[0] + across * CROSS_DISTANCES_MM[0] / 2
            y = middle[1] + down * CROSS_DISTANCES_MM[1] / 2
            yield _line(x - CROSS_ARM_MM, y, x + CROSS_ARM_MM, y)
            yield _line(x, y - CROSS_ARM_MM, x, y + CROSS_ARM_MM)


def _seats(middle: tuple[float, float]) -> Iterator[Polygon | Label]:
    x, y = middle
    for diameter in SPHERE_DIAMETERS_MM:
        turns = [2 * math.pi * step / 120 for step in range(120)]
        ring = tuple((x + diameter / 2 * math.cos(turn), y + diameter / 2 * math.sin(turn)) for turn in turns)
        yield Polygon(points=ring, stroke=SOFT, width=0.2)
        yield Label(at=(x + 1, y + diameter / 2 - 1), text=f"{diameter}", size=2.4, anchor="start", colour=SOFT)
    yield _line(x - 43, y, x + 43, y, width=0.15, colour=SOFT)
    yield _line(x, y - 43, x, y + 43, width=0.15, colour=SOFT)


def _patches(middle: tuple[float, float]) -> Iterator[Polygon | Label]:
    """Two rows of greys in opposite order: what the same grey reads above and below shows how the light falls off."""
    left = middle[0] - len(REFLECTANCES) * PATCH_MM / 2
    for top, order in ((middle[1] - 88, REFLECTANCES), (middle[1] + 68, REFLECTANCES[::-1])):
        for place, reflectance in enumerate(order):
            code = round(255 * _srgb(reflectance))
            yield _box(left + place * PATCH_MM, top, PATCH_MM, PATCH_MM, fill=f"#{code:02x}{code:02x}{code:02x}")
            at = (left + (place + 0.5) * PATCH_MM, top + PATCH_MM + 3.6)
            yield Label(at=at, text=f"{reflectance:.0%} nominal", size=2.4)


def _srgb(linear: float) -> float:
    """Return the sRGB code of a reflectance above 0.0031 (IEC 61966-2-1)."""
    return 1.055 * float(linear ** (1 / 2.4)) - 0.055


def _bar(middle: tuple[float, float]) -> Iterator[Polygon | Label]:
    left, y = middle[0] - BAR_MM / 2, middle[1] + 105
    for step in range(0, BAR_MM, 10):
        yield _box(left + step, y, 10, 3, fill=INK if step % 20 == 0 else "#ffffff", stroke=INK)
    yield Label(at=(middle[0], y + 7), text="this bar measures 100 mm on paper that was printed at 100 %", size=3)


def _words(middle: tuple[float, float]) -> Iterator[Polygon | Label]:
    x, y = middle
    yield Label(at=(x, y - 104), text="psvideo calibration page", size=5)
    yield Label(at=(x, y - 98), text="crosses: 160 x 220 mm apart, centre to centre", size=3)
    yield Label(
        at=(x, y - 93),
        text="print at 100 %, without scaling, on matte paper; centre the sphere on its ring (mm)",
        size=3,
    )
    yield _box(x - 78, y - 9, 18, 18, stroke=INK)
    yield Label(at=(x - 69, y - 11), text="cut out,", size=2.4)
    yield Label(at=(x - 69, y + 12.5), text="black cloth behind", size=2.4)
    for line, field in enumerate(("date", "camera", "lens", "sphere mm")):
        top = y - 8 + 7 * line
        yield Label(at=(x + 47, top), text=field, size=2.6, anchor="start")
        yield _line(x + 62, top + 0.6, x + 80, top + 0.6)


def main() -> None:
    """Write both pages."""
    folder = Path(__file__).resolve().parent / "targets"
    folder.mkdir(exist_ok=True)
    for name, (width_mm, height_mm) in PAPERS_MM.items():
        text = svg(page(width_mm, height_mm), unit="mm")
        (folder / f"sphere_and_chart_{name}.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
