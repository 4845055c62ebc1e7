"""The facts of a take's rounds, kept as plain numbers: a take of two hours has 40,000 rounds."""

from collections.abc import Iterable, Iterator, Sequence
from math import isnan, nan
from struct import Struct
from typing import NamedTuple, overload

from psvideo.model.surface import Misfit, Reflectance
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.steadiness import Change

_FIXED = Struct("=qI20d")
"""A round's number, of how many lights there are levels, and what it has one number for; NaN is what is not known."""


class _Shared(NamedTuple):
    """What a round mostly has in common with the one before, and is then kept once."""

    white: tuple[float, ...]
    reflectance: Reflectance | None


class KeptFacts(Sequence[InstantFacts]):
    """Facts of rounds in turn: 250 bytes each under four lights, where records of numbers take 1,400. Each is made when
    it is asked for, equal to the one that was put in."""

    def __init__(self, facts: Iterable[InstantFacts] = ()) -> None:
        self._packed: list[bytes] = []
        self._shared: list[_Shared] = []
        self.extend(facts)

    def extend(self, facts: Iterable[InstantFacts]) -> None:
        """Put several behind the others."""
        for one in facts:
            self.append(one)

    def append(self, one: InstantFacts) -> None:
        """Put one behind the others."""
        shared = _Shared(one.white, None if one.misfit is None else one.misfit.reflectance)
        self._packed.append(_packed(one))
        self._shared.append(self._shared[-1] if self._shared and self._shared[-1] == shared else shared)

    def __len__(self) -> int:
        return len(self._packed)

    @overload
    def __getitem__(self, place: int) -> InstantFacts: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[InstantFacts, ...]: ...
    def __getitem__(self, place: int | slice) -> InstantFacts | tuple[InstantFacts, ...]:
        if isinstance(place, slice):
            return tuple(map(_unpacked, self._packed[place], self._shared[place]))
        return _unpacked(self._packed[place], self._shared[place])

    def __iter__(self) -> Iterator[InstantFacts]:
        return map(_unpacked, self._packed, self._shared)


def _packed(one: InstantFacts) -> bytes:
    change = (nan, nan, nan)
    if one.change is not None:
        change = (one.change.normals_deg, one.change.albedo_percent, one.change.level_percent)
    misfit = (nan, nan, nan, nan)
    if one.misfit is not None:
        found = one.misfit
        misfit = (found.share, found.error_deg, found.noise_deg, found.distance_share)
    known = (one.valid_share, one.ambient, one.speed_px_s, one.moving_share, one.measured_share,
             one.moving_valid_share, one.likely_deg)  # fmt: skip
    fixed = _FIXED.pack(
        one.number,
        len(one.levels),
        one.time_s,
        one.clipped_share,
        one.unseen_share,
        one.borrowed_share,
        one.slope_deg,
        one.spoilt_share,
        *(nan if value is None else value for value in known),
        *change,
        *misfit,
    )
    lights = (*one.levels, *one.clipped)
    return fixed + Struct(f"={len(lights)}d").pack(*lights)


def _unpacked(packed: bytes, shared: _Shared) -> InstantFacts:
    number, count, time_s, clipped_share, unseen_share, borrowed_share, slope_deg, spoilt_share, *rest = (
        _FIXED.unpack_from(packed)
    )
    valid, ambient, speed_px_s, moving, measured, held, likely = (None if isnan(value) else value for value in rest[:7])
    change, misfit = rest[7:10], rest[10:]
    lights = memoryview(packed)[_FIXED.size :].cast("d")
    return InstantFacts(
        number=number,
        time_s=time_s,
        valid_share=valid,
        measured_share=measured,
        clipped_share=clipped_share,
        unseen_share=unseen_share,
        borrowed_share=borrowed_share,
        slope_deg=slope_deg,
        spoilt_share=spoilt_share,
        likely_deg=likely,
        change=None
        if isnan(change[0])
        else Change(normals_deg=change[0], albedo_percent=change[1], level_percent=change[2]),
        levels=tuple(lights[:count]),
        clipped=tuple(lights[count:]),
        white=shared.white,
        ambient=ambient,
        speed_px_s=speed_px_s,
        moving_share=moving,
        moving_valid_share=held,
        misfit=None
        if isnan(misfit[0])
        else Misfit(
            share=misfit[0],
            error_deg=misfit[1],
            noise_deg=misfit[2],
            distance_share=misfit[3],
            reflectance=shared.reflectance,
        ),
    )
