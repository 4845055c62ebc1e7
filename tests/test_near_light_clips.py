"""Near lights of rigs in files: real LEDs, whole clips, and rigs that cannot be."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from near_room import FAR_M, FOCAL_PX, MIDDLE, SIZE, filmed, lit_by, mean_error_deg, picture, relief, ring_rig, surface
from scipy.io import loadmat  # type: ignore[attr-defined]

import psvideo as ps
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.rig import Light, Rig
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust import huber1981


def led_rig(folder: Path) -> Rig:
    """The real rig of eight LEDs in our axes (it has x right, y down, z forward, mm), its surface 0.75 m away."""
    lights: Any = loadmat(folder / "light.mat")  # type: ignore[no-untyped-call]
    ours = np.array([1.0, -1.0, -1.0])
    strengths = 0.06 * lights["Phi"] / lights["Phi"].mean()
    return Rig(
        lights=tuple(
            Light(
                name=f"led{n}",
                position_m=tuple(1e-3 * lights["S"][n] * ours),
                axis=tuple(lights["Dir"][n] * ours / np.linalg.norm(lights["Dir"][n])),
                anisotropy=float(lights["mu"][n, 0]),
                intensity=tuple(strengths[n]),
            )
            for n in range(8)
        ),
        focal_px=(FOCAL_PX, FOCAL_PX),
        principal_px=(MIDDLE, MIDDLE),
        plane=(0.0, 0.0, 1.0, FAR_M),
    )


def test_a_real_rig_of_leds_with_axes_and_unequal_strengths(shared_data: Path) -> None:
    rig = led_rig(shared_data / "led_rig_near_light")
    shift = FAR_M - 0.75  # the same waves, nearer: what is seen is then half as wide
    points, normals = surface(lambda u, v: relief(u, v) - shift)
    rig = Rig(lights=rig.lights, focal_px=rig.focal_px, principal_px=rig.principal_px, plane=(0.0, 0.0, 1.0, 0.75))
    plates, near = filmed(rig, points, normals), lit_by(rig, channels=3)
    assert max(plate.max() for plate in plates) < 1
    distant = Illumination(directions=near.directions, intensities=near.intensities)
    before = mean_error_deg(woodham1980.solve(LitPlates(plates, distant)), normals)
    for solver in (woodham1980, huber1981):
        assert mean_error_deg(solver.solve(LitPlates(plates, near)), normals) < min(0.6, 0.1 * before)


@pytest.mark.parametrize("mu", [0.5, 1.0, 2.5])
def test_an_led_without_an_axis_shines_at_the_surface_s_middle(mu: float) -> None:
    points, normals = surface(relief)
    bare = ring_rig(4, 2)
    near = lit_by(bare).near
    assert near is not None
    middle = near.ground.middle_m
    aimed, unaimed = [], []
    for light in bare.lights:
        axis = middle - np.array(light.position_m)
        common: dict[str, Any] = {
            "name": light.name,
            "position_m": light.position_m,
            "intensity": light.intensity,
            "anisotropy": mu,
        }
        aimed.append(Light(**common, axis=tuple(axis / np.linalg.norm(axis))))
        unaimed.append(Light(**common))
    view: dict[str, Any] = {"focal_px": bare.focal_px, "principal_px": bare.principal_px, "plane": bare.plane}
    found = woodham1980.solve(
        LitPlates(filmed(Rig(lights=tuple(aimed), **view), points, normals), lit_by(Rig(lights=tuple(unaimed), **view)))
    )
    assert mean_error_deg(found, normals) < 0.25


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"plane": None}, r"\[surface\] plane = "),
        ({"focal_px": None}, r"\[camera\] focal_px = "),
        ({"principal_px": None}, r"principal_px = \[47.5, 47.5\]"),
        ({"plane": (0.0, 0.0, 1.0, 1600.0)}, "looks like millimetres"),
        ({"plane": (0.0, 0.0, 1.0, -1.6)}, "lies nowhere before the camera"),
    ],
)
def test_a_rig_that_does_not_say_where_the_surface_is_is_refused_with_what_to_add(
    change: dict[str, Any], words: str
) -> None:
    rig = ring_rig(3, 2)
    known: dict[str, Any] = {"focal_px": rig.focal_px, "principal_px": rig.principal_px, "plane": rig.plane} | change
    with pytest.raises(PsvideoError, match=words):
        ground_of(Rig(lights=rig.lights, **known), height_px=SIZE, width_px=SIZE)


@pytest.mark.parametrize(
    ("position_m", "words"),
    [
        ((-200.0, 150.0, 100.0), "looks like millimetres"),
        ((0.0, 0.0, -FAR_M), "in the surface itself"),
        ((0.3, 0.0, -2 * FAR_M), "behind the surface"),
    ],
)
def test_a_light_that_cannot_stand_where_it_is_said_to_is_refused(
    position_m: tuple[float, float, float], words: str
) -> None:
    rig = ring_rig(3, 2)
    wrong = (*rig.lights[:2], Light(name="odd", position_m=position_m))
    with pytest.raises(PsvideoError, match=f"'odd'.*{words}"):
        illumination(wrong, channels=1, ground=ground_of(rig, height_px=SIZE, width_px=SIZE))


SCENE = """schema = "psvideo-scene/1"
name = "near"
frames = {frames}
seed = 3
[camera]
width_px = 200
height_px = 150
fps = 100
shutter_deg = 360.0
readout_s = 0.01
view = "perspective"
focal_px = 300.0
[strobe]
flash_s = 0.001
{lights}
[[object]]
mesh = "sphere"
height_m = 0.3
position_m = [0.02, 0.0, -0.85]
albedo = 0.8
"""


def test_a_clip_lit_by_a_real_rig_of_leds_becomes_normals(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lights = ""
    for light in led_rig(shared_data / "led_rig_near_light").lights:
        numbers = {name: [float(x) for x in getattr(light, name)] for name in ("position_m", "axis", "intensity")}
        lights += f'[[light]]\nname = "{light.name}"\nanisotropy = {light.anisotropy}\n'
        lights += "".join(f"{name} = {values}\n" for name, values in numbers.items())
    (tmp_path / "scene.toml").write_text(SCENE.format(frames=26, lights=lights))
    clip, out = tmp_path / "clip", tmp_path / "out"
    assert main(["synth", str(tmp_path / "scene.toml"), "-o", str(clip), "-q"]) == 0
    command = ["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(out)]
    whole = (clip / "rig.toml").read_text()
    (clip / "rig.toml").write_text(re.sub(r"\[surface\]\n.*\n", "", whole))
    assert main(command) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"psvideo: {clip / 'rig.toml'}: Light ")
    assert "[surface] plane" in said
    (clip / "rig.toml").write_text(whole)
    assert main(command) == 0, "what synth writes is what normals reads"
    assert "The lights are near" in (out / "report.json").read_text()
    found, valid = picture(next((out / "normals").iterdir())), picture(next((out / "valid").iterdir())) > 0
    true, inside = picture(clip / "truth" / "normals.exr"), picture(clip / "truth" / "mask.exr") > 0.5
    assert (valid & inside).sum() > 0.7 * inside.sum()
    apart = np.linalg.norm(found - true, axis=-1)[valid & inside]
    assert np.degrees(2 * np.arcsin(np.minimum(apart / 2, 1))).mean() < 0.6


def test_a_virtual_crew_measures_how_far_the_subject_is_where_lights_are_near(tmp_path: Path) -> None:
    """Its ball of 0.3 m at 0.85 m: the nearest point is 0.7 m away, the rim 0.85."""
    near = '[[light]]\nname = "a"\nposition_m = [0.3, 0.0, 0.0]\n'
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(frames=2, lights=near))
    ps.shoot(scene, tmp_path / "clip")
    plane = ps.read_rig(tmp_path / "clip" / "rig.toml").plane
    assert plane is not None
    assert plane[:3] == (0.0, 0.0, 1.0)
    assert 0.72 < plane[3] < 0.78
    scene.write_text(SCENE.format(frames=2, lights=near.replace("position_m", "direction").replace("0.0]", "1.0]")))
    ps.shoot(scene, tmp_path / "distant")
    assert ps.read_rig(tmp_path / "distant" / "rig.toml").plane is None
    flat = SCENE.replace('view = "perspective"\nfocal_px = 300.0', "width_m = 0.6")
    scene.write_text(flat.format(frames=2, lights=near))
    assert "view = 'perspective'" in ps.shoot(scene, tmp_path / "flat").warnings[0]


@pytest.mark.parametrize("focal", ["[0, 0]", "[0.0, 500.0]", "[500.0, -500.0]"])
def test_a_focal_length_that_is_none_is_refused(focal: str, tmp_path: Path) -> None:
    """Of 0 it was divided by, and a negative one turns the picture over."""
    path = tmp_path / "rig.toml"
    light = '[[light]]\nname = "a"\nposition_m = [0.1, 0.0, 0.0]\n'
    view = f"[camera]\nfocal_px = {focal}\nprincipal_px = [9.5, 9.5]\n"
    path.write_text(f'schema = "psvideo-rig/1"\n{light}{view}')
    with pytest.raises(PsvideoError, match=r"rig\.toml: key 'camera\.focal_px\[\d\]' is .*: expected greater than 0"):
        ps.read_rig(path)
