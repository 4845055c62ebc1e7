"""What live does before its first frame, and what it says while there is nothing to show."""

import gc
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from live_clip import live_clip
from live_standing import standing
from memory_frame import MemoryFrame

import psvideo as ps
from psvideo.cli.app import main
from psvideo.cli.console import Voice
from psvideo.cli.live_lines import LiveLines
from psvideo.clip.streams.stream import OPEN_S
from psvideo.compute.compile_count import COMPILING, CompileCount, compiles_counted
from psvideo.live.chain import Chain
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.source import LiveSource
from psvideo.live.keeping_up import KeepingUp
from psvideo.live.preparing import compiling_words, prepared
from psvideo.live.result_times import ResultTimes
from psvideo.live.running import Running
from psvideo.live.showing.quality import LiveSecond, first_quality
from psvideo.live.showing.smaller import smaller_plan
from psvideo.live.standing import Counted
from psvideo.live.status import SAID, LiveState, LiveStatus
from psvideo.live.waiting import AGAIN_S, SILENT_S, Waiting
from psvideo.model.coded import Coded, Tone
from psvideo.model.plan import Plan
from psvideo.runs.live import live
from psvideo.synth import TrueClock, expose

PlanMaker = Callable[..., Plan]
ENDS_S = OPEN_S / 2
"""Ending takes 1.4 s beside six other processes; where the source is waited for it takes what is left of OPEN_S."""


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return live_clip(tmp_path_factory.mktemp("live"))


LOADS_NOTHING = """
import sys
from psvideo.compute.compiled import _Kept
from psvideo.formats.rig_toml import read_rig
from psvideo.live.incoming.sources import opened_source
from psvideo.runs.live import live
from psvideo.runs.on_set.live_rehearsal import rehearse

clip, loaded, load = sys.argv[1], [], _Kept.load_overload
_Kept.load_overload = lambda self, *given: loaded.append(self._name) or load(self, *given)
rehearse(opened_source(clip, plan=None), read_rig(clip + "/rig.toml"), step=1, page=True)
assert loaded
loaded.clear()
live(clip, rig=clip + "/rig.toml", pace="fastest", page=True)
print(*loaded)
"""


@pytest.mark.campaign
def test_after_the_rehearsal_nothing_is_loaded_or_compiled_while_frames_come(clip: Path) -> None:
    done = subprocess.run([sys.executable, "-c", LOADS_NOTHING, str(clip)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_the_source_is_opened_once_everything_is_ready(clip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    left_alone: list[int] = []
    monkeypatch.setattr("psvideo.runs.live.rehearse", lambda *_, **__: order.append("rehearsed"))

    def read(*_: object, **__: object) -> Iterator[object]:
        order.append("read")
        left_alone.append(gc.get_freeze_count())
        return iter(())

    monkeypatch.setattr("psvideo.live.incoming.source.read_frames", read)
    monkeypatch.setattr("psvideo.live.incoming.source._kind", lambda clip: None)
    with pytest.raises(ps.PsvideoError, match="0 frames are too few"):
        live(clip)
    assert order == ["rehearsed", "read"]
    assert left_alone[0] > 10_000, "no search for cycles among what is loaded holds frames up"
    assert gc.get_freeze_count() == 0


def test_where_lines_stay_one_comes_when_something_changes_and_every_ten_seconds(
    capsys: pytest.CaptureFixture[str],
) -> None:
    told = LiveLines(voice=Voice())
    held: list[tuple[LiveState, float]] = [("locked", 100.0)] * 26
    states: list[tuple[LiveState, float]] = [("seeking", 100), *held, ("locked", 0.0), ("locked", 0.0)]
    for second, (state, fps) in enumerate([*states, ("lost", 100.0)]):
        told.say(standing(at_s=float(second), state=state, fps=fps, frames=second + 1))
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(" | ")[0] for line in lines] == [SAID["seeking"], *[SAID["locked"]] * 4, SAID["lost"]]
    assert [line.split(" | ")[2].split()[0] for line in lines] == ["1", "2", "12", "22", "28", "30"]


def test_the_line_says_where_names_are_a_guess() -> None:
    lines = {
        order: standing(at_s=1.0, state="locked", fps=100.0, frames=100, order=order).line
        for order in ("guess", "marker")
    }
    assert "locked | NAMES OF LIGHTS ARE A GUESS | 100.0 fps" in lines["guess"]
    assert "GUESS" not in lines["marker"]


def test_what_is_compiled_is_counted_and_said_until_it_is_done() -> None:
    with compiles_counted() as compiles:
        said: list[str] = []

        def prepare() -> None:
            for name in "abc":
                COMPILING.info("compiling %s", name)
            time.sleep(0.1)

        def say() -> None:
            said.append(compiling_words(compiles, compiles.since_s + 21, preparing=True))

        assert not prepared(prepare, said=say, every_s=0.02)
    assert said[0].startswith("Compiling, once: 3 loops in 21 s so far")
    assert compiling_words(compiles, compiles.last_s + 1, preparing=False)
    assert not compiling_words(compiles, compiles.last_s + 60, preparing=False)
    assert not compiling_words(CompileCount(), 0.0, preparing=True)


def test_a_rehearsal_that_goes_wrong_is_a_sentence_and_the_run_goes_on() -> None:
    def fails() -> None:
        raise ValueError("no such thing")

    assert "no such thing" in prepared(fails, said=lambda: None, every_s=0.01)


def test_a_silent_source_is_said_to_be_and_a_reason_stays_for_a_while() -> None:
    waiting = Waiting(name="udp://127.0.0.1:5000", check="the sender")
    assert not waiting.look(1.0, state="preparing", frames=0, why="")
    assert not waiting.look(2.0, state="seeking", frames=0, why="")
    words = waiting.look(1.0 + SILENT_S, state="seeking", frames=0, why="")
    assert words.startswith("udp://127.0.0.1:5000: no frames come yet. Check the sender.")
    assert waiting.look(10.0, state="seeking", frames=9, why="51 %") == "51 %"
    assert waiting.look(11.0, state="seeking", frames=19, why="52 %") == "51 %"
    assert waiting.look(10.0 + AGAIN_S, state="lost", frames=99, why="53 %") == "53 %"
    assert not waiting.look(21.0, state="locked", frames=109, why="")
    assert "no frames come after 109 of them" in waiting.look(30.0, state="locked", frames=109, why="")


def test_darkness_is_said_to_be_dark_while_the_run_goes_on(make_plan: PlanMaker) -> None:
    plan = make_plan()
    chain, waiting = Chain(plan=plan), Waiting(name="pipe", check="the sender")
    said = ""
    for place in range(80):
        dark = np.zeros((plan.camera.height_px, plan.camera.width_px), np.float32)
        chain.take(LiveFrame(index=place, coded=MemoryFrame(place, dark).coded, came_s=0.0))
        said = said or waiting.look(0.01 * place, state=chain.state, frames=chain.count.seen, why=chain.why)
    assert "its rows do not change at all from frame to frame. Check that the lights flashed" in said


def test_a_first_light_that_the_plan_does_not_have_is_refused_at_once(
    clip: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["live", str(clip), "--first-light", "nobody", "--no-page"]) == 2
    assert "no such flash in the plan; its flashes are" in capsys.readouterr().err


def test_the_first_light_names_the_first_frames_flashes_and_not_those_after_a_pause(make_plan: PlanMaker) -> None:
    plan = make_plan()
    rng = np.random.default_rng(3)
    shape = plan.camera.height_px, plan.camera.width_px
    plates = {slot: (0.05 + 0.3 * rng.random(shape)).astype(np.float32) for slot in plan.lit_slots}
    before = expose(plates, plan, frames=80, clock=TrueClock(phase_s=0.0))
    dark = np.zeros(shape, np.float32)
    for light in plan.lights[:2]:  # one of them is the wrong one
        chain = Chain(plan=plan, first_light=light)
        for place, image in enumerate([*[dark] * 100, *before.frames]):
            chain.take(LiveFrame(index=place, coded=MemoryFrame(place, image).coded, came_s=0.0))
        assert chain.fault is None
        assert chain.state == "locked"


def test_a_network_stream_that_is_silent_is_said_to_be_and_ctrl_c_ends_it_at_once(clip: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = ["live", f"udp://127.0.0.1:{port}", "--plan", str(clip / "plan.toml"), "--no-page"]
    with subprocess.Popen([sys.executable, "-m", "psvideo", *words], stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        said = next(line for line in process.stderr if "no frames come yet" in line)
        began_s = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.wait(timeout=30)
    assert time.monotonic() - began_s < ENDS_S
    assert "address and port" in said


def test_a_slow_source_is_said_once_it_was_slow_for_some_seconds_also_while_the_strobe_is_looked_for(
    make_plan: PlanMaker,
) -> None:
    """A stream that ends or begins within a second gives few frames in it; bare bytes may be of another size."""
    plan, quality = make_plan(), first_quality(64, 48, mosaic=False)
    states: list[LiveState] = ["seeking", "locked"]
    for state in states:
        keeping = KeepingUp(plan=plan, source="pipe", quality=quality, slow_hint="Or not.")
        fps = [40.0, 120.0, 120.0, 40.0, 0.0, 0.0, 120.0]
        paused = [standing(at_s=float(n), state=state, fps=one, frames=99) for n, one in enumerate(fps)]
        assert [note for one in paused for note in keeping.notes_on(one, None)] == []
        slow = [standing(at_s=float(n), state=state, fps=30.0, frames=99) for n in range(10)]
        words = [note for one in slow for note in keeping.notes_on(one, None)]
        assert len(words) == 1
        assert words[0].startswith("pipe: its frames come at 30.0 a second, and the plan says 119.88")
        assert words[0].endswith("Or not.")


def test_of_the_sizes_that_a_picture_had_the_last_is_said(make_plan: PlanMaker) -> None:
    """A page beside it has no room for all that it was."""
    keeping = KeepingUp(plan=make_plan(), source="camera", quality=first_quality(640, 480, mosaic=False))
    late = LiveSecond(age_s=0.9, made_age_s=0.9, made_s=0.5, rate=2.0, rounds_per_s=20.0)
    steps = []
    for second in range(30):
        status = standing(at_s=float(second), state="locked", fps=120.0, frames=99)
        assert list(keeping.notes_on(status, late)) == []
        steps.append(keeping.quality.step)
    assert len(set(steps)) > 2
    camera = smaller_plan(keeping.plan, steps[-1]).camera
    assert (
        keeping.size_words
        == f"The live picture is now {camera.width_px} x {camera.height_px} pixels, smaller, to keep up."
    )


def test_one_late_result_of_a_second_is_late_though_most_are_not(make_plan: PlanMaker) -> None:
    plan = make_plan()
    kind = Coded(codes=np.zeros((2, 2), np.uint8), tone=Tone())
    source = LiveSource(name="camera", plan=plan, frames=lambda: iter(()), kind=kind)
    said: list[LiveStatus] = []
    running = Running(
        chain=Chain(plan=plan),
        source=source,
        quality=first_quality(64, 48, mosaic=False),
        shown=lambda newest: None,
        said=said.append,
        drawn_ages_s=lambda since_s: [0.05, 0.06, 0.05, 0.31],
    )
    running.times = ResultTimes(count=4, ages_s=[0.03, 0.04, 0.03, 0.28], _made_s=[0.02] * 4)
    status = running._status(1.0, 1.0, Counted())
    measured = running.times.last_second(status, plan, behind_s=0.0)
    assert status.age_s == pytest.approx(0.055)
    assert status.oldest_s == 0.31
    assert measured is not None
    assert (measured.age_s, measured.made_age_s) == (0.31, 0.28)
    assert measured.is_late
