"""Make docs/pictures/robust_virtual.png and robust_ball.png: ``python -m bench.normals_pictures``.

Error maps run from 0 (dark) to 10 degrees (yellow), the same in all pictures; grey is not valid or not the subject. Of
the real ball only our own errors are shown, no picture.
"""

import cv2
import numpy as np

from bench.accuracy_measure import ROOT, SHARED_DATA, Case, angles_deg, diligent_ball, gloss, spread_subsets
from psvideo.model.surface import Surface
from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.on_screen import normal_colours, srgb
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust import huber1981

FULL_DEG = 10.0
GREY = 110


def main() -> None:
    """Write the pictures; the ball's only where the real captures are."""
    case = gloss(noise=0.002)
    given = LitPlates(case.plates, case.lit)
    plain, careful = woodham1980.solve(given), huber1981.solve(given)
    above = [
        Tile("one of eight plates", srgb(case.plates[4], exposure=1.5)),
        Tile("least squares", normal_colours(plain.normals)),
        Tile("robust", normal_colours(careful.normals)),
    ]
    strips = [Strip("Virtual scene gloss.toml", above), _errors(case, plain, careful)]
    _write("robust_virtual.png", sheet(strips, width_px=960))
    if SHARED_DATA.is_dir():
        ball = diligent_ball()
        few = ball.choose(spread_subsets(ball.lit.directions, 12, 1)[0])
        strips = [_ball(ball, "48 lights"), _ball(few, "12 lights")]
        _write("robust_ball.png", sheet(strips, width_px=720))


def _ball(case: Case, name: str) -> Strip:
    plain = woodham1980.solve(LitPlates(case.plates, case.lit), usable=woodham1980.EVERYTHING)
    return _errors(
        case,
        plain,
        huber1981.solve(LitPlates(case.plates, case.lit)),
        f"Ball of DiLiGenT, {name}: errors, 0 to 10 degrees",
    )


def _errors(
    case: Case, plain: Surface, careful: Surface, name: str = "Errors, 0 to 10 degrees; valid is white"
) -> Strip:
    assert careful.error_deg is not None
    valid = np.where(careful.valid & case.mask, np.uint8(255), np.where(case.mask, np.uint8(0), np.uint8(GREY)))
    return Strip(
        name,
        [
            Tile("least squares", _error_map(case, plain)),
            Tile("robust", _error_map(case, careful)),
            Tile("robust, predicted", _heat(careful.error_deg, careful.valid & case.mask)),
            Tile("robust, valid", np.repeat(valid[..., None], 3, axis=-1)),
        ],
    )


def _error_map(case: Case, surface: Surface) -> np.ndarray:
    both = surface.valid & case.mask
    errors = np.zeros(case.mask.shape)
    errors[both] = angles_deg(surface.normals[both], case.truth[both])
    return _heat(errors, both)


def _heat(errors: np.ndarray, shown: np.ndarray) -> np.ndarray:
    codes = (np.clip(errors / FULL_DEG, 0, 1) * 255).astype(np.uint8)
    coloured = cv2.applyColorMap(codes, cv2.COLORMAP_INFERNO)[..., ::-1]
    return np.where(shown[..., None], coloured, np.uint8(GREY)).astype(np.uint8)


def _write(name: str, picture: np.ndarray) -> None:
    cv2.imwrite(str(ROOT / "docs" / "pictures" / name), picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
