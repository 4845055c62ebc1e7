"""The timing diagram shows the rows that each frame saw, in every format and every kind of shoot."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest

from psvideo.capture.drawing.diagram import check_diagram_name, diagram_text, write_diagram
from psvideo.capture.drawing.diagram_shapes import HEIGHT, LIGHT_COLOURS, WIDTH, timing_diagram
from psvideo.capture.drawing.draw_png import png
from psvideo.capture.drawing.draw_svg import svg
from psvideo.capture.drawing.shapes import Label, Polygon
from psvideo.capture.drawing.timeline import timeline
from psvideo.errors import UsageError
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import row_weights

MakePlan = Callable[..., Plan]
CASES: dict[str, dict[str, object]] = {
    "three lights": {},
    "rare dark slots": {"dark_every": 5},
    "no dark slot": {"dark": False},
    "short readout": {"readout": 0.4},
    "global shutter": {"readout": 0.0},
    "180 degrees": {"shutter": 0.5},
    "bottom row first": {"readout": -0.9},
    "half rate": {"mode": "half-rate"},
    "triggered": {"mode": "synced", "readout": 0.0},
    "eight lights": {"lights": tuple("abcdefgh")},
    "one light": {"lights": ("key",), "dark": False},
    "a long flash": {"duration_s": 0.004},
}


@pytest.fixture(params=CASES, ids=lambda name: name)
def plan(request: pytest.FixtureRequest, make_plan: MakePlan) -> Plan:
    return make_plan(**CASES[request.param])


def test_the_rows_drawn_for_a_flash_are_those_whose_weights_say_so(plan: Plan) -> None:
    phase_s = 0.0021
    line = timeline(plan, phase_s=phase_s)
    starts_s = np.array([flash.start_s for flash in line.flashes])
    durations_s = np.array([flash.end_s - flash.start_s for flash in line.flashes])
    frames = range(line.frames[0].index, line.frames[-1].index + 1)
    truth = row_weights(plan.camera, starts_s, durations_s, frames=frames)
    drawn = np.zeros_like(truth)
    rows = np.arange(plan.camera.height_px)
    for at, frame in enumerate(line.frames):
        for span in frame.spans:
            inside = (rows >= span.from_row - 1e-9) & (rows <= span.to_row + 1e-9)
            shares = np.interp(rows, [span.from_row, span.to_row], [span.from_share, span.to_share])
            drawn[span.flash, at] = np.maximum(drawn[span.flash, at], np.where(inside, shares, 0))
    lit = np.array([flash.place >= 0 for flash in line.flashes])
    one_row = abs(plan.camera.row_time_s) / durations_s.min() + 1e-9
    np.testing.assert_allclose(drawn[lit], truth[lit], atol=one_row)
    assert not drawn[~lit].any()


def test_frames_tile_time_at_360_degrees_and_cover_a_round(plan: Plan) -> None:
    line = timeline(plan)
    for frame, following in pairwise(line.frames):
        assert following.top_s - frame.top_s == pytest.approx(plan.camera.frame_period_s)
        assert following.bottom_s - frame.bottom_s == pytest.approx(plan.camera.frame_period_s)
    assert {flash.label for flash in line.flashes if flash.end_s > 0} >= set(plan.lights[:6])


def test_dark_rows_lie_where_the_light_of_two_flashes_fades(make_plan: MakePlan) -> None:
    plan = make_plan(dark=False, height_px=1000)
    line = timeline(plan, phase_s=0.003)
    for frame in line.frames:
        for row in frame.dark_rows:
            shares = [
                np.interp(row, [span.from_row, span.to_row], [span.from_share, span.to_share])
                for span in frame.spans
                if span.from_row <= row <= span.to_row
            ]
            assert max(shares, default=0.0) < 0.01
    assert sum(len(frame.dark_rows) for frame in line.frames) >= 2


def test_the_svg_is_xml_with_a_band_for_each_light_and_named_axes(plan: Plan) -> None:
    root = ElementTree.fromstring(svg(timing_diagram(plan)))
    texts = [element.text for element in root.iter("{http://www.w3.org/2000/svg}text")]
    assert "row" in texts
    assert "time on the camera's clock (ms)" in texts
    assert {"frame 0", "0", str(plan.camera.height_px - 1)} <= set(texts)
    fills = {element.get("fill") for element in root.iter("{http://www.w3.org/2000/svg}polygon")}
    assert {LIGHT_COLOURS[place] for place in range(min(len(plan.lights), 7))} <= fills


def test_names_with_signs_of_xml_do_not_break_the_svg(make_plan: MakePlan) -> None:
    plan = make_plan(lights=("a<b&c", '"q"'))
    texts = {element.text for element in ElementTree.fromstring(svg(timing_diagram(plan))).iter()}
    assert any("a<b&c" in text for text in texts if text), texts


def test_nothing_is_drawn_outside_the_picture(plan: Plan) -> None:
    picture = timing_diagram(plan)
    for shape in picture.shapes:
        points = shape.points if isinstance(shape, Polygon) else (shape.at,)
        assert all(-0.5 <= x <= WIDTH + 0.5 and -0.5 <= y <= HEIGHT + 0.5 for x, y in points), shape
    labels = [shape for shape in picture.shapes if isinstance(shape, Label) and shape.anchor == "start"]
    assert all(label.at[0] + 0.62 * label.size * len(label.text) < WIDTH for label in labels)


def test_the_png_is_a_picture_in_the_lights_colours(plan: Plan) -> None:
    image = cv2.imdecode(np.frombuffer(png(timing_diagram(plan)), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert image.shape == (2 * HEIGHT, 2 * WIDTH, 3)
    key = np.array([int(LIGHT_COLOURS[0][at : at + 2], 16) for at in (5, 3, 1)])
    assert np.count_nonzero(np.all(np.abs(image.astype(int) - key) < 3, axis=-1)) > 500


@pytest.mark.parametrize("width", [60, 80, 120])
def test_the_terminal_s_text_fits_and_needs_no_colour(plan: Plan, width: int) -> None:
    text = diagram_text(plan, width=width).plain
    lines = text.splitlines()
    assert max(map(len, lines[:15])) < width
    assert "1" in lines[0]
    assert all(name in text for name in plan.lights)


def test_text_marks_the_dark_row_partial_rows_and_the_dark_slot(make_plan: MakePlan) -> None:
    text = diagram_text(make_plan()).plain
    for mark in ("━", ":", "┊", "░", "▒"):
        assert mark in "".join(text.splitlines()[:14])
    assert " " * 6 in diagram_text(make_plan(shutter=0.4, dark=False)).plain.splitlines()[0]


def test_a_diagram_is_written_by_the_name_that_is_given(make_plan: MakePlan, tmp_path: Path) -> None:
    for name, begins in (("a.svg", b"<svg"), ("b.PNG", b"\x89PNG")):
        write_diagram(make_plan(), tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(begins)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.svg", "b.PNG"]
    assert check_diagram_name("-") is None
    for name in ("a.pdf", "a", ""):
        with pytest.raises(UsageError, match="`diagram`"):
            check_diagram_name(name)


def test_a_triggered_flash_lies_in_its_frame_however_long_the_others_are(make_plan: MakePlan) -> None:
    plan = make_plan(mode="synced", readout=0.0, dark=False)
    unequal = tuple(
        replace(flash, duration_s=length_s) for flash, length_s in zip(plan.flashes, (1e-3, 4e-3, 2e-3), strict=True)
    )
    line = timeline(replace(plan, flashes=unequal))
    for frame in line.frames:
        assert len(frame.spans) == 1
        assert frame.spans[0].from_share == pytest.approx(1)
