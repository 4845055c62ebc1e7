"""The live page: who may see it, what a viewer gets and when, and in a browser the surface as it was solved."""

import json
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from live_clip import live_clip
from live_standing import standing

import psvideo as ps
from psvideo.errors import UsageError
from psvideo.live.showing import newest_pictures
from psvideo.live.showing.newest_pictures import NewestPictures, lit_rows
from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.showing.page_server import LivePage, live_page
from psvideo.live.showing.smaller import smaller_plan
from psvideo.live.status import LiveState, LiveStatus
from psvideo.live.watching import ENOUGH, LOOK_S, STARVED, Watching, told
from psvideo.model.camera import Camera
from psvideo.model.timing import timed_camera
from psvideo.page.picture import PagePicture
from psvideo.runs.live import live

if TYPE_CHECKING:
    from playwright.sync_api import Page, Playwright

Served = tuple[LivePage, NewestPictures, list[NewestRound], Camera, Path]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A page with the first result of a clip, and all its results."""
    clip = live_clip(tmp_path_factory.mktemp("live"))
    results: list[NewestRound] = []
    live(clip, rig=clip / "rig.toml", pace="fastest", shown=results.append)
    plan = ps.open_take(clip).plan
    camera = timed_camera(smaller_plan(plan, results[0].step), results[0].timing)
    watching, pictures = Watching(plan=plan), NewestPictures()
    for newest in (*results, *results):
        watching.look(newest, plan)
    pictures.put(results[0], camera)
    page = live_page(pictures, lambda: told(None, watching), port=0)
    yield page, pictures, results, camera, clip
    page.close()


def status_of(*, fps: float, frames: int, state: LiveState = "locked") -> LiveStatus:
    stands = standing(at_s=9.0, state=state, fps=fps, frames=frames)
    return replace(stands, results=9, recorded=18, record_ended=frames > 100)


def test_a_page_says_in_large_type_that_no_frames_come_and_that_recording_ended(served: Served) -> None:
    """Not that the take is usable: what it shows then is old."""
    watching = Watching(plan=ps.open_take(served[4]).plan)
    assert told(status_of(fps=0.0, frames=99), watching)["state"] == "silent"
    assert told(status_of(fps=50.0, frames=99), watching)["state"] == "locked"
    assert told(status_of(fps=0.0, frames=0, state="seeking"), watching)["state"] == "seeking"
    assert told(status_of(fps=50.0, frames=99), watching)["alarm"] == ""
    assert told(status_of(fps=50.0, frames=101), watching)["alarm"] == "Recording ended"


def test_a_port_that_is_taken_is_named_with_the_systems_own_words_alone(served: Served) -> None:
    taken = int(served[0].url.rsplit(":", 1)[1].strip("/"))
    with pytest.raises(UsageError, match=rf"`port` {taken}: cannot be used on 127\.0\.0\.1 \(Address already in use\)"):
        live_page(NewestPictures(), dict, port=taken)
    with pytest.raises(UsageError, match="ports run from 0 to 65535"):
        live_page(NewestPictures(), dict, port=99999)


def connected(url: str, **options: Any) -> Any:
    from websockets.sync.client import connect

    address, _, query = url.replace("http", "ws").partition("?")
    return connect(f"{address}newest{'?' if query else ''}{query}", **options)


Pictures = dict[str, tuple[dict[str, Any], np.ndarray]]


def asked(viewer: Any, seen: int, plate: str = "left") -> tuple[dict[str, Any], Pictures]:
    """Ask for what is newer than what was seen; return what is told, and the pictures by name, with their facts."""
    viewer.send(json.dumps({"seen": seen, "plate": plate}))
    status = json.loads(viewer.recv(timeout=10))
    pictures = {}
    for _ in range(status["pictures"]):
        block = viewer.recv(timeout=10)
        length = int.from_bytes(block[4:8], "little")
        facts = json.loads(block[8 : 8 + length])
        pixels = np.frombuffer(block, np.float16, offset=8 + length)
        pictures[facts["id"]] = facts, pixels.reshape(facts["height"], facts["width"], facts["channels"])
    return status, pictures


def fetched(url: str, **headers: str) -> tuple[int, bytes]:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=10) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as fault:
        return fault.code, fault.read()


def test_a_viewer_gets_the_newest_and_not_what_came_between(served: Served) -> None:
    page, pictures, results, camera, _ = served
    with connected(page.url) as viewer:
        first, shown = asked(viewer, 0)
        assert results[0].surface is not None
        assert np.abs(shown["normals"][1] - results[0].surface.normals).max() < 1e-3
        assert shown["plate"][0]["light"] == "left"
        assert [line["subject"] for line in first["lines"]][:2] == ["timing", "order"]
        assert sum(first["histograms"]["key"]) > 1000
        for newest in results[1:4]:
            pictures.put(newest, camera)
        later, shown = asked(viewer, first["number"])
        assert later["number"] == first["number"] + 3
        assert results[3].surface is not None
        assert np.abs(shown["normals"][1] - results[3].surface.normals).max() < 1e-3
        assert asked(viewer, later["number"])[1] == {}, "what was seen is not sent again"


def test_what_a_round_shows_is_looked_at_little_by_little_and_comes_to_the_same(served: Served) -> None:
    results, plan = served[2], ps.open_take(served[4]).plan
    at_once, by_steps = Watching(plan=plan), Watching(plan=plan)
    for newest in (*results, *results):
        at_once.look(newest, plan)
    steps = 0
    for newest in (*results, *results):
        by_steps.look(newest, plan, until_s=0.0)
        while by_steps.busy:
            steps += 1
            by_steps.look(results[-1], plan, until_s=0.0)  # which is newer, and not looked at before the other is done
    assert steps > 3 * ENOUGH * (1 + STARVED), "there was never time: each step waits for that many results"
    assert by_steps.lines == at_once.lines
    assert by_steps.histograms == at_once.histograms
    assert by_steps.powers == at_once.powers


def test_a_round_is_looked_at_where_there_is_time_for_what_a_step_took(served: Served) -> None:
    results, plan = served[2], ps.open_take(served[4]).plan
    watching = Watching(plan=plan)
    watching.look(results[0], plan)
    assert not watching.busy, "there is no hurry"
    later = next(one for one in results if one.round.time_s - results[0].round.time_s > LOOK_S)
    watching.look(later, plan, until_s=time.monotonic() + 60)
    assert not watching.busy, "a minute is enough for all steps"
    watching._took_s = dict.fromkeys(watching._took_s, 60.0)
    watching.look(results[0], plan, until_s=time.monotonic() + 30)
    assert watching._place == 0, "half a minute is too little for a step that took one"
    assert watching.busy


def test_what_viewers_asked_for_is_packed_before_the_next_result_is_shown(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    results, camera = served[2], served[3]
    pictures, packed = NewestPictures(), list[str]()

    def block(picture: PagePicture) -> bytes:
        packed.append(str(picture.facts["id"]))
        return b""

    monkeypatch.setattr(newest_pictures, "picture_block", block)
    pictures.put(results[0], camera)
    assert not packed, "nobody looks"
    pictures.packed("left")
    whole = ["normals", "albedo", "plate", "frame"]
    assert packed == whole
    pictures.put(results[1], camera)
    assert packed == 2 * whole
    assert pictures.packed("left")[0] == 2
    assert packed == 2 * whole, "the viewer waits for nothing"
    pictures.put(results[2], camera)
    pictures.put(results[3], camera)
    assert packed == 3 * whole, "a viewer who is slower than results is not packed for twice"


def test_two_viewers_and_one_that_comes_and_goes(served: Served) -> None:
    page, pictures, results, camera, _ = served
    with connected(page.url) as one, connected(page.url) as two:
        number = asked(one, 0)[0]["number"]
        assert asked(two, 0, "top")[1]["plate"][0]["light"] == "top"
        later = threading.Timer(0.2, lambda: pictures.put(results[5], camera))
        later.start()
        with connected(page.url) as gone:
            gone.send(json.dumps({"seen": number, "plate": ""}))
        assert asked(one, number)[0]["number"] == number + 1, "who waits gets the next as it comes"
        assert asked(two, number)[0]["number"] == number + 1


@pytest.mark.parametrize("odd", ['{"seen": Infinity, "plate": ""}', "[]", "nothing", "{}"])
def test_an_odd_request_is_answered_as_one_that_has_seen_nothing(odd: str, served: Served) -> None:
    page, pictures, results, camera, _ = served
    pictures.put(results[0], camera)
    with connected(page.url) as viewer:
        viewer.send(odd)
        assert json.loads(viewer.recv(timeout=10))["pictures"] > 0
        assert page.viewers == 1


def test_only_this_machine_sees_it_without_a_token(served: Served) -> None:
    page = served[0]
    assert fetched(page.url)[0] == 200
    assert fetched(page.url, Host="evil.example:80")[0] == 403
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus), connected(page.url, origin="http://evil.example"):
        pass


def test_another_host_needs_the_token() -> None:
    page = live_page(NewestPictures(), dict, host="0.0.0.0", port=0)
    try:
        here = page.url.replace("0.0.0.0", "127.0.0.1")
        assert fetched(here)[0] == 200
        status, sentence = fetched(here.partition("?")[0])
        assert status == 403
        assert b"open the address that psvideo live printed" in sentence
        assert fetched(f"{here.partition('?')[0]}?token=guess")[0] == 403
    finally:
        page.close()


@pytest.mark.parametrize("token", ["a+b c", "schl\u00fcssel", "50%&x=1#?/"])
def test_the_address_that_is_printed_opens_the_page_whatever_the_token_holds(token: str) -> None:
    page = live_page(NewestPictures(), dict, host="0.0.0.0", port=0, token=token)
    try:
        assert fetched(page.url.replace("0.0.0.0", "127.0.0.1"))[0] == 200
    finally:
        page.close()


def test_a_port_that_is_taken_is_named(served: Served) -> None:
    port = int(served[0].url.rstrip("/").rpartition(":")[2])
    with pytest.raises(UsageError, match=f"`port` {port}: cannot be used"):
        live_page(NewestPictures(), dict, port=port)


def test_the_frame_is_marked_where_lights_and_the_dark_row_are(served: Served) -> None:
    _, _, results, camera, _ = served
    for newest in results[2:6]:
        rows = lit_rows(newest, camera)
        assert (rows[0][0], rows[-1][1]) == (0, camera.height_px)
        assert all(before[1] == after[0] for before, after in pairwise(rows))
        frame = newest.frame.light()
        for first, last, name in rows:
            inside = frame[max(first + 4, 24) : min(last - 4, 48)]  # rows that the sphere crosses
            if inside.size:
                assert (float(inside.max()) > 0.1) == bool(name)


SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="module")
def browsing(served: Served, playwright: "Playwright", chromium: str) -> "Iterator[Page]":
    """The live page with a picture, in a browser that draws by software."""
    page, pictures, results, camera, _ = served
    pictures.put(results[-1], camera)
    browser = playwright.chromium.launch(executable_path=chromium, args=SOFTWARE)
    tab = browser.new_page(viewport={"width": 640, "height": 400})
    tab.goto(page.url)
    tab.wait_for_selector("body[data-drawn]", timeout=20_000)
    yield tab
    browser.close()


def test_the_browser_relights_the_surface_that_was_solved(
    served: Served, playwright: "Playwright", chromium: str
) -> None:
    page, pictures, results, camera, _ = served
    newest = results[-1]
    pictures.put(newest, camera)
    browser = playwright.chromium.launch(executable_path=chromium, args=SOFTWARE)
    try:
        tab = browser.new_page(viewport={"width": 640, "height": 400})
        tab.goto(page.url)
        tab.wait_for_selector("body[data-drawn]", timeout=20_000)
        found = tab.evaluate("Array.from(psvideoLive.relit().values)")
        assert tab.locator("#state").inner_text()
        assert tab.locator("#lines li").count() >= 8
    finally:
        browser.close()
    assert newest.surface is not None
    normals, albedo = newest.surface.normals, newest.surface.albedo
    direction = np.array([0.45, 0.5, np.sqrt(1 - 0.45**2 - 0.5**2)])
    expected = albedo * np.maximum(normals @ direction, 0)[..., None]
    relit = np.reshape(found, (*normals.shape[:2], 4))[..., :3]
    assert np.abs(relit - expected).max() < 2e-3


@pytest.mark.parametrize(
    ("share", "took_ms", "expected"),
    [
        (1, [20.0] * 5, 0.8),
        (0.8, [20.0] * 5, 0.6),
        (0.6, [20.0] * 5, 0.6),
        (1, [20.0] * 4, 1),  # too few to say
        (1, [2.0, 2.0, 2.0, 90.0, 90.0], 1),  # two of five are anybody's
        (0.6, [3.0] * 5, 0.6),  # at 0.8 they would take 5.3 ms
        (0.6, [1.0] * 5, 0.8),
        (0.8, [1.0] * 5, 1),
        (1, [1.0] * 5, 1),
    ],
)
def test_how_many_pixels_are_drawn_follows_from_what_drawing_takes(
    browsing: "Page", share: float, took_ms: list[float], expected: float
) -> None:
    assert browsing.evaluate("([share, took]) => psvideoLive.shareAfter(share, took)", [share, took_ms]) == expected


def test_where_software_draws_slowly_fewer_pixels_are_drawn_and_they_fill_the_page(
    served: Served, browsing: "Page"
) -> None:
    _, pictures, results, camera, _ = served
    browsing.set_viewport_size({"width": 2400, "height": 1600})  # more than software draws in 8 ms
    box = "document.getElementById('picture').getBoundingClientRect().width"
    width = browsing.evaluate(box)
    until_s = time.monotonic() + 60
    while abs((drawn := browsing.evaluate("document.getElementById('picture').width")) - 0.6 * width) > 1:
        assert time.monotonic() < until_s, f"{drawn} of {width} pixels are drawn"
        pictures.put(results[-1], camera)
        time.sleep(0.02)
    assert browsing.evaluate(box) == width
    labels = browsing.evaluate(
        "[...document.querySelectorAll('#labels span')].map((one) => parseFloat(one.style.left))"
    )
    assert max(labels) > 0.5 * width, "names stand at their panes, wherever these are drawn"
