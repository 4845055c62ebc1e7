"""GenICam cameras: the emulated one of the extra where it is installed, and a stand-in for its process everywhere."""

import json
import sys
import textwrap
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from psvideo.cli.app import main
from psvideo.clip.streams import genicam
from psvideo.clip.streams.genicam import found_cameras, read_genicam
from psvideo.errors import PsvideoError
from psvideo.model.camera import Camera

CAMERA = Camera(width_px=64, height_px=48, fps=Fraction(200), exposure_s=0.005, readout_s=0.004)
needs_pylon = pytest.mark.skipif(find_spec("pypylon") is None, reason="the extra genicam is not installed")


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[str], None]:
    """Have a process serve frames as the camera's does: what it does with ``mode`` and ``frame(number)`` is given."""

    def serve(does: str) -> None:
        script = tmp_path / "camera.py"
        script.write_text(
            textwrap.dedent(
                """
                import json, os, struct, sys
                out = sys.stdout.buffer
                def mode(form="Mono8", shape=(48, 64), dtype="|u1"):
                    out.write(json.dumps({"format": form, "shape": shape, "type": dtype}).encode() + b"\\n")
                def frame(number):
                    out.write(struct.pack("<QQQ", number, 0, 48 * 64) + bytes([number % 256]) * (48 * 64))
                    out.flush()
                """
            )
            + does
        )
        monkeypatch.setattr(genicam, "find_spec", lambda name: True)
        monkeypatch.setattr(genicam, "_command", lambda *words: [sys.executable, str(script), *words])
        monkeypatch.setattr(genicam, "AGAIN_S", 0.01)

    return serve


def test_frames_stand_where_the_cameras_numbers_say(served: Callable[[str], None]) -> None:
    served("mode()\nfor number in (65533, 65534, 2, 3): frame(number)")
    frames = list(islice(read_genicam("genicam:7", CAMERA, noted=pytest.fail), 4))
    assert [frame.index for frame in frames] == [0, 1, 4, 5], "65,535 and 1 never came"
    assert [int(np.asarray(frame.coded.codes)[5, 5]) for frame in frames] == [253, 254, 2, 3]


def test_a_camera_that_crashes_is_a_sentence_and_is_found_again(served: Callable[[str], None]) -> None:
    served("mode()\nframe(1)\nframe(2)\nos.kill(os.getpid(), 11)")
    notes: list[str] = []
    frames = list(islice(read_genicam("genicam", CAMERA, noted=notes.append), 4))
    assert len(notes) == 1
    assert "ended by itself (signal 11)" in notes[0]
    places = [frame.index for frame in frames]
    assert places[:2] == [0, 1]
    assert places[2] > 2, "the time without a camera is frames that never came"
    assert places[3] == places[2] + 1


@pytest.mark.parametrize(
    ("does", "said"),
    [
        ("sys.exit('there is no such camera; there are: 0815')", "there are: 0815"),
        ("mode(shape=(48, 32))\nframe(1)", "sends 32 x 48 pixels, and the plan says 64 x 48"),
        ("mode('BGR8Packed')\nframe(1)", "expected Mono, Bayer or RGB"),
        (
            "mode('BayerGB8')\nframe(1)",
            "its colour filters are GBRG from the top left pixel on, and the plan says cfa = 'RGGB'",
        ),
    ],
)
def test_what_cannot_be_filmed_ends_in_one_paragraph(served: Callable[[str], None], does: str, said: str) -> None:
    served(does)
    camera = replace(CAMERA, encoding=replace(CAMERA.encoding, cfa="RGGB"))
    with pytest.raises(PsvideoError, match=said):
        next(iter(read_genicam("genicam:1", camera, noted=pytest.fail)))


def test_without_the_extra_it_is_named(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(genicam, "find_spec", lambda name: None)
    with pytest.raises(PsvideoError, match=r"psvideo\[genicam\]"):
        next(iter(read_genicam("genicam", CAMERA, noted=pytest.fail)))
    assert main(["live", "--list", "--json"]) == 0
    assert isinstance(json.loads(capsys.readouterr().out)["found"], list)
    assert main(["live"]) == 2
    assert "Name what to watch" in capsys.readouterr().err


@needs_pylon
def test_the_emulated_camera_plays_pictures_in_order(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYLON_CAMEMU", "1")
    for number in range(6):
        codes = np.full((48, 64), 10 + number, np.uint8)
        (tmp_path / f"frame.{number:03d}.png").write_bytes(imagecodecs.png_encode(codes))
    (camera,) = found_cameras()
    source = f"{camera.source}?Width=64&Height=48&TestImageSelector=Off&ImageFilename={tmp_path}&ImageFileMode=On"
    frames = list(islice(read_genicam(source, CAMERA, noted=pytest.fail), 8))
    assert [frame.index for frame in frames] == list(range(8))
    codes_of = [int(np.asarray(frame.coded.codes)[20, 20]) for frame in frames]
    assert codes_of == [10 + (codes_of[0] - 10 + place) % 6 for place in range(8)]
