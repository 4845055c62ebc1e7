"""Make docs/pictures/whole_bust.png: ``python -m bench.whole_pictures``.

The demo's bust under three lights: what they measure alone, and the whole of it, with how every pixel got its normal
and how far off that is. Errors run from 0 (dark) to 30 degrees (yellow); grey is measured, or not the subject.
"""

import cv2
import numpy as np

from bench.accuracy_measure import ROOT, angles_deg
from bench.accuracy_whole import bust
from psvideo.model.surface import MEASURED, NO_LIGHT, ONE_LIGHT, TWO_LIGHTS, Surface
from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.on_screen import normal_colours, srgb
from psvideo.pictures.relighting import relight
from psvideo.solve.normals.solving import Solving

LIGHTS = (0, 1, 2)
FULL_DEG = 30.0
GREY = 110
SHOWN = slice(120, 520)
"""The columns around the bust."""
LEFT, RIGHT = (-0.75, 0.3, 0.6), (0.75, 0.3, 0.6)
SEEN_AS = (
    (MEASURED, (150, 150, 150)),
    (TWO_LIGHTS, (70, 130, 220)),
    (ONE_LIGHT, (240, 150, 40)),
    (NO_LIGHT, (200, 60, 160)),
)


def main() -> None:
    """Write the picture."""
    case, _ = bust(LIGHTS)
    whole = Solving(error=True).solve(case.plates, case.lit)
    alone = Solving(fill=False).solve(case.plates, case.lit)
    assert whole.source is not None
    assert whole.error_deg is not None
    filled = case.mask & (whole.source > MEASURED)
    off = np.zeros(case.mask.shape)
    off[filled] = angles_deg(whole.normals[filled], case.truth[filled])
    classes = np.zeros((*case.mask.shape, 3), np.uint8)
    for source, colour in SEEN_AS:
        classes[whole.source == source] = colour
    strips = [
        Strip("Three lights: what they measure, and nothing else", _views(alone)),
        Strip("The same with a best estimate where fewer than three of them reach", _views(whole)),
        Strip(
            "Where it is from, and how far it is off: 0 to 30 degrees",
            [
                Tile("measured; two lights: blue; one: orange", classes[:, SHOWN]),
                Tile("estimates: true error", _heat(off, filled)[:, SHOWN]),
                Tile("estimates: predicted error", _heat(whole.error_deg.astype(np.float64), filled)[:, SHOWN]),
            ],
        ),
    ]
    picture = sheet(strips, width_px=960)
    path = ROOT / "docs" / "pictures" / "whole_bust.png"
    cv2.imwrite(str(path), picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


def _views(surface: Surface) -> list[Tile]:
    sides = (("lit from the left", LEFT), ("from the right", RIGHT))
    lit = [Tile(name, srgb(relight(surface, way), exposure=1.3)[:, SHOWN]) for name, way in sides]
    return [Tile("normals", normal_colours(surface.normals)[:, SHOWN]), *lit]


def _heat(errors: np.ndarray, shown: np.ndarray) -> np.ndarray:
    codes = (np.clip(errors / FULL_DEG, 0, 1) * 255).astype(np.uint8)
    coloured = cv2.applyColorMap(codes, cv2.COLORMAP_INFERNO)[..., ::-1]
    return np.where(shown[..., None], coloured, np.uint8(GREY)).astype(np.uint8)


if __name__ == "__main__":
    main()
