"""Finding stripes in row profiles: which period, in which colour, and whether they are stripes at all.

Candidates are the spectrum's peaks and their subharmonics (short flashes have harmonics as strong as the fundamental).
Each is fitted. The shortest period that explains the profiles as well as any is taken; what could be meant in two ways,
or is no more regular than a scene, is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.calibrate.stripes.spectrum import detrended, find_peaks, without
from psvideo.calibrate.stripes.stripe_model import spline_basis
from psvideo.calibrate.stripes.waveform import StripeFit, fit_stripes
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles

FEWEST_PERIODS = 2.0
SHORTEST_PERIOD_ROWS = 2.5
MOST_SEARCHED_FRAMES = 4
SUBHARMONICS = (1, 2, 3)
HARMONICS = 16
"""Fewer would leave flashes of a few per cent to be mistaken for something else."""
SAME_CYCLES = 0.4
"""Frequencies that differ by less than this many periods over the picture are the same candidate."""
NEAR = 0.25
"""How far the period may be from what the user expects, as a share."""
CLEAR_GAIN = 0.15
FAINT_GAIN = 0.01
"""A longer period is a better reading where it takes this share off what the shorter one leaves over, and explains this
much more of the stripes altogether."""
THIN_ROWS = 8.0
MOST_TIMES = 3
HALF_EXPLAINED = 0.8
"""Where a shorter period explains this share of what the longer one does, only every second stripe differs a little."""
MOST_RIVAL = 0.75
"""Other stripes that explain more than this share of what the chosen ones do: a scene, or two lamps."""
WIDE_LEFT = 0.5
"""Stripes of too few periods are what is there where they leave less than this share of what any others do."""
LEAST_CHANGE = 1e-6
"""Change over the rows, as a share of the level, below which there is nothing to read."""
LEAST_EXPLAINED = 0.5
MANY_PERIODS = 5.0
LEAST_EXPLAINED_BY_FEW = 0.95
LEAST_IN_STEP = 0.9
FEWEST_BLOCKS = 4
MOST_ERROR = 0.005
"""Real stripes are regular; where the period is less certain than this share, it is a scene that repeats by chance."""


@dataclass(frozen=True, kw_only=True)
class FoundStripes:
    """Stripes of one frequency, in periods per row, in the channel where they are strongest.

    ``explained`` is their share of what is not smooth in the profiles, ``left`` what they leave over of all change.
    """

    frequency: float
    explained: float
    left: float
    channel: int


def find_stripes(profiles: Doubles, *, expected: float | None = None) -> FoundStripes:
    """Return the stripes in profiles of shape (frame, channel, block, row).

    ``expected`` is roughly their frequency, where the user knows it. Raises PsvideoError, without the footage's name,
    where there are none, too few periods, or two ways to read them.
    """
    whole = profiles[:MOST_SEARCHED_FRAMES].mean(axis=2)
    rows = whole.shape[2]
    if detrended(whole).std() <= LEAST_CHANGE * np.abs(whole).max():
        raise PsvideoError(NO_STRIPES)
    found = [_read(whole, frequency) for frequency in _candidates(whole, expected)]
    readings = [reading for reading in found if reading.frequency * rows >= FEWEST_PERIODS]
    _refuse_wide(found, readings, rows)
    readings = [reading for reading in readings if not _is_echo(reading, readings)]
    if expected is not None:
        readings = [reading for reading in readings if abs(reading.frequency / expected - 1) < NEAR]
    if not readings:
        raise PsvideoError(NO_STRIPES)
    chosen = _shortest(readings)
    if expected is None:
        _refuse_ambiguous(chosen, readings)
    return chosen


def check_stripes(fit: StripeFit, reading: FoundStripes, rows: int) -> None:
    """Raise PsvideoError where fitted stripes are no stripes: faint, out of step across the picture, or irregular.

    Blocks of columns are compared up to half a period, since two lamps may take turns. A few periods are soon found in
    a scene, so that these have to explain nearly all.
    """
    amplitude = fit.fundamental
    in_step = np.abs((amplitude**2).sum(axis=1)).sum() / (np.abs(amplitude) ** 2).sum()
    too_few_blocks = amplitude.shape[1] < FEWEST_BLOCKS
    is_regular = fit.frequency_error / fit.frequency <= MOST_ERROR
    least = LEAST_EXPLAINED if fit.frequency * rows >= MANY_PERIODS else LEAST_EXPLAINED_BY_FEW
    if reading.explained < least or not is_regular or not (too_few_blocks or in_step >= LEAST_IN_STEP):
        raise PsvideoError(NO_STRIPES)


NO_STRIPES = (
    f"holds no stripes that go evenly over the whole width with at least {FEWEST_PERIODS:g} periods over the height. "
    "Either the LED did not blink, or its light was too weak beside other light; or the exposure was a whole number of "
    "blinks; or the shutter is global; or the picture is turned, so that the stripes stand upright; or drawn text and "
    "panels lie over the picture (use clean `columns`). Film a white sheet that only the LED lights, with the shortest "
    "exposure, and choose the LED's rate so that 5 to 40 stripes fit into the height."
)


def _candidates(whole: Doubles, expected: float | None) -> list[float]:
    """Return the frequencies that are worth a fit, each once."""
    peaks = find_peaks(whole)
    found = [] if expected is None else [expected]
    distinct: list[float] = []
    rows = whole.shape[2]
    for frequency in found + [peak / part for peak in peaks for part in SUBHARMONICS]:
        is_new = all(abs(frequency - other) * rows > SAME_CYCLES for other in distinct)
        if is_new and 1 / rows < frequency < 1 / SHORTEST_PERIOD_ROWS:
            distinct.append(frequency)
    return distinct


def _read(whole: Doubles, frequency: float) -> FoundStripes:
    """Fit one candidate in the channel where it is strongest."""
    rows = whole.shape[2]
    wave = np.exp(-2j * np.pi * frequency * np.arange(rows)) * np.hanning(rows)
    channel = int(np.argmax(np.abs(detrended(whole) @ wave).sum(axis=0)))
    profiles = whole[:, [channel]]
    fit = fit_stripes(profiles, frequency, most_harmonics=HARMONICS)
    uneven = float((without(profiles, spline_basis(rows, frequency)) ** 2).sum())
    change = float((detrended(profiles) ** 2).sum())
    return FoundStripes(
        frequency=fit.frequency,
        explained=1 - fit.unexplained / max(uneven, 1e-12),
        left=fit.unexplained / max(change, 1e-12),
        channel=channel,
    )


def _refuse_wide(found: Sequence[FoundStripes], readings: Sequence[FoundStripes], rows: int) -> None:
    """Raise PsvideoError where stripes too wide to be measured explain far more than any narrower ones."""
    if not found:
        return
    best = min(found, key=lambda reading: reading.left)
    if best.explained > LEAST_EXPLAINED and all(best.left < WIDE_LEFT * reading.left for reading in readings):
        raise PsvideoError(
            f"shows about {best.frequency * rows:.1f} periods of stripes over its {rows} rows, and fewer than "
            f"{FEWEST_PERIODS:g} look like the scene itself. Let the LED blink faster, so that 5 to 40 stripes fit "
            "into the height, and see that it is the only light."
        )


def _is_echo(reading: FoundStripes, readings: Sequence[FoundStripes]) -> bool:
    """Return whether a reading only repeats a shorter period several times.

    Many periods in one are no light's doing, and thin stripes with sharp edges repeat exactly after several periods
    only, because their edges fall between rows.
    """
    for other in readings:
        times = _times(other, reading)
        is_thin = other.frequency > 1 / THIN_ROWS
        if times >= 2 and other.explained > HALF_EXPLAINED * reading.explained and (is_thin or times > MOST_TIMES):
            return True
    return False


def _shortest(readings: Sequence[FoundStripes]) -> FoundStripes:
    """Return the best reading, or one of its harmonics where that explains as much: the shortest period that does."""
    best = min(readings, key=lambda reading: reading.left)
    enough = max(best.left / (1 - CLEAR_GAIN), best.left + FAINT_GAIN)
    alike = [reading for reading in readings if reading.left <= enough and _times(reading, best)]
    return max(alike, key=lambda reading: reading.frequency)


def _times(reading: FoundStripes, other: FoundStripes) -> int:
    """Return how many times a reading's frequency is another's, 0 where that is no whole number."""
    ratio = reading.frequency / other.frequency
    return round(ratio) if abs(ratio - round(ratio)) < 0.02 * ratio else 0


def _refuse_ambiguous(chosen: FoundStripes, readings: Sequence[FoundStripes]) -> None:
    """Raise PsvideoError where every second stripe differs a little, or where other stripes are nearly as strong."""
    for other in readings:
        times = _times(other, chosen)
        is_half_explained = times >= 2 and other.explained > HALF_EXPLAINED * chosen.explained
        is_rival = not times and not _times(chosen, other) and other.explained > MOST_RIVAL * chosen.explained
        if chosen.explained > LEAST_EXPLAINED and (is_half_explained or is_rival):
            raise PsvideoError(
                f"holds stripes that can be read in two ways: one period in {1 / chosen.frequency:.2f} rows, or one in "
                f"{1 / other.frequency:.2f} rows. The light flickers in two rates, blinks unevenly, or lights a scene "
                "that repeats. Say roughly which readout time you expect (`near_s` 16ms), use clean `columns`, or film "
                "again with the LED alone."
            )
