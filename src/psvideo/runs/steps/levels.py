"""Some of a take's frames, looked at for how many levels of light their files hold."""

from psvideo.clip import Take, read_frames
from psvideo.report.judge.of_steps import coarse_steps
from psvideo.report.judgement import Judgement
from psvideo.report.observe.code_steps import code_step

LOOKED_AT, MOST_BITS = 3, 8


def levels_of(take: Take) -> Judgement | None:
    """Judge whether a take's files hold so few levels that normals suffer. None where they do not, where files have
    more than MOST_BITS, which are not decoded again for it, and of mosaics, whose colours are means of their
    neighbours' levels. Of a movie the first frames are looked at, which costs least.
    """
    bits = take.clip.header.bits
    if take.clip.cfa or bits is None or bits > MOST_BITS:
        return None
    each = 1 if take.clip.is_movie else max(len(take.numbers) // LOOKED_AT, 1)
    numbers = take.numbers[: each * LOOKED_AT : each]
    frames = read_frames(take.clip, numbers, kept=take.kept)
    return coarse_steps(code_step(frame.image for frame in frames))  # in light, one is held at a time
