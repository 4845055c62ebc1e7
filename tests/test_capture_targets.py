"""The pages to print are what their script draws, to scale, and the example of the recipe is right."""

import csv
import re
import runpy
from pathlib import Path
from xml.etree import ElementTree

import pytest

from psvideo.capture.drawing.draw_svg import svg

CALIBRATION = Path(__file__).resolve().parents[1] / "calibration"
SCRIPT = runpy.run_path(str(CALIBRATION / "make_targets.py"))


@pytest.mark.parametrize("paper", ["a4", "letter"])
def test_a_page_is_what_the_script_draws_and_its_marks_are_to_scale(paper: str) -> None:
    text = (CALIBRATION / "targets" / f"sphere_and_chart_{paper}.svg").read_text(encoding="utf-8")
    width_mm, height_mm = SCRIPT["PAPERS_MM"][paper]
    assert text == svg(SCRIPT["page"](width_mm, height_mm), unit="mm")
    root = ElementTree.fromstring(text)
    assert (root.get("width"), root.get("height")) == (f"{width_mm:g}mm", f"{height_mm:g}mm")
    crosses = [line.get("points", "") for line in root.iter("{http://www.w3.org/2000/svg}polyline")][:8]
    xs = sorted({sum(float(pair.split(",")[0]) for pair in points.split()) / 2 for points in crosses})
    ys = sorted({sum(float(pair.split(",")[1]) for pair in points.split()) / 2 for points in crosses})
    assert xs[-1] - xs[0] == pytest.approx(160)
    assert ys[-1] - ys[0] == pytest.approx(220)
    assert "print at 100 %" in text


def test_the_recipe_s_example_gives_the_recorded_readout() -> None:
    text = (CALIBRATION / "README.md").read_text(encoding="utf-8")
    example = re.search(r"1080 / ([\d.]+) / 1000 Hz = ([\d.]+) ms", text)
    assert example is not None
    assert 1080 / float(example[1]) == pytest.approx(float(example[2]), abs=0.005)
    with (CALIBRATION / "records" / "readout.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        readout_ms = float(row["height_px"]) / float(row["rows_per_period"]) / float(row["led_hz"]) * 1e3
        assert readout_ms == pytest.approx(float(row["readout_ms"]), rel=1e-3)
    assert all(column in text for column in rows[0])
