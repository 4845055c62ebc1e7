"""Results in one file, and several side by side, in a real browser: they are shown and relit as on the server."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import page_folder as small
import pytest
from watched_page import KEY, Watched, albedo, lambert, light, relit_in, settled, shown

from psvideo.errors import UsageError
from psvideo.inspect.describe import describe
from psvideo.page import page_server, show_of, side_by_side, write_single_page


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small.results(tmp_path_factory.mktemp("page") / "out")


def test_one_file_opens_by_itself_and_relights_alike(folder: Path, tmp_path: Path, watched: Watched) -> None:
    page_file = tmp_path / "page.html"
    held = write_single_page(show_of(folder), page_file, width_px=640, count=3)
    assert (held.pictures, held.missing, held.width_px) == (12, 0, small.COLS)
    assert held.total_bytes == page_file.stat().st_size
    text = page_file.read_text()
    assert str(tmp_path) not in text
    assert str(folder) not in text
    page = watched.open(page_file.as_uri())
    found = relit_in(page, lights=[light(KEY)])
    assert np.abs(found - albedo() * lambert(KEY)).max() <= 1e-3
    page.keyboard.press("End")
    shown(page, 1006)
    page.keyboard.press("t")
    page.wait_for_selector("#timing-facts dt")
    assert [url for url in watched.asked if not url.startswith("data:")] == [page_file.as_uri()]


@pytest.mark.parametrize("in_one_file", [False, True])
def test_results_side_by_side_are_each_relit_as_they_are_under_the_same_light(
    in_one_file: bool, folder: Path, tmp_path: Path, watched: Watched
) -> None:
    other = small.results(tmp_path / "other", y="down", world=True)
    for file in other.glob("albedo/*.exr"):
        small.write(file, small.rgb(np.full((small.ROWS, small.COLS, 3), 0.25)), int(file.stem[-4:]))
    show = side_by_side([show_of(folder), show_of(other)], [folder, other])
    assert [one.group for one in show.sequences] == ["out"] * 4 + ["other"] * 4
    with page_server(show, port=0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        write_single_page(show, tmp_path / "page.html", width_px=640, count=3)
        page = watched.open((tmp_path / "page.html").as_uri() if in_one_file else server.url)
        assert page.evaluate("() => psvideo.panes()") == ["relit", "r2.relit"]
        assert np.abs(relit_in(page, lights=[light(KEY)]) - albedo() * lambert(KEY)).max() <= 1e-3
        found = page.evaluate("() => Array.from(psvideo.relitValues('r2.relit').values)")
        second = np.array(found).reshape(small.ROWS, small.COLS, 4)[..., :3]
        assert np.abs(second - 0.25 * lambert(KEY)).max() <= 1e-3
        settled(page)
        assert page.locator(".caption").all_inner_texts() == ["out · 1001", "other · 1001 · world space · y down"]
        server.shutdown()
        thread.join()


@pytest.mark.parametrize(
    ("fps", "place", "rate"),
    [(0.0, "1 of 6 pictures", ""), (1 / 12, "1 of 6 pictures", ""), (24.0, "0.100 s", "24.00 fps")],
)
def test_results_of_photographs_are_counted_and_have_no_time(
    fps: float, place: str, rate: str, folder: Path, tmp_path: Path, watched: Watched
) -> None:
    write_single_page(replace(show_of(folder), fps=fps), tmp_path / "page.html", width_px=64, count=small.COUNT)
    page = watched.open((tmp_path / "page.html").as_uri())
    assert [page.locator(f"#{name}").inner_text() for name in ("clock", "rate")] == [place, rate]
    page.keyboard.press("Space")
    page.wait_for_function("() => psvideo.state.at > 0")


def test_what_stills_wrote_is_of_photographs_whatever_rate_its_files_name_for_other_programs(tmp_path: Path) -> None:
    made = small.results(tmp_path / "out")
    filmed = show_of(made)
    assert (round(filmed.fps, 2), filmed.timing is None) == (29.97, False)
    (made / "setup").mkdir()
    (made / "setup" / "plan.toml").write_text("")
    photographed = show_of(made)
    assert (photographed.fps, photographed.timing is None) == (0, True)
    assert not [finding.text for finding in describe(made).findings if "results a second" in finding.text]


def test_what_cannot_stand_side_by_side_is_named(folder: Path, tmp_path: Path) -> None:
    one = show_of(folder)
    with pytest.raises(UsageError, match=r"wide: its pictures are 128 x 48 pixels"):
        side_by_side([one, replace(one, width_px=128)], [folder, tmp_path / "wide"])
    with pytest.raises(UsageError, match=r"plates: holds no results"):
        side_by_side([one, replace(one, kind="plates")], [folder, tmp_path / "plates"])
    later = replace(one, sequences=tuple(replace(s, numbers=tuple(n + 7 for n in s.numbers)) for s in one.sequences))
    both = side_by_side([one, later], [tmp_path / "a" / "out", tmp_path / "b" / "out"])
    assert {s.timeline for s in both.sequences} == {"rounds", "r2.rounds"}, "then by time"
    assert both.name == "a/out | b/out"


WITHOUT_WEBGL2 = """
const open = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind === "webgl2" ? null : open.call(this, kind, ...rest);
};"""
