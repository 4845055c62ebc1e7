"""Plan, rig and timing files: what is written reads back equal, and what breaks the contract is said in a paragraph."""

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.frame_rates import parse_fps
from psvideo.formats.plan_toml import format_plan, parse_plan, read_plan
from psvideo.formats.rig_toml import format_rig, parse_rig, read_rig
from psvideo.formats.timing_json import format_timing, read_timing
from psvideo.formats.whole_files import refuse_existing, write_text
from psvideo.model.camera import Camera, Encoding
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig, directions, intensities
from psvideo.model.timing import DroppedFrames, Flash, Timing

names = st.text("abcdefgh_-é", min_size=1, max_size=8)
positive = st.floats(1e-6, 1e-2)

plans = st.builds(
    Plan,
    camera=st.builds(
        Camera,
        width_px=st.integers(1, 8192),
        height_px=st.integers(1, 8192),
        fps=st.fractions(1, 100, max_denominator=1001),
        exposure_s=positive,
        readout_s=st.one_of(st.none(), st.floats(-0.0099, 0.0099)),
        name=names,
        encoding=st.builds(
            Encoding,
            transfer=st.sampled_from(["linear", "slog3"]),
            black_level=st.one_of(st.none(), st.floats(0, 500)),
            white_level=st.one_of(st.none(), st.floats(501, 65535)),
            cfa=st.sampled_from([None, "RGGB", "GBRG"]),
        ),
    ),
    flashes=st.lists(
        st.builds(
            PlannedFlash, lights=st.dictionaries(names, st.floats(0.01, 1), min_size=1, max_size=3), duration_s=positive
        ),
        min_size=1,
        max_size=5,
    ).map(tuple),
    dark_s=st.floats(0, 0.02),
    mode=st.sampled_from(["rolling", "half-rate"]),
    rise_s=st.floats(0, 1e-4),
    fall_s=st.floats(0, 1e-4),
    clock_tolerance_ppm=st.one_of(st.none(), st.floats(0, 10_000)),
    dark_every=st.integers(1, 50),
)

MINIMAL = """
schema = "psvideo-plan/1"
[camera]
width_px = 64
height_px = 48
fps = 100
shutter_deg = 360
readout_s = 0.01
[strobe]
[[strobe.flash]]
lights = { key = 1.0 }
duration_s = 0.001
"""


@given(plans)
def test_a_plan_reads_back_as_it_was_written(plan: Plan) -> None:
    assert parse_plan(format_plan(plan)) == plan


def test_the_dark_time_that_a_plan_leaves_out_is_the_exposure_plus_what_a_fast_strobe_clock_takes_away() -> None:
    plan = parse_plan(MINIMAL)
    assert plan.dark_s * (1 - 100e-6) == pytest.approx(plan.camera.exposure_s, rel=1e-12)


def test_half_rate_flashes_start_every_two_frames() -> None:
    plan = parse_plan(MINIMAL.replace("[strobe]", '[strobe]\nmode = "half-rate"'))
    assert np.diff(plan.train(0, 3).start_s) == pytest.approx([0.02, 0.02])


def test_a_synced_plan_needs_no_times() -> None:
    text = 'schema = "psvideo-plan/1"\n[camera]\nwidth_px = 2\nheight_px = 2\nfps = 1\n[strobe]\nmode = "synced"\n'
    plan = parse_plan(text + "[[strobe.flash]]\nlights = { a = 1.0 }\n")
    assert plan.camera.exposure_s == 1.0
    assert plan.camera.row_time_s == 0.0


def test_dark_slots_are_kept_only_in_every_nth_round() -> None:
    flashes = tuple(PlannedFlash(lights=lights, duration_s=0.001) for lights in ({"a": 1.0}, {"b": 1.0}, {}))
    plan = replace(parse_plan(MINIMAL), flashes=flashes, dark_every=3)
    assert plan.cycle_slots == (0, 1, 2, 0, 1, 0, 1)
    train = plan.train(-8, 16)
    assert train.slot.tolist() == [1, 0, 1, 2, 0, 1, 0, 1, 0, 1, 2, 0, 1, 0, 1, 0]
    assert np.diff(train.start_s) == pytest.approx(np.full(15, 0.001 + plan.dark_s))
    assert train.start_s[8] == 0.0


BROKEN_PLANS = {
    "unknown key": ('name="x"\nshutter = 180', "did you mean 'shutter_deg'?"),
    "impossible size": ("width_px = 0", "camera.width_px"),
    "no number": ('fps = "abc"', "camera.fps"),
    "both exposures": ("exposure_s = 0.004", "one of the two"),
    "readout too long": ("readout_s = 0.02", "longer than the frame period"),
    "readout in milliseconds": ("readout_s = 8", "times are in seconds, and 8 ms is 0.008"),
    "not finite": ("readout_s = nan", "readout_s"),
    "black above white": ("black_level = 9.0\nwhite_level = 3.0", "below white_level"),
}


@pytest.mark.parametrize("case", BROKEN_PLANS)
def test_a_broken_plan_is_reported_by_file_key_and_remedy(case: str, tmp_path: Path) -> None:
    line, expected = BROKEN_PLANS[case]
    key = line.split("=")[0].strip()
    lines = [row for row in MINIMAL.splitlines() if not row.startswith(key)]
    path = tmp_path / "plan.toml"
    path.write_text("\n".join(lines).replace("[camera]", f"[camera]\n{line}"))
    with pytest.raises(PsvideoError) as said:
        read_plan(path)
    assert str(path) in str(said.value)
    assert expected in str(said.value)
    assert "\n" not in str(said.value)


def test_a_newer_major_version_is_refused_plainly() -> None:
    with pytest.raises(PsvideoError, match="newer file needs a newer psvideo"):
        parse_plan(MINIMAL.replace("plan/1", "plan/2"))


def test_every_mistake_is_named_at_once() -> None:
    with pytest.raises(PsvideoError, match=r"width_px.*duration_s"):
        parse_plan(MINIMAL.replace("width_px = 64", "width_px = -1").replace("duration_s = 0.001", "duration_s = 0"))


def test_of_thousands_of_mistakes_the_first_are_named() -> None:
    """A program that writes every flash wrong makes as many as there are flashes, and 20,000 took two minutes."""
    head, _, _ = MINIMAL.partition("[[strobe.flash]]")
    text = head + 20_000 * "[[strobe.flash]]\nduration_s = 0.001\n"
    began_s = time.process_time()
    with pytest.raises(PsvideoError) as fault:
        parse_plan(text, source="plan.toml")
    assert time.process_time() - began_s < 5
    assert "key 'strobe.flash[1].lights' is missing" in str(fault.value)
    assert str(fault.value).rstrip().endswith("and more like these.")
    assert len(str(fault.value)) < 1000


unit_vectors = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.1, 1)).map(
    lambda v: tuple(float(x) for x in np.array(v) / np.linalg.norm(v))
)


@given(st.lists(unit_vectors, min_size=1, max_size=5), st.floats(0.01, 9))
def test_a_rig_reads_back_as_it_was_written(vectors: list[tuple[float, float, float]], strength: float) -> None:
    lights = [Light(name=f"l{n}", direction=vector, intensity=(strength, 1.0, 0.5)) for n, vector in enumerate(vectors)]
    near = Light(name="near", position_m=(0.1, 0.2, 0.3), anisotropy=1.0, axis=vectors[0], error_deg=0.5)
    rig = Rig(lights=(*lights, near), focal_px=(2000.0, 2000.0), principal_px=(1.0, 2.0), plane=(0.0, 0.0, 1.0, 1.2))
    assert parse_rig(format_rig(rig)) == rig


def test_light_lists_of_other_programs_are_read(tmp_path: Path) -> None:
    vectors = np.array([[0.0, 0.6, 0.8], [0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]])
    rows = [" ".join(map(str, vector)) for vector in vectors]
    (tmp_path / "rti.lp").write_text("3\n" + "\n".join(f"image_{n}.png {row}" for n, row in enumerate(rows)))
    (tmp_path / "uw.txt").write_text("3\n" + "\n".join(rows))
    (tmp_path / "light_directions.txt").write_text("\n".join(rows))
    (tmp_path / "light_intensities.txt").write_text("1 2 3\n4 5 6\n7 8 9\n")
    for name in ("rti.lp", "uw.txt", "light_directions.txt"):
        rig = read_rig(tmp_path / name, plan_lights=("a", "b", "c"))
        assert rig.names == ("a", "b", "c")
        np.testing.assert_allclose(directions(rig.lights), vectors, atol=1e-12)
    assert rig.lights[1].intensity == (4.0, 5.0, 6.0)
    assert read_rig(tmp_path / "uw.txt").lights[1].intensity == (1.0,)
    with pytest.raises(PsvideoError, match="lists 3 lights, and the plan flashes 2"):
        read_rig(tmp_path / "uw.txt", plan_lights=("a", "b"))


def test_the_list_of_the_university_of_washington_is_read(shared_data: Path) -> None:
    rig = read_rig(shared_data / "uw_psm" / "lights.txt")
    assert len(rig.lights) == 12
    np.testing.assert_allclose(np.linalg.norm(directions(rig.lights), axis=1), 1.0, atol=1e-12)


BROKEN_RIGS = {
    "no direction": ('name = "a"', "needs either direction"),
    "millimetres for a direction": ('name = "a"\ndirection = [100.0, 0.0, 900.0]', "expected a unit vector"),
    "two of a name": (
        'name = "a"\ndirection = [0.0, 0.0, 1.0]\n[[light]]\nname = "a"\ndirection = [0.0, 0.0, 1.0]',
        "two lights have the name 'a'",
    ),
    "unknown key": ('name = "a"\ndirektion = [0.0, 0.0, 1.0]', "did you mean 'direction'?"),
    "a name that is taken": ('name = "ambient"\ndirection = [0.0, 0.0, 1.0]', "cannot be a light's name"),
    "no strength": (
        'name = "a"\ndirection = [0.0, 0.0, 1.0]\nintensity = 0.0',
        r"is 0.0: expected greater than 0 or a list (a light that stayed dark keeps the strength",
    ),
    "strength in words": (
        'name = "a"\ndirection = [0.0, 0.0, 1.0]\nintensity = "full"',
        "key 'light[1].intensity' is 'full': expected a number or a list.",
    ),
}


@pytest.mark.parametrize(
    ("rig", "said"),
    [
        ("light = [[1, 2, 3]]", r"expected a table, \[\[light\]\]"),
        ("[light]\nname = 'a'", r"one table: expected a list of them, so write \[\[light\]\]"),
        ("[[light]]\nname = 'a'\ndirection = [0.1, 0.2]", r"direction' is \[0.1, 0.2\]: expected at least 3 values\.$"),
        ("[[light]]\nname = 'a'\nintensity = [1, -2, 1]", r"toml: key 'light\[1\].intensity\[2\]' is -2: [^;]*\.$"),
    ],
)
def test_a_value_of_another_shape_is_named_with_the_one_that_is_expected(rig: str, said: str) -> None:
    with pytest.raises(PsvideoError, match=said):
        parse_rig(f'schema = "psvideo-rig/1"\n{rig}\n', source="rig.toml")


@pytest.mark.parametrize("case", BROKEN_RIGS)
def test_a_broken_rig_is_reported_by_file_key_and_remedy(case: str) -> None:
    text, expected = BROKEN_RIGS[case]
    with pytest.raises(PsvideoError) as said:
        parse_rig(f'schema = "psvideo-rig/1"\n[[light]]\n{text}\n', source="shoot/rig.toml")
    assert "shoot/rig.toml" in str(said.value)
    assert expected in str(said.value)


def test_a_light_that_the_rig_lacks_is_named_with_the_nearest() -> None:
    rig = Rig(lights=(Light(name="left", direction=(0.0, 0.0, 1.0)),))
    with pytest.raises(PsvideoError, match=r"no light named 'lefty'.*did you mean 'left'"):
        rig.select(["lefty"])


def test_intensities_stand_for_all_channels_or_for_each() -> None:
    above = (0.0, 0.0, 1.0)
    one = Light(name="a", intensity=(2.0,), direction=above)
    lights = (one, Light(name="b", intensity=(1.0, 2.0, 3.0), direction=above))
    assert intensities(lights, 3).tolist() == [[2, 2, 2], [1, 2, 3]]
    with pytest.raises(PsvideoError, match="'b' has 3 intensities and the pictures have 1"):
        intensities(lights, 1)


times = st.floats(-1, 1e5, allow_nan=False)


@given(st.lists(st.tuples(times, positive, st.booleans()), max_size=4), st.floats(-1e4, 1e4))
def test_a_timing_reads_back_as_it_was_written(rows: list[tuple[float, float, bool]], ppm: float) -> None:
    flashes = tuple(
        Flash(index=n, slot=n % 3, lights={"key": 1.0} if n % 3 else {}, start_s=t, duration_s=d, complete=c)
        for n, (t, d, c) in enumerate(rows)
    )
    timing = Timing(
        clip="clip é",
        frame_period_s=0.01,
        exposure_s=0.01,
        row_time_s=-1e-5,
        clock_offset_ppm=ppm,
        phase_error_rows=0.06,
        order="guess",
        flashes=flashes,
        dropped_frames=(DroppedFrames(after=116, count=2),),
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "timing.json"
        write_text(path, format_timing(timing))
        assert read_timing(path) == timing


@pytest.mark.parametrize("text", ["", "[]", '{"schema": "psvideo-timing/1"}', '{"schema": "psvideo-plan/1"}', "{"])
def test_a_broken_timing_file_is_reported_with_what_to_do(text: str, tmp_path: Path) -> None:
    path = tmp_path / "timing.json"
    path.write_text(text)
    with pytest.raises(PsvideoError, match=str(path)):
        read_timing(path)


def test_an_output_that_exists_is_refused_unless_forced(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    write_text(path, "x")
    with pytest.raises(PsvideoError, match="exists already"):
        refuse_existing(path, force=False)
    refuse_existing(path, force=True)
    assert [p.name for p in tmp_path.iterdir()] == ["plan.toml"]


def test_an_output_below_a_file_is_refused_before_any_work(tmp_path: Path) -> None:
    file = tmp_path / "take"
    file.write_text("x")
    for out in (file / "timing.json", file / "results" / "timing.json"):
        with pytest.raises(UsageError, match="cannot be written, as"):
            refuse_existing(out, force=True)


def test_an_output_that_cannot_be_written_is_refused_before_any_work(tmp_path: Path) -> None:
    """A name that is too long cannot be written by any account, as a folder that is only read cannot by most."""
    with pytest.raises(PsvideoError, match="cannot be written"):
        refuse_existing(tmp_path / f"{'long' * 60}.toml", force=True)
    refuse_existing(tmp_path / "new" / "rig.toml", force=False)
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    with pytest.raises(PsvideoError, match="cannot be written"):
        write_text(blocked / "plan.toml", "x")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_exact_frame_rates_survive(make_plan: Callable[..., Plan]) -> None:
    assert parse_plan(format_plan(make_plan(fps=Fraction(24000, 1001)))).camera.fps == Fraction(24000, 1001)


@pytest.mark.parametrize("fps", [0, -24, 1_000_001, "1e9"])
def test_a_frame_rate_is_refused_with_both_its_bounds(fps: float | str) -> None:
    with pytest.raises(ValueError, match="above 0, and at most 1,000,000"):
        parse_fps(fps)
