"""A short clip of a sphere, filmed by the virtual shoot: what the live chain is tried on."""

from pathlib import Path

from lit_ball import LIT_BALL

from psvideo.synth.shoot import shoot

FRAMES = 110
SCENE = f"""
schema = "psvideo-scene/1"
name = "sphere"
frames = {FRAMES}
seed = 3
[camera]
width_px = 96
height_px = 72
fps = 100
shutter_deg = 360.0
readout_s = 0.01
width_m = 1.6
[strobe]
flash_s = 0.001
clock_offset_ppm = 40.0
{LIT_BALL}"""


def live_clip(folder: Path, *, frames: int = FRAMES) -> Path:
    """Film the sphere into a folder and return the clip."""
    (folder / "scene.toml").write_text(SCENE.replace(f"frames = {FRAMES}", f"frames = {frames}"), encoding="utf-8")
    shoot(folder / "scene.toml", folder / "clip")
    return folder / "clip"
