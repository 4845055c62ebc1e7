"""What goes wrong on a set while it runs: streams that stall, begin again or leap; viewers that come, go and dawdle."""

import json
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from memory_frame import MemoryFrame

from psvideo.live.chain import Chain
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.showing.newest_pictures import NewestPictures
from psvideo.live.showing.page_server import LivePage, live_page
from psvideo.model.plan import Plan
from psvideo.synth import Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]
BEFORE, AFTER = 75, 90
"""Frames before a stall, and behind it: within a second at 100 frames a second it is followed again."""


@pytest.mark.parametrize(
    ("missing", "numbered"),
    [(200, 200), (37, 37), (37, 36), (3, 0)],
    ids=["stalled for two seconds", "leapt", "began again, a frame off", "lost frames without a word"],
)
def test_a_stream_that_stalls_leaps_or_begins_again_is_followed_on(
    make_plan: PlanMaker, missing: int, numbered: int
) -> None:
    plan = make_plan()
    rng = np.random.default_rng(3)
    shape = plan.camera.height_px, plan.camera.width_px
    shot = expose(
        {slot: (0.05 + 0.3 * rng.random(shape)).astype(np.float32) for slot in plan.lit_slots},
        plan,
        frames=BEFORE + missing + AFTER,
        clock=TrueClock(phase_s=0.0123, offset_ppm=30.0),
        noise=Noise(full_well_e=20_000, read_e=8),
        bits=12,
        dropped=range(BEFORE, BEFORE + missing),
    )
    chain = Chain(plan=plan)
    places = [*range(BEFORE), *range(BEFORE + numbered, BEFORE + numbered + AFTER)]
    for place, image in zip(places, shot.frames, strict=True):
        chain.take(LiveFrame(index=place, coded=MemoryFrame(place, image).coded, came_s=0.0))
        chain.solve()
        assert place < BEFORE - 1 or chain.follower is not None
    assert chain.state == "locked"
    assert chain.follower is not None
    assert abs(chain.follower.clock.offset_ppm - 30) < 5
    assert chain.lost_frames == missing or len(chain.followed) > 1


@pytest.fixture
def page() -> Iterator[LivePage]:
    served = live_page(NewestPictures(), dict, port=0)
    yield served
    served.close()


def connected(page: LivePage) -> Any:
    from websockets.sync.client import connect

    return connect(page.url.replace("http", "ws") + "newest")


def test_viewers_that_leave_without_a_word_are_forgotten(page: LivePage) -> None:
    for _ in range(5):
        with connected(page) as gone:
            gone.send(json.dumps({"seen": 1, "plate": ""}))
            gone.socket.shutdown(socket.SHUT_RDWR)  # as a laptop that is shut
    with connected(page) as stays:
        stays.send("nonsense")
        assert json.loads(stays.recv(timeout=30))["pictures"] == 0
        end_s = time.monotonic() + 30
        while page.viewers > 1 and time.monotonic() < end_s:
            time.sleep(0.02)
        assert page.viewers == 1
