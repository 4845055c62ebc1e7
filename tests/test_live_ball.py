"""Calibrating live: a chrome ball in the picture, one click, and the lights are known; and what to set powers to."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from bench.mirror_scene import Ball, Lamp, Lens, photograph, unit

from psvideo.live.ball_lights import BallLights, lights_on_ball
from psvideo.live.showing.newest_pictures import NewestPictures
from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.showing.page_server import LivePage, live_page
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.report.judge.powers import power_words
from psvideo.report.observe.levels import count_levels
from psvideo.report.observe.observed import Observed

DIRECTIONS = {"key": (0.5, 0.4, 0.77), "left": (-0.6, 0.2, 0.77), "top": (0.05, 0.7, 0.7)}
LENS = Lens(width=240, height=160, focal=400.0)


def newest(balls: list[Ball]) -> NewestRound:
    """A round of live pictures half as large as the camera's."""
    pictures = [
        photograph(LENS, balls, [Lamp(direction=at, size_deg=2.0)], noise=0.002, seed=n)
        for n, at in enumerate(DIRECTIONS.values())
    ]
    plates = [
        SimpleNamespace(image=picture, saturation=1.0, pixels_seen=np.ones(picture.shape, np.bool_))
        for picture in pictures
    ]
    one = SimpleNamespace(lights=tuple(DIRECTIONS), plates=plates, ambient=None)
    return cast(NewestRound, SimpleNamespace(round=one, step=2))


def lens_rig() -> Rig:
    lights = tuple(Light(name=name, direction=(0.0, 0.0, 1.0)) for name in DIRECTIONS)
    return Rig(lights=lights, focal_px=(2 * LENS.focal, 2 * LENS.focal))


NUMBER = r"\d+\.?\d*"
BALL = Ball(centre=(0.02, 0.01, -0.5))


def test_a_click_finds_the_lights_on_a_ball_and_keeps_the_cameras_lens() -> None:
    found: list[Rig] = []

    ball = BallLights(rig=lens_rig(), found=kept_in(found))
    ball.look(newest([BALL]))
    assert not found, "nobody asked"
    ball.calibrate(newest([BALL]))
    assert found[0].focal_px == (800.0, 800.0)
    for light in found[0].lights:
        assert light.direction is not None
        cosine = unit(np.array(light.direction)) @ unit(np.array(DIRECTIONS[light.name]))
        assert np.degrees(np.arccos(min(cosine, 1.0))) < 1.0
    assert ball.words[0] == "kept"
    assert len([words for words in ball.words if "degrees" in words]) >= 3


def kept_in(found: list[Rig]) -> Callable[[Rig], str]:
    def keep(rig: Rig) -> str:
        found.append(rig)
        return "kept"

    return keep


def strong_rig() -> Rig:
    """The lens and lights that were measured: of these, one is coloured and was measured for another time."""
    named = lens_rig()
    key, left, top = named.lights
    key = replace(key, intensity=(1.0, 0.9, 0.8), reference_duration_s=0.002)
    left, top = replace(left, intensity=(0.5,)), replace(top, intensity=(0.25,), colour=(1.0, 0.1, 0.05))
    return replace(named, lights=(top, key, left))


def test_a_ball_shows_directions_and_what_a_named_rig_knows_beside_them_is_kept() -> None:
    found: list[Rig] = []
    ball = BallLights(rig=strong_rig(), found=kept_in(found))
    for _ in range(2):
        ball.calibrate(newest([BALL]))
        known = {light.name: light for light in strong_rig().lights}
        assert len(found[-1].lights) == len(known)
        for light in found[-1].lights:
            assert light.direction != known[light.name].direction
            measured = replace(light, direction=known[light.name].direction, error_deg=None)
            assert measured == known[light.name]
        assert not any("equally strong" in words for words in ball.words)


@pytest.mark.parametrize("named", [None, "near"])
def test_strengths_that_nobody_measured_are_said_to_be_taken_as_equal(named: str | None) -> None:
    found: list[Rig] = []
    rig = None if named is None else strong_rig()
    if rig is not None:
        near = replace(rig.lights[0], direction=None, position_m=(0.5, 0.2, 0.1))
        rig = replace(rig, lights=(near, *rig.lights[1:]))
    ball = BallLights(rig=rig, found=kept_in(found))
    for _ in range(2):
        ball.calibrate(newest([BALL]))
        assert {light.intensity for light in found[-1].lights} == {(1.0,)}
        assert "equally strong" in ball.words[1]
        assert ("no strength of top" if named else "no `rig` is named") in ball.words[1]


def test_whatever_goes_wrong_with_a_ball_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> object:
        raise ZeroDivisionError("by nothing")

    ball = BallLights(rig=None, found=lambda rig: "kept")
    ball.ask()
    monkeypatch.setattr("psvideo.live.ball_lights.lights_on_ball", broken)
    ball.calibrate(newest([BALL]))
    assert len(ball.words) == 1
    assert "nothing was changed: ZeroDivisionError('by nothing')" in ball.words[0]


def test_a_picture_without_a_ball_is_a_sentence_and_changes_nothing() -> None:
    def kept(rig: Rig) -> str:
        raise AssertionError(rig)

    ball = BallLights(rig=None, found=kept)
    ball.calibrate(newest([]))
    assert len(ball.words) == 2
    assert "no sphere" in ball.words[0]
    assert "options of psvideo calibrate mirror-sphere" in ball.words[1], "live has no `circle`"


def test_without_a_lens_directions_are_found_and_the_doubt_is_said() -> None:
    measured = lights_on_ball(newest([BALL]), None)
    assert measured.rig.focal_px is None
    assert [light.name for light in measured.rig.lights] == list(DIRECTIONS)


@pytest.fixture
def page() -> Iterator[tuple[LivePage, list[str]]]:
    clicks: list[str] = []
    served = live_page(NewestPictures(), dict, port=0, ball=lambda: clicks.append("ball"))
    yield served, clicks
    served.close()


def test_a_viewers_click_arrives(page: tuple[LivePage, list[str]]) -> None:
    from websockets.sync.client import connect

    served, clicks = page
    with connect(served.url.replace("http", "ws") + "newest") as viewer:
        viewer.send("ball")
        viewer.send(json.dumps({"seen": 5, "plate": ""}))
        assert json.loads(viewer.recv(timeout=20))["pictures"] == 0
    assert clicks == ["ball"]


@pytest.mark.parametrize(
    ("light", "planned", "words"),
    [
        (0.9, 0.5, "power 50 % is right"),
        (0.45, 0.4, "set its power to 80 % (now 40 %)"),
        (0.45, 0.8, "set its power to 100 % (now 80 %), and bring it nearer or open the aperture by 0.7 stops"),
        (0.225, 1.0, "bring it nearer or open the aperture by 2.0 stops"),
        (0.001, 1.0, "gives hardly any light: does it fire?"),
    ],
)
def test_each_light_is_told_what_to_set(make_plan: Any, light: float, planned: float, words: str) -> None:
    plan: Plan = make_plan()
    flash = PlannedFlash(lights={"key": planned}, duration_s=plan.flashes[0].duration_s)
    dark = PlannedFlash(lights={}, duration_s=plan.flashes[0].duration_s)
    plan = replace(plan, flashes=(flash, dark))
    observed = Observed(lights=("key",))
    observed.counts["key"] = count_levels(np.full(1000, light, np.float32), 1.0)
    said = power_words(plan, observed)["key"]
    assert re.sub(NUMBER, "", said) == re.sub(NUMBER, "", words)
    found, expected = (np.array(re.findall(NUMBER, one), float) for one in (said, words))
    np.testing.assert_allclose(found, expected, rtol=0.09, atol=0.08, err_msg="counts have eight bins a stop")


def test_what_clips_is_to_be_turned_down(make_plan: Any) -> None:
    plan: Plan = make_plan()
    flash = PlannedFlash(lights={"key": 1.0}, duration_s=plan.flashes[0].duration_s)
    plan = replace(plan, flashes=(flash, PlannedFlash(lights={}, duration_s=flash.duration_s)))
    observed = Observed(lights=("key",))
    observed.counts["key"] = count_levels(np.minimum(np.linspace(0, 2, 1000, dtype=np.float32), 1), 1.0)
    said = power_words(plan, observed)["key"]
    power = float(said.removeprefix("set its power to ").split()[0])
    assert 40 <= power <= 50, said
