"""Least squares on pictures that nobody here made, against their true normals."""

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest
from angles import error_deg
from numpy.typing import NDArray
from picture_file import read_picture

from psvideo.formats.rig_toml import read_rig
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares.woodham1980 import EVERYTHING, Usable, solve
from psvideo.solve.normals.lit_plates import LitPlates


def test_the_ball_of_diligent_with_48_lights(shared_data: Path) -> None:
    folder = shared_data / "diligent_ball"
    with (folder / "lights.csv").open() as file:
        rows = [row for row in csv.reader(file) if row[0].endswith(".png")]
    numbers = np.array([[float(word) for word in row[1:7]] for row in rows])
    strengths = numbers[:, 3:] / numbers[:, 3:].mean()
    lit = Illumination(directions=numbers[:, :3], intensities=strengths)
    codes = (read_picture(folder / row[0], cv2.IMREAD_UNCHANGED)[..., ::-1] for row in rows)
    plates = [np.ascontiguousarray(picture / np.float32(65535), np.float32) for picture in codes]
    mask = read_picture(folder / "mask.png", cv2.IMREAD_GRAYSCALE) > 127
    truth = np.load(folder / "normal_gt.npy")

    plain = solve(LitPlates(plates, lit), usable=EVERYTHING)
    assert plain.valid[mask].all()
    assert error_deg(plain, truth, mask).mean() <= 4.2  # published for all 96 lights: 4.10
    careful = solve(LitPlates(plates, lit, mask=mask), usable=Usable(dark_level=0.0005))
    assert careful.valid[mask].mean() > 0.99
    assert error_deg(careful, truth, mask).mean() <= 3.3


def test_the_rendered_bunny_is_solved_though_it_casts_shadows_on_itself(shared_data: Path) -> None:
    data = np.load(shared_data / "bunny_rendered" / "bunny_lambert.npz")
    plates = list(data["images"].astype(np.float32) * 5)
    lit = Illumination(directions=data["lights"].astype(np.float64), intensities=np.ones((len(plates), 3)))
    plain = error_deg(solve(LitPlates(plates, lit), usable=EVERYTHING), data["normal_gt"], data["mask"])
    assert plain.mean() == pytest.approx(4.11, abs=0.03)
    assert np.median(plain) == pytest.approx(3.51, abs=0.03)
    careful = solve(LitPlates(plates, lit))
    assert careful.valid[data["mask"]].mean() > 0.999
    assert error_deg(careful, data["normal_gt"], data["mask"]).mean() < 4.0
    assert np.percentile(error_deg(careful, data["normal_gt"], data["mask"]), 95) < 6.5 < np.percentile(plain, 95)


def test_the_matte_sphere_of_washington_comes_out_as_a_sphere(shared_data: Path) -> None:
    folder = shared_data / "uw_psm"
    words = (folder / "lights.txt").read_text().split()
    directions = np.array(words[1:], np.float64).reshape(int(words[0]), 3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lit = Illumination(directions=directions, intensities=np.ones((len(directions), 3)))
    paths = [folder / "gray" / f"gray.{n}.png" for n in range(len(directions))]
    plates = [(read_picture(path)[..., ::-1] / 255).astype(np.float32) for path in paths]
    rows, cols = np.mgrid[: plates[0].shape[0], : plates[0].shape[1]]
    x, y = (cols - 244.5) / 108.0, (144.5 - rows) / 108.0
    inner = x * x + y * y < 0.95**2
    truth = np.stack([x, y, np.sqrt(np.maximum(1 - x * x - y * y, 0))], axis=-1)
    assert error_deg(solve(LitPlates(plates, lit), usable=EVERYTHING), truth, inner).mean() == pytest.approx(
        5.1, abs=0.1
    )
    assert error_deg(solve(LitPlates(plates, lit)), truth, inner).mean() < 4.9


@pytest.mark.parametrize("clip", ["plain", "ambient"])
def test_the_true_plates_of_another_simulator_give_its_true_normals(shared_data: Path, clip: str) -> None:
    truth = shared_data / "clips" / clip / "truth"
    flashes = json.loads((truth / "timing.json").read_text())["flashes"]
    plate_of = {flash["light"]: flash["plate"] for flash in flashes if flash.get("plate")}
    rig = read_rig(shared_data / "clips" / clip / "rig.toml")
    lights = [light for light in rig.lights if light.name in plate_of]
    durations = {flash["light"]: flash["duration_s"] for flash in flashes}
    scale = [durations[light.name] / (light.reference_duration_s or durations[light.name]) for light in lights]
    plates = [_exr(truth / plate_of[light.name]) for light in lights]
    channels = plates[0].shape[2]
    lit = Illumination(
        directions=np.array([light.direction for light in lights]),
        intensities=np.array(
            [np.broadcast_to(light.intensity, channels) * factor for light, factor in zip(lights, scale, strict=True)]
        ),
    )
    surface = solve(LitPlates(plates, lit))
    normals, mask = _exr(truth / "normals.exr"), _exr(truth / "mask.exr")[..., 0] > 0.5
    errors = error_deg(surface, normals, mask)
    assert np.median(errors) < 0.1
    assert errors.mean() < 0.5
    both = surface.valid & mask
    ratio = surface.albedo[both] / _exr(truth / "albedo.exr")[both]  # that simulator's exposure is one factor more
    assert np.quantile(np.abs(ratio / np.median(ratio) - 1), 0.9) < 0.01


def _exr(path: Path) -> NDArray[np.float32]:
    channels = {name: channel.pixels for name, channel in OpenEXR.File(str(path)).channels().items()}
    image = next(iter(channels.values())).astype(np.float32)
    return np.ascontiguousarray(image[..., :3] if image.ndim == 3 else image[..., None])
