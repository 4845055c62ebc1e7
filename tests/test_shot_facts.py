"""What footage says of camera, lens, reel and colour stands in the headers of what is made from it."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import tomlkit

from psvideo.cli.app import main
from psvideo.clip.decode.movies.movie_tags import shot_by
from psvideo.export.sequences.tags import PRIMARIES, Tags
from psvideo.formats.exr_files import write_exr

NAMES = ("key", "left", "top")
SHOT = {"cameraMake": "ARRI", "cameraModel": "ALEXA Mini", "lensModel": "Cooke S4/i 50", "reelName": "A001R2EC"}


def test_camera_lens_reel_and_primaries_of_the_footage_are_those_of_the_plates(tmp_path: Path) -> None:
    clip = tmp_path / "clip"
    rng = np.random.default_rng(1)
    for number, _ in enumerate(NAMES, start=1):
        planes = dict(zip("RGB", rng.random((3, 8, 12)).astype(np.float32), strict=True))
        attributes = {**SHOT, "colorInteropID": "lin_ap1_scene"}
        write_exr(clip / f"a.{number:04d}.exr", planes, attributes=attributes, time_code="01:02:03:04")
    camera = {"width_px": 12, "height_px": 8, "fps": 1}
    flashes = [{"lights": {name: 1.0}} for name in NAMES]
    plan = {"schema": "psvideo-plan/1", "camera": camera, "strobe": {"mode": "synced", "flash": flashes}}
    (clip / "plan.toml").write_text(tomlkit.dumps(plan))
    assert main(["split", str(clip), "-o", str(tmp_path / "plates"), "-q"]) == 0
    header = OpenEXR.File(str(next((tmp_path / "plates" / "key").iterdir()))).header()
    assert {name: header[name] for name in SHOT} == SHOT
    assert header["colorInteropID"] == "lin_ap1_scene"
    assert header["chromaticities"] == pytest.approx(PRIMARIES["lin_ap1_scene"], abs=1e-6)


def test_a_movies_words_for_its_camera_are_known() -> None:
    said = {"com.apple.quicktime.model": "iPhone 15 Pro", "com.apple.quicktime.make": "Apple", "reel_name": "A003"}
    assert dict(shot_by(said)) == {"cameraMake": "Apple", "cameraModel": "iPhone 15 Pro", "reelName": "A003"}


def test_colour_of_a_sensor_is_called_so_and_data_has_none() -> None:
    tags = Tags(fps=Fraction(24), colour="unknown", plan_sha256="0", shot=(("cameraModel", "EOS R5"),))
    light, data = (tags.attributes(time_s=0.0, data=one) for one in (False, True))
    assert light["colorInteropID"] == "unknown"
    assert light["psvideo:colour"] == "linear light as the sensor of EOS R5 saw it, not converted, no white balance"
    assert "chromaticities" not in light
    assert not {"psvideo:colour", "chromaticities"} & set(data)
