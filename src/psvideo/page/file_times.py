"""When the pictures of a sequence were taken: what each of its files says of itself.

Rounds are not of one length where only some of them have dark slots, nor is a strobe's clock the camera's: a number
times a rate is off by milliseconds within a second, and by more than a round within minutes.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from psvideo.clip.decode.exr_chunks import number_in_header

TIME = "psvideo:time_s"


def file_times_s(files: Mapping[int, Path], rate: float) -> tuple[float, ...]:
    """Return the times of files by number, in the numbers' order, from their headers.

    A file that does not say its own (one that is damaged, or was written by another program) stands in ``rate``'s
    distance from the nearest that does; the first one at 0 where none does. A second stands for a rate of 0, which
    keeps pictures of no rate in order; the page shows no times of these.
    """
    numbers = sorted(files)
    known = {number: at_s for number in numbers if (at_s := number_in_header(files[number], TIME)) is not None}
    if len(known) == len(numbers):
        return tuple(known.values())
    known = known or {numbers[0]: 0.0}
    sure = np.array(list(known))
    nearest = {number: int(sure[np.abs(sure - number).argmin()]) for number in numbers}
    return tuple(known[near] + (number - near) / (rate or 1.0) for number, near in nearest.items())
