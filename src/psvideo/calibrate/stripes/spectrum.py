"""The spectrum of row profiles (frame, channel, row): where it peaks, and what peaks beside the stripes found."""

import numpy as np

from psvideo.model.arrays import Doubles

PEAKS = 5
OVERSAMPLING = 8
LEAST_FAINT = 0.003
OUTSTANDING = 20.0
FOLDED = 40
WINDOW_CYCLES = 3.0
"""Fainter stripes are heard where their peak has this share of the main one's power and stands out this many times of
its neighbourhood, more than the window's width from the harmonics (this many) of the main ones."""


def find_peaks(whole: Doubles) -> list[float]:
    """Return where the spectrum over all frames and channels peaks, the highest first, in periods per row."""
    rows = whole.shape[2]
    power = _power(whole)
    return [top / (OVERSAMPLING * rows) for top in _tops(power, OVERSAMPLING)]


def find_fainter(whole: Doubles, frequency: float) -> float | None:
    """Return the frequency of fainter stripes beside those of a frequency, None where none stand out."""
    rows = whole.shape[2]
    power = _power(whole)
    places = np.arange(power.size) / (OVERSAMPLING * rows)
    harmonics = frequency * np.arange(FOLDED)
    folded = np.abs(harmonics - np.rint(harmonics))  # what rows make of harmonics above half a period per row
    apart = np.abs(places[:, None] - folded).min(axis=1) * rows
    outside = (apart > WINDOW_CYCLES) & (places * rows > WINDOW_CYCLES)
    if not outside.any():
        return None
    top = int(np.argmax(np.where(outside, power, 0)))
    around = outside & (places > 0.6 * places[top]) & (places < 1.6 * places[top])
    main = power[round(frequency * OVERSAMPLING * rows)]
    is_heard = power[top] > max(LEAST_FAINT * main, OUTSTANDING * float(np.median(power[around])))
    return float(places[top]) if is_heard else None


def _power(whole: Doubles) -> Doubles:
    """Return the spectrum's power, summed over frames and channels, at multiples of 1 / (8 rows) periods per row."""
    rows = whole.shape[2]
    spectrum = np.fft.rfft(detrended(whole) * np.hanning(rows), OVERSAMPLING * rows, axis=2)
    power: Doubles = (np.abs(spectrum) ** 2).sum(axis=(0, 1))
    return power


def _tops(curve: Doubles, lowest: int) -> list[int]:
    """Return the places of the highest local maxima from ``lowest`` on, the highest first."""
    tops = 1 + np.flatnonzero((curve[1:-1] > curve[:-2]) & (curve[1:-1] >= curve[2:]))
    tops = tops[tops >= lowest]
    return [int(top) for top in tops[np.argsort(-curve[tops])][:PEAKS]]


def detrended(profiles: Doubles) -> Doubles:
    """Take a cubic off every profile: the scene's own fall of light."""
    return without(profiles, np.vander(np.linspace(-1, 1, profiles.shape[-1]), 4))


def without(profiles: Doubles, smooth: Doubles) -> Doubles:
    """Take off every profile what smooth functions, shape (row, function), can follow."""
    basis = np.linalg.qr(smooth)[0]
    rest: Doubles = profiles - (profiles @ basis) @ basis.T
    return rest
