"""Plan, firmware, light, camera, normals: what the board really switched is found again in the picture alone.

And psvideo strobe emulate as a user has it: a port on the first line, and a whole trace however it is stopped.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from threading import Thread

import numpy as np
import OpenEXR
import pytest
import serial
from lit_ball import LIT_BALL

from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.plan_toml import format_plan, read_plan
from psvideo.formats.trace_csv import read_trace
from psvideo.strobe.limits import cycle_check
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.protocol import format_request
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.program import make_program
from psvideo.strobe.stand_ins import python_board_server, toolchain
from psvideo.strobe.stand_ins.emulated import play_script
from psvideo.strobe.stand_ins.python_board import PythonBoard
from psvideo.synth import read_scene
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.shotplan import true_plan

STARTS_WITHIN_S = 60.0
CAMERA_SECOND_PPM = 137.0

CHECK = cycle_check([Slot(slot=0, duration=2000, dark=4000, period=2000, lit=(Lit(line=0, on=2000),))])
"""Of a cycle that lights line 0 for 1 ms every 3 ms."""

SCENE = f"""
schema = "psvideo-scene/1"
name = "ball"
frames = 36
seed = 11
[camera]
width_px = 96
height_px = 120
fps = "120000/1001"
shutter_deg = 360.0
readout_s = 0.0081
width_m = 1.3
full_well_e = 30000
read_e = 5
[strobe]
flash_s = 0.0008
dark_every = 2
clock_tolerance_ppm = 500
clock_offset_ppm = {CAMERA_SECOND_PPM}
{LIT_BALL}"""


def picture(path: Path) -> np.ndarray:
    channels = OpenEXR.File(str(path)).channels()
    pixels: np.ndarray = next(iter(channels.values())).pixels if "RGB" not in channels else channels["RGB"].pixels
    return pixels.astype(np.float64)


def play_plan(
    plan: Path, cycles: int, trace: Path, *, board: toolchain.AvrBoard, lines: dict[str, int] | None = None
) -> None:
    """Play a plan on the firmware in emulation, as fast as it goes."""
    program = make_program(read_plan(plan), capabilities(BOARDS[board], "gated"), lines=lines)
    upload = [f"send {format_request(request).decode().strip()}" for request in program.upload()]
    ms = cycles * program.cycle_ticks // 2000 + 50
    said = play_script(
        "\n".join(["wait 20", *upload, f"send RUN {cycles}", f"poll {ms} STAT", ""]), board=board, trace=trace
    )
    assert not [line for line in said if " < E" in line or "!" in line], said


@pytest.mark.parametrize("board", toolchain.AVR_BOARDS)
def test_a_plan_that_the_firmware_plays_ends_in_right_normals(
    board: toolchain.AvrBoard, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, plan, trace = tmp_path / "scene.toml", tmp_path / "plan.toml", tmp_path / "trace.csv"
    clip, timing, out = tmp_path / "clip", tmp_path / "timing.json", tmp_path / "out"
    scene.write_text(SCENE)
    plan.write_text(format_plan(true_plan(read_scene(scene))))
    play_plan(plan, 9, trace, board=board)
    assert main(["synth", str(scene), "--trace", str(trace), "-o", str(clip), "-q"]) == 0
    assert main(["sync", str(clip), "-o", str(timing), "-q"]) == 0
    assert main(["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(out), "-q"]) == 0

    found, truth = json.loads(timing.read_text()), json.loads((clip / "truth" / "timing.json").read_text())
    true_s = np.array([flash["start_s"] for flash in truth["flashes"]])
    found_s = np.array([flash["start_s"] for flash in found["flashes"]])
    assert [flash["slot"] for flash in found["flashes"]] == [flash["slot"] for flash in truth["flashes"]]
    assert found["order"] == "marker"
    assert np.sqrt(np.mean((found_s - true_s) ** 2)) < 0.05 * truth["row_time_s"]
    assert found["clock_offset_ppm"] == pytest.approx(_true_offset_ppm(plan, trace), abs=15)
    assert found["clock_offset_ppm"] != pytest.approx(0, abs=50), "the camera's clock is not the board's"
    true_normals, mask = picture(clip / "truth" / "normals.exr"), picture(clip / "truth" / "mask.exr") > 0.99
    numbers = sorted(path.name.split(".")[1] for path in (out / "normals").iterdir())
    assert numbers
    for number in numbers:
        valid = mask & (picture(out / "valid" / f"clip_valid.{number}.exr") > 0)
        cosine = (picture(out / "normals" / f"clip_normals.{number}.exr") * true_normals).sum(axis=-1)[valid]
        assert valid.sum() > 0.5 * mask.sum()
        assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean() < 1.0


def test_nine_coloured_leds_on_three_lines_give_normals_through_the_firmware(tmp_path: Path) -> None:
    scene, plan, trace = tmp_path / "scene.toml", tmp_path / "plan.toml", tmp_path / "trace.csv"
    text = builtin_scene("colour").read_text(encoding="utf-8")
    for old, new in (
        ("480", "96"),
        ("360\n", "72\n"),
        ("frames = 40", "frames = 16"),
        ("dark_every = 8", "dark_every = 2"),
    ):
        text = text.replace(old, new, 1)
    scene.write_text(text)
    wanted = true_plan(read_scene(scene))
    plan.write_text(format_plan(wanted))
    lit = [flash.lit for flash in wanted.flashes if flash.lit]
    lines = {light: line for line, lights in enumerate(lit) for light in lights}
    play_plan(plan, 6, trace, board="atmega328p", lines=lines)
    assert read_trace(trace).lights == (0, 1, 2)
    wired = [word for line, lights in enumerate(lit) for word in ("--line", f"{','.join(lights)}={line}")]
    clip, out = tmp_path / "clip", tmp_path / "out"
    assert main(["synth", str(scene), "--trace", str(trace), *wired, "-o", str(clip), "-q"]) == 0
    assert main(["normals", str(clip), "--rig", str(clip / "rig.toml"), "--no-preview", "-o", str(out), "-q"]) == 0
    normals, valid = (picture(min((out / what).iterdir())) for what in ("normals", "valid"))
    true, mask = picture(clip / "truth" / "normals.exr"), picture(clip / "truth" / "mask.exr") > 0.99
    solid = mask & (valid > 0)
    assert solid.sum() > 0.3 * mask.sum()
    assert np.degrees(np.arccos(np.clip((normals * true).sum(axis=-1)[solid], -1, 1))).mean() < 2


def _true_offset_ppm(plan: Path, trace: Path) -> float:
    """Return the offset that is in the light: the camera's against the board's, and ticks against the plan's times."""
    played = read_trace(trace)
    cycle_s = np.diff(played.pulses(0)[::2, 0]).mean() / played.hz  # two rounds, of which the first holds the marker
    ppm: float = ((1 + CAMERA_SECOND_PPM * 1e-6) * cycle_s / read_plan(plan).cycle_s - 1) * 1e6
    return ppm


@contextlib.contextmanager
def emulation(*words: str, path: str | None = None) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run psvideo strobe emulate; give the process and its first line."""
    command = [sys.executable, "-m", "psvideo.cli.app", "strobe", "emulate", *words]
    environment = os.environ | ({} if path is None else {"PATH": path})
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


def open_port(port: str) -> serial.SerialBase:
    line: serial.SerialBase = serial.serial_for_url(port, 115200, timeout=10)  # type: ignore[no-untyped-call]
    return line


def ask(line: serial.SerialBase, request: str) -> str:
    line.write(f"{request}\n".encode())
    reply: str = line.read_until(b"\n").decode().strip()  # type: ignore[no-untyped-call]
    return reply


def flash_on(port: str, flashes: int) -> None:
    with open_port(port) as line:
        assert ask(line, "ID").startswith("OK proto=1 board=atmega")
        for request in ("KEEP 2000", "SLOT 0 2000 4000 2000 0:2000", "STEPS 0 0"):
            assert ask(line, request).startswith("OK ")
        assert ask(line, f"ARM {CHECK}").startswith("OK ")
        assert ask(line, f"RUN {flashes}").startswith("OK start=")
        deadline = time.monotonic() + 30
        while "state=idle" not in ask(line, "STAT"):
            assert time.monotonic() < deadline
            time.sleep(0.02)


@pytest.mark.parametrize("stop", [signal.SIGTERM, signal.SIGINT], ids=["SIGTERM", "Ctrl-C"])
@pytest.mark.parametrize("words", [["--board", "atmega2560"], ["--board", "python"]], ids=["chip", "python"])
def test_the_port_comes_first_and_the_trace_is_whole_when_it_is_stopped(
    words: Sequence[str], stop: signal.Signals, tmp_path: Path
) -> None:
    trace = tmp_path / "trace.csv"
    with emulation(*words, "--trace", str(trace)) as (process, port):
        assert Path(port).exists(), port
        flash_on(port, 20)
        assert not trace.exists()
        process.send_signal(stop)
        _, complaints = process.communicate(timeout=STARTS_WITHIN_S)
        assert process.returncode == 0, complaints
        assert complaints == ""
    pulses = read_trace(trace).pulses(0)
    np.testing.assert_array_equal(np.diff(pulses, axis=1), 16_000)
    np.testing.assert_array_equal(np.diff(pulses[:, 0]), 48_000)
    assert len(pulses) == 20
    assert [path.name for path in tmp_path.iterdir()] == ["trace.csv"]


def test_the_real_firmware_answers_where_nothing_is_said() -> None:
    with emulation("--fast") as (_, port), open_port(port) as line:
        assert ask(line, "ID").startswith("OK proto=1 board=atmega328p firmware=1")


def test_a_host_that_goes_away_in_the_middle_leaves_it_dark(tmp_path: Path) -> None:
    trace = tmp_path / "trace.csv"
    with emulation("--board", "python", "--trace", str(trace)) as (process, port):
        with open_port(port) as line:
            for request in ("KEEP 500", "SLOT 0 2000 4000 2000 0:2000", "STEPS 0 0", f"ARM {CHECK}", "RUN 0"):
                assert ask(line, request).startswith("OK")
        time.sleep(1.2)
        with open_port(port) as line:
            assert "state=fault fault=silent" in ask(line, "STAT")
        process.send_signal(signal.SIGTERM)
        assert process.wait(STARTS_WITHIN_S) == 0
    edges = read_trace(trace).edges["0"]
    assert edges.size % 2 == 0
    assert edges[-1] - edges[0] <= 0.51 * 16_000_000


def test_systems_without_pseudo_terminals_get_a_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "openpty")
    with contextlib.closing(python_board_server.open_port()) as port:
        over: list[bool] = []
        server = Thread(
            target=python_board_server.serve,
            args=(PythonBoard(BOARDS["atmega328p"]), port),
            kwargs={"stopped": lambda: bool(over)},
        )
        server.start()
        assert port.name.startswith("socket://127.0.0.1:")
        for _ in range(2):  # a host goes, another comes
            flash_on(port.name, 3)
        over.append(True)
        server.join(10)
        assert not server.is_alive()


def test_without_the_tools_the_python_board_answers_and_says_so(tmp_path: Path) -> None:
    with emulation(path=str(tmp_path)) as (process, port):
        with open_port(port) as line:
            assert "firmware=python-1" in ask(line, "ID")
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=STARTS_WITHIN_S)
    assert process.returncode == 0
    assert "needs the Debian packages make gcc gcc-avr" in said
    assert said.count("\n") == 1


def test_what_lacks_is_named_where_the_firmware_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(toolchain, "_has", lambda program: program != "avr-gcc")
    assert toolchain.missing_packages() == ("gcc-avr", "avr-libc")
    with pytest.raises(PsvideoError, match=r'needs the Debian packages gcc-avr avr-libc\. .*`board="python"`'):
        toolchain.build("atmega328p")
    monkeypatch.setattr(toolchain, "lights_folder", lambda: None)
    with pytest.raises(PsvideoError, match=r'does not hold them\. Run it from a checkout, or take `board="python"`'):
        toolchain.build("atmega328p")


def test_what_stands_under_the_traces_name_is_not_replaced_unasked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "plan.toml"
    trace.write_text("precious")
    for words in ([], ["--force"]):
        assert main(["strobe", "emulate", "--trace", str(trace), *words]) == 2
    assert "exists" in capsys.readouterr().err
    assert trace.read_text() == "precious"
    assert main(["strobe", "emulate", "--board", "python", "--fast"]) == 2
