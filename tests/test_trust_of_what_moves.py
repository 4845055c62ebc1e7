"""What plates show without alignment is trusted with it as well, where that is right: nothing is lost to caution."""

import numpy as np
import pytest
from bench.accuracy_measure import angles_deg
from bench.accuracy_motion import ASLANT, BOX, UNALIGNED, Filmed, filmed, turn

from psvideo.model.surface import Surface
from psvideo.plates.align.rounds import Aligning
from psvideo.solve.normals.solving import Solving

BARE_BALL = {"mesh": "sphere", "height_m": 0.4, "albedo": 0.6}
RIGHT_DEG, FAR_OFF_DEG = 5.0, 10.0
NOISE = 0.002


def judged(clip: Filmed, how: Aligning) -> tuple[Surface, np.ndarray]:
    """Return the surface of the second round, and by how much its normals are off."""
    one = clip.shown(how)[1]
    seen = np.stack([plate.pixels_seen for plate in one.plates])
    moves = None if one.motion is None else one.motion.moves
    images = [plate.image for plate in one.plates]
    surface = Solving(error=True).solve(images, clip.lit, seen=seen, unsure=one.unsure, moves=moves)
    return surface, angles_deg(surface.normals, clip.truth(one.time_s)[0])


@pytest.mark.parametrize(
    ("subject", "px", "most_lost"),
    [
        pytest.param(BARE_BALL, 4, 0.01, id="a bare ball that spins in its place"),
        pytest.param(BOX, 4, 0.06, id="a bare box that tumbles by 4 px", marks=pytest.mark.campaign),
        pytest.param(BOX | {"albedo": 0.3}, 2, 0.07, id="a dark box that tumbles by 2 px", marks=pytest.mark.campaign),
    ],
)
def test_five_lights_whose_plates_one_normal_explains_are_trusted(
    subject: dict[str, object], px: float, most_lost: float
) -> None:
    clip = filmed(5, turn(px, ASLANT), noise=NOISE, subject=subject)
    (plain, plain_deg), (aligned, off_deg) = judged(clip, UNALIGNED), judged(clip, Aligning())
    subject_seen = clip.truth(clip.shown(UNALIGNED)[1].time_s)[1]
    lost = subject_seen & plain.valid & (plain_deg < RIGHT_DEG) & ~aligned.valid
    assert lost.sum() < most_lost * subject_seen.sum()
    trusted = subject_seen & aligned.valid
    assert aligned.error_deg is not None
    assert (trusted & (off_deg > FAR_OFF_DEG)).sum() < 0.03 * trusted.sum()
    assert (off_deg[trusted] <= 2 * np.maximum(aligned.error_deg[trusted].astype(np.float32), 1e-3)).mean() > 0.9
