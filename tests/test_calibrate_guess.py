"""Lights that are guessed from the pictures of the subject itself: where the guess holds, and what it says."""

from pathlib import Path

import numpy as np
import pytest
from angles import angles_deg
from pictures_of_lights import sphere_pictures, washington, ways

from psvideo.calibrate.guess import guess_rig
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.rig_toml import read_rig
from psvideo.model.choices import Prior


@pytest.mark.parametrize(("lights", "prior"), [(8, "equal-lights"), (8, "equal-albedo"), (4, None)])
def test_a_guess_is_right_where_its_priors_hold(lights: int, prior: Prior | None) -> None:
    directions = ways(lights)
    guessed = guess_rig(sphere_pictures(directions, np.ones((lights, 3))), prior=prior)
    found = np.array([light.direction for light in guessed.rig.lights])
    assert angles_deg(found, directions).max() < 6
    assert all(light.error_deg == 20 for light in guessed.rig.lights)


def test_a_guess_says_what_it_cannot_know() -> None:
    ring = np.array([[np.cos(a), np.sin(a), 1.4] for a in np.arange(8) * np.pi / 4])
    ring /= np.linalg.norm(ring, axis=1, keepdims=True)
    with pytest.raises(PsvideoError, match=r"fit several directions of the lights|No lights of equal strength"):
        guess_rig(sphere_pictures(ring, np.ones((8, 3)), noise=0), prior="equal-lights")
    unequal = np.linspace(0.2, 1.5, 8)[:, None] * np.ones(3)
    with pytest.raises(PsvideoError, match=r"unequal by|No lights of equal strength"):
        guess_rig(sphere_pictures(ways(8), unequal), prior="equal-lights")
    with pytest.raises(PsvideoError, match="A matte surface explains"):
        guess_rig(sphere_pictures(ways(8), np.ones((8, 3)), noise=0.15), prior="equal-lights")


def test_a_guessed_rig_says_so_in_the_file_and_on_the_terminal(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, chrome = washington(shared_data, tmp_path / "gray")
    out = tmp_path / "rig.toml"
    assert main(["calibrate", "guess", str(folder), "-o", str(out)]) == 0
    assert "A GUESS" in capsys.readouterr().err
    assert out.read_text().startswith("# A GUESS")
    lights = read_rig(out).lights
    assert angles_deg(np.array([light.direction for light in lights]), chrome).mean() < 20
    assert main(["calibrate", "guess", str(folder), "-o", str(tmp_path / "x.toml"), "--prior", "luck"]) == 2
