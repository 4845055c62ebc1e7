"""Which instants are delivered, numbered and named, and which plates they are brought from."""

import weakref
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from filmed_rounds import PITCH_S, ROUNDS, brought, brought_as_filmed, filmed, noiseless

from psvideo.plates.align import between
from psvideo.plates.align import packed as packed_pictures
from psvideo.plates.align.packed import Packing, PutBy
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import Mixture, mixture_of


@pytest.mark.parametrize("rate", ["round", "flash"])
def test_what_is_delivered_is_the_surface_at_the_time_that_it_names(rate: Any) -> None:
    clip = noiseless(3, "4 px")
    results = brought_as_filmed(3, "4 px", Aligning(rate=rate))
    for one in results[1:2] if rate == "round" else results[3:6]:
        assert {plate.time_s for plate in one.plates} == {one.plates[0].time_s}
        surface = clip.solved(one)
        off_deg = [clip.error_deg(surface, one.time_s + late * PITCH_S)[0] for late in (-0.25, 0.0, 0.25)]
        assert off_deg[1] < 1.0 < min(off_deg[0], off_deg[2])


@pytest.mark.parametrize("which", [0, -1])
def test_the_first_and_the_last_round_have_one_side_only(which: int) -> None:
    clip = noiseless(3, "4 px")
    one = brought_as_filmed(3, "4 px")[which]
    assert clip.error_deg(clip.solved(one), one.time_s)[0] < 1.5


@pytest.mark.parametrize(
    ("motion", "how", "per_light", "later"),
    [
        ("at rest", Aligning(align="none"), 1.0, 1.0),
        ("at rest", Aligning(), 1.5, 1.0),  # the early half of the first round waits for that of the next
        ("4 px", Aligning(), 1.5, 1.25),  # the plates of an instant are packed, and those they are made from
        ("4 px", Aligning(align="none", rate="flash"), 2.0, 2.0),  # two rounds
        ("4 px", Aligning(rate="flash"), 2.0, 1.25),  # two rounds packed, and an instant
    ],
)
@pytest.mark.campaign
def test_no_more_plates_are_held_than_instants_need(
    motion: str, how: Aligning, per_light: float, later: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """``later`` is once the first instant is out."""
    clip = filmed(8, motion)
    sizes: dict[int, float] = {}
    most = most_later = 0.0
    instants = 0

    def count(image: np.ndarray) -> None:
        if id(image) not in sizes:
            sizes[id(image)] = image.nbytes / clip.rounds[0].plates[0].image.nbytes
            weakref.finalize(image, sizes.pop, id(image))

    def plates() -> Iterator[LightPlate]:
        nonlocal most, most_later
        for one in clip.rounds:
            for plate in one.plates:
                own = replace(plate, picture=mixture_of(plate.image.copy()))
                count(own.image)
                most = max(most, sum(sizes.values()))
                most_later = max(most_later, sum(sizes.values()) if instants else 0.0)
                yield own
                del own

    class Watched(Packing):
        def picture(self, saturation: float, put_by: PutBy | None = None) -> Mixture:
            count(self.codes)
            return super().picture(saturation, put_by)

    monkeypatch.setattr(packed_pictures, "Packing", Watched)
    monkeypatch.setattr(between, "Packing", Watched)
    for shown in aligned(plates(), clip.lights, how, first=1001):
        instants += 1
        for plate in shown.plates:
            if plate.picture.is_made:
                count(plate.image)
        most = max(most, sum(sizes.values()))
        del shown, plate
    assert most <= per_light * len(clip.lights) + 1  # the plate that comes
    assert most_later <= later * len(clip.lights) + 1
    assert not sizes


@pytest.mark.parametrize("rate", ["round", "flash"])
@pytest.mark.parametrize("align", ["none", "auto", "flow"])
def test_a_dark_slot_goes_with_its_own_round_wherever_it_lies_and_a_round_without_has_none(
    align: Any, rate: Any
) -> None:
    """A part of the pictures will do: numbers are asked for, not what the pictures show."""
    clip = filmed(3, "at rest")

    def part(plate: LightPlate) -> LightPlate:
        picture = mixture_of(np.ascontiguousarray(plate.image[60:120, 80:160]))
        return replace(plate, picture=picture, seen=plate.seen[60:120])

    def plates(dark_at: int) -> Iterator[LightPlate]:
        for one in clip.rounds:
            given = [part(plate) for plate in one.plates]
            if one.number != 1002:
                given.insert(dark_at, replace(given[0], light="ambient"))
            yield from given

    for dark_at in (0, 2, 3):
        how = Aligning(align=align, rate=rate)
        results = list(aligned(plates(dark_at), clip.lights, how, first=1001, with_ambient=True))
        numbers = [None if one.ambient is None else one.ambient.number for one in results]
        each = 3 if rate == "flash" else 1
        assert numbers == [number for number in (1001, None, 1003) for _ in range(each)]
        assert [one.lights for one in results] == [clip.lights] * len(results)


def test_one_result_per_flash_takes_numbers_of_its_own() -> None:
    clip = noiseless(3, "4 px")
    results = brought_as_filmed(3, "4 px", Aligning(rate="flash"))
    assert [one.number for one in results] == list(range(1001, 1001 + 3 * ROUNDS))
    flashes_s = [plate.time_s for one in clip.rounds for plate in one.plates]
    assert [one.time_s for one in results] == pytest.approx(flashes_s, abs=1e-12)
    one_missing = [one.number for one in brought(clip, Aligning(rate="flash"), rounds=clip.rounds[1:])]
    assert one_missing == list(range(1004, 1010))


def test_without_flow_a_result_per_flash_takes_the_plates_nearest_in_time() -> None:
    clip = filmed(3, "4 px")
    first = brought(clip, Aligning(align="none", rate="flash"))[3]
    want = [clip.rounds[1].plates[0], clip.rounds[1].plates[1], clip.rounds[0].plates[2]]
    assert all(shown.image is given.image for shown, given in zip(first.plates, want, strict=True))


def test_a_round_that_lacks_a_light_is_not_shown_but_helps_its_neighbours() -> None:
    clip = filmed(3, "4 px")
    rounds = list(clip.rounds)
    rounds[2] = replace(rounds[2], plates=rounds[2].plates[:1])
    results = brought(clip, rounds=tuple(rounds))
    assert [one.number for one in results] == [1001, 1002]
    assert clip.error_deg(clip.solved(results[1]), results[1].time_s)[0] < 1.5


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1), (4, 4), (7, 200), (8, 8), (8, 12), (11, 11), (12, 12)])
@pytest.mark.parametrize("how", ["auto", "flow"])
def test_pictures_of_a_few_pixels_are_brought_together_without_flow(shape: tuple[int, int], how: Any) -> None:
    rng = np.random.default_rng(0)
    plates = [
        LightPlate(
            light=light,
            number=1000 + number,
            time_s=float(4 * number + place),
            picture=mixture_of((0.5 * rng.random(shape)).astype(np.float32)),
            seen=np.ones(shape[0], np.bool_),
        )
        for number in range(1, 4)
        for place, light in enumerate("abcd")
    ]
    found = list(aligned(plates, tuple("abcd"), Aligning(align=how), first=1001))
    assert [one.number for one in found] == [1001, 1002, 1003]
    assert all(plate.shape == shape and np.isfinite(plate.image).all() for one in found for plate in one.plates)
