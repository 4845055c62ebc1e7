"""When a movie's frames were taken: gaps, edit lists, rates that vary or are another than the plan's."""

import dataclasses
import struct
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from written_movies import RATE, grey_ramp, in_10_bits, make_frame, write_movie

from psvideo.clip import Clip, Take, open_clip, read_frames
from psvideo.errors import NoStrobeError, PsvideoError, UsageError
from psvideo.formats.plan_toml import format_plan
from psvideo.inspect.describe import describe
from psvideo.model.plan import Plan
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.gather import scheduled
from psvideo.runs.steps.output import tags_of, take_rate
from psvideo.sync.open_take import open_take
from psvideo.sync.take_timing import find_timing
from psvideo.synth import TrueClock, expose

PlanMaker = Callable[..., Plan]
ONE = 1 << 16


@pytest.mark.parametrize("name", ["x.mp4", "x.mkv", "x.mov"])
def test_gaps_in_the_timestamps_are_dropped_frames(
    tmp_path: Path, written_plan: Callable[..., Path], name: str
) -> None:
    places = [0, 1, 2, 3, 5, 6, 9, 10, 11, 12]
    codec = "ffv1" if name.endswith("mkv") else "libx264"
    write_movie(tmp_path / name, grey_ramp(10), codec=codec, places=places)
    clip = open_clip(tmp_path / name, plan=written_plan(rows=32, cols=48))
    assert clip.numbers == tuple(places)
    assert [frame.index for frame in read_frames(clip)] == places


def shot_before_time_zero(path: Path, *, reordered: str, hidden: int = 4) -> None:
    """Write twelve frames; those before time zero are hidden by an edit list, as where a phone's movie was cut."""
    with av.open(str(path), "w", options={"avoid_negative_ts": "disabled"}) as container:
        stream: Any = container.add_stream("libx264", rate=RATE, options={"bf": reordered, "qp": "0", "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
        stream.codec_context.time_base = 1 / RATE
        for place, frame in enumerate(grey_ramp(12)):
            frame.pts, frame.time_base = place - hidden, 1 / RATE
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def with_edits(path: Path, edits: Sequence[tuple[float, int]]) -> None:
    """Write another edit list into a movie of one stream: seconds and the first frame (-1: nothing) of every edit.

    The boxes are those of ISO/IEC 14496-12; what follows the first one in ``edts`` becomes free space.
    """
    data = path.read_bytes()
    at = data.index(b"elst") - 4
    (movie_hz,) = struct.unpack_from(">I", data, data.index(b"mvhd") + 16)
    (media_hz,) = struct.unpack_from(">I", data, data.index(b"mdhd") + 16)
    rows = b"".join(
        struct.pack(">IiI", round(long_s * movie_hz), round(first / float(RATE) * media_hz) if first >= 0 else -1, ONE)
        for long_s, first in edits
    )
    box = struct.pack(">I4sII", 16 + len(rows), b"elst", 0, len(edits)) + rows
    more = len(box) - struct.unpack_from(">I", data, at)[0]
    data = data[:at] + box + data[at + len(box) - more :]
    for parent in (b"edts", b"trak", b"moov"):
        place = data.index(parent) - 4
        data = data[:place] + struct.pack(">I", struct.unpack_from(">I", data, place)[0] + more) + data[place + 4 :]
    path.write_bytes(data)


@pytest.mark.parametrize("reordered", ["0", "2"])
def test_frames_that_an_edit_list_hides_are_left_out_and_said(
    tmp_path: Path, written_plan: Callable[..., Path], reordered: str
) -> None:
    shot_before_time_zero(tmp_path / "x.mp4", reordered=reordered)
    clip = open_clip(tmp_path / "x.mp4", plan=written_plan(rows=32, cols=48))
    frames = list(read_frames(clip))
    assert [frame.index for frame in frames] == list(range(8)), "zero is the first frame that is shown"
    assert frames[0].image[0, 0, 1] == pytest.approx((40 + 8 * 4 - 16) / 219, abs=2e-3)
    assert any("its edit list hides 4 of the 12 frames" in warning for warning in clip.warnings)


def places_shown(clip: Clip) -> list[int]:
    """Return which frames of the grey ramp a clip shows, by their codes."""
    return [round((float(frame.image[16, 24, 1]) * 219 + 16 - 40) / 8) for frame in read_frames(clip)]


@pytest.mark.parametrize(
    ("edits", "places"),
    [
        ([(12, 0)], range(12)),
        ([(0, 0)], range(12)),
        ([(1, -1), (12, 0)], range(12)),
        ([(5, 3)], range(3, 8)),
        ([(5, 3)] * 3, range(3, 8)),
        ([(3, 0), (4, 6)], [0, 1, 2, 6, 7, 8, 9]),
        ([(4, 6), (3, 0), (3, 0)], [0, 1, 2, 6, 7, 8, 9]),
    ],
    ids=["whole", "no length", "late", "middle", "three times", "cut", "turned round"],
)
def test_every_edit_shows_its_frames_once_at_the_times_at_which_they_were_taken(
    tmp_path: Path, written_plan: Callable[..., Path], edits: list[tuple[float, int]], places: Sequence[int]
) -> None:
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(12)), codec="prores", matrix=1)
    with_edits(tmp_path / "x.mov", [(frames / float(RATE), first) for frames, first in edits])
    clip = open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48))
    assert clip.numbers == tuple(place - places[0] for place in places)
    assert places_shown(clip) == list(places)
    assert ["hides" in warning for warning in clip.warnings] == [True] * (len(places) < 12)


def test_an_edit_that_shows_a_moment_of_a_frame_shows_that_frame(
    tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    """As players do and FFmpeg; a movie's clock rounds by a tenth of a frame here, and a little is added for that."""
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(12)), codec="prores", matrix=1)
    with_edits(tmp_path / "x.mov", [(5.3 / float(RATE), 2)])
    clip = open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48))
    assert places_shown(clip) == list(range(2, 8))
    with av.open(str(tmp_path / "x.mov")) as container:
        assert len(list(container.decode(video=0))) == 6


def test_a_movie_whose_edits_show_nothing_is_refused(tmp_path: Path, written_plan: Callable[..., Path]) -> None:
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(12)), codec="prores", matrix=1)
    with_edits(tmp_path / "x.mov", [(0.02, 40)])
    with pytest.raises(PsvideoError, match="edit list shows none of its 12 frames"):
        open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48))


def test_uneven_timestamps_are_refused(tmp_path: Path, written_plan: Callable[..., Path]) -> None:
    with av.open(str(tmp_path / "x.mp4"), "w") as container:
        stream: Any = container.add_stream("libx264", rate=120, options={"threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1200)
        for place, frame in enumerate(grey_ramp(12)):
            frame.pts, frame.time_base = 10 * place + (4 if place % 3 == 1 else 0), Fraction(1, 1200)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    with pytest.raises(PsvideoError, match=r"x\.mp4: its frames do not come at an even rate"):
        open_clip(tmp_path / "x.mp4", plan=written_plan(rows=32, cols=48))


SLOWER = [4] * 10 + [5] * 10 + [4] * 9
"""A phone in dim light: 30 frames a second, then 24, then 30 again, as places of 1/120 s."""


def movie_of_varying_rate(path: Path, plan: Plan, steps: list[int], phase_s: float) -> None:
    """Film a wall under the plan's strobe at the places of 1/120 s that the steps lead to, and write these as times."""
    places = np.concatenate([[0], np.cumsum(steps)])
    camera = dataclasses.replace(plan.camera, fps=RATE)
    plates = [None if flash.is_dark else np.full((160, 8), 0.3 + 0.1 * n) for n, flash in enumerate(plan.flashes)]
    dropped = sorted(set(range(places[-1] + 1)) - set(places.tolist()))
    shot = expose(
        plates,
        dataclasses.replace(plan, camera=camera),
        frames=int(places[-1]) + 1,
        clock=TrueClock(phase_s=phase_s, offset_ppm=40.0),
        dropped=dropped,
    )
    frames = [make_frame([(65535 * frame).astype(np.uint16)], "gray16le") for frame in np.clip(shot.frames, 0, 1)]
    write_movie(path, frames, places=places.tolist())


def test_frames_of_a_rate_that_changes_are_taken_at_their_own_times(tmp_path: Path, make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=8, height_px=160, fps=RATE / 4, duration_s=0.003)
    movie_of_varying_rate(tmp_path / "x.mkv", plan, SLOWER, phase_s=0.0123)
    (tmp_path / "plan.toml").write_text(format_plan(plan))
    clip = open_clip(tmp_path / "x.mkv", plan=tmp_path / "plan.toml")
    assert np.diff(clip.numbers).tolist() == SLOWER, "to the millisecond, as Matroska counts"
    assert clip.plan.camera.fps == RATE
    assert clip.filmed_plan.camera.fps == tags_of(clip).camera_fps == plan.camera.fps
    assert any("varies from 23.9" in warning and "29.9" in warning for warning in clip.warnings)
    timing = find_timing(Take(clip=clip, numbers=clip.numbers))
    assert timing.dropped_frames == ()
    assert timing.clock_offset_ppm == pytest.approx(40.0, abs=20.0)
    truth_s = 0.0123 + np.arange(200) * (plan.flashes[0].duration_s + plan.dark_s) * (1 + 40e-6)
    off_s = [np.abs(truth_s - flash.start_s).min() for flash in timing.flashes if flash.complete]
    assert len(off_s) > 10
    assert max(off_s) < 1e-4
    take = Take(clip=clip, numbers=clip.numbers)
    due = scheduled(take, timing, Aligning(rate=take_rate("frame", take)), start_number=1001)
    assert due is not None
    shown = {number: time_s for round_ in due.by_round.values() for number, time_s in round_}
    assert set(shown) < {1001 + number for number in clip.numbers}, "every result is a frame's, none between"
    assert len(shown) + sum(due.left_out) == len(clip.numbers)
    middle_s = clip.plan.camera.middle_s
    assert all(at_s == pytest.approx(middle_s + (n - 1001) / float(RATE), abs=1e-9) for n, at_s in shown.items())
    with pytest.raises(UsageError, match="vary in rate"):
        take_rate("frame", take, shutter=180)


def test_stamps_that_leave_out_frames_which_none_is_missing_of_are_what_is_named(
    tmp_path: Path, make_plan: PlanMaker
) -> None:
    """A program skipped a place after every seventh frame of a strobe that no frame missed: the plan was blamed."""
    plan = make_plan(width_px=8, height_px=60, fps=RATE)
    plates = [None if flash.is_dark else np.full((60, 8), 0.3 + 0.1 * n) for n, flash in enumerate(plan.flashes)]
    shot = expose(plates, plan, frames=44, clock=TrueClock(phase_s=0.0123, offset_ppm=40.0))
    frames = [make_frame([(65535 * frame).astype(np.uint16)], "gray16le") for frame in np.clip(shot.frames, 0, 1)]
    (tmp_path / "plan.toml").write_text(format_plan(plan))
    write_movie(tmp_path / "even.mkv", frames)
    write_movie(tmp_path / "x.mkv", frames, places=[n + n // 7 for n in range(44)])
    assert find_timing(open_take(tmp_path / "even.mkv")).dropped_frames == ()
    with pytest.raises(NoStrobeError, match=r"x\.mkv: its time stamps leave out 6 frames \(after number 6, 14, 22, 30"):
        find_timing(open_take(tmp_path / "x.mkv"))


def test_a_rate_that_changes_is_refused_where_every_frame_is_to_have_its_flash(
    tmp_path: Path, make_plan: PlanMaker
) -> None:
    plan = make_plan(width_px=8, height_px=160, fps=RATE / 4, duration_s=0.003)
    movie_of_varying_rate(tmp_path / "x.mkv", plan, SLOWER, phase_s=0.0)
    synced = dataclasses.replace(plan, mode="synced")
    (tmp_path / "plan.toml").write_text(format_plan(synced))
    with pytest.raises(PsvideoError, match=r"varies from .* constant frame rate"):
        open_clip(tmp_path / "x.mkv", plan=tmp_path / "plan.toml")


def test_a_movie_that_plays_at_another_rate_is_read_with_a_note(
    tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(6)), codec="prores", matrix=1)
    assert open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48)).warnings == ()
    misnamed = open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48, fps=Fraction(120)))
    assert "plays at 119.88 frames per second and the plan says 120" in misnamed.warnings[0]


@pytest.mark.parametrize("rate", [60.0, 59.0])
def test_timestamps_that_jitter_say_no_other_rate_than_the_plans(
    rate: float, tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    """A phone's stamps are off by 3 % of a frame or so, the first and the last too: that is no other rate."""
    plan = written_plan(rows=32, cols=48, fps=Fraction(60))
    for seed in range(8):
        rng = np.random.default_rng(seed)
        with av.open(str(tmp_path / "x.mp4"), "w") as container:
            stream: Any = container.add_stream("libx264", rate=60, options={"threads": "1", "bf": "0"})
            stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
            stream.codec_context.time_base = Fraction(1, 90_000)
            for place, frame in enumerate(frame for _ in range(5) for frame in grey_ramp(10)):
                late = 0.05 * rng.standard_normal()
                frame.pts, frame.time_base = round(90_000 / rate * (place + 1 + late)), Fraction(1, 90_000)
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
        said = [text for text in open_clip(tmp_path / "x.mp4", plan=plan).warnings if "frames per second" in text]
        assert bool(said) == (rate != 60.0)


def test_the_rate_at_which_a_phone_shot_slow_motion_counts(
    shared_data: Path, written_plan: Callable[..., Path]
) -> None:
    movie = shared_data / "movies" / "video_phone" / "androidx_sample_sef_slow_motion.mp4"
    if not movie.is_file():
        pytest.skip("the real movies are not there")
    of_itself = " ".join(finding.text for finding in describe(movie).findings)
    assert "64 frames, 30 frames a second, shot at 240: movie, 320 x 240 pixels" in of_itself
    assert "there is no plan.toml" in of_itself
    slow = open_clip(movie, plan=written_plan(rows=240, cols=320, fps=Fraction(240)))
    assert not any("frames per second" in warning for warning in slow.warnings)
    wrong = open_clip(movie, plan=written_plan(rows=240, cols=320, fps=Fraction(120)))
    assert any("was shot at 240 frames per second, and the plan says 120" in warning for warning in wrong.warnings)
