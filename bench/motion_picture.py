"""Make docs/pictures/motion.png: ``python -m bench.motion_picture``.

The virtual bust under three of its lights, sliding 4 px from flash to flash. Error maps run from 0 (dark) to 10 degrees
(yellow); grey is not valid.
"""

import cv2
import numpy as np

from bench.accuracy_measure import ROOT, angles_deg
from bench.accuracy_motion import PITCH_S, Filmed, shoot
from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.on_screen import normal_colours, srgb
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.sequence import Round
from psvideo.solve.normals.illumination import illumination
from psvideo.synth import read_scene
from psvideo.synth.scene_tables import MotionTable
from psvideo.synth.stage import set_stage

STEP_PX, FULL_DEG, GREY = 4.0, 10.0, 110
LIGHTS = ("key", "left", "right")
SHOWN = slice(20, 340), slice(150, 490)


def main() -> None:
    """Write the picture."""
    clip = sliding_bust()
    before, after = clip.rounds[1], clip.shown(Aligning())[1]
    strips = [
        Strip("Three flashes of one round", [Tile(p.light, srgb(p.image[SHOWN], exposure=1.4)) for p in before.plates])
    ]
    for name, one in (("Solved as they are", before), ("Brought to one instant", after)):
        surface = clip.solved(one)
        error = Tile("error, 0 to 10 degrees", _error_map(clip, one)[SHOWN])
        valid = Tile("valid", np.repeat(surface.valid[..., None], 3, axis=-1)[SHOWN].astype(np.uint8) * 255)
        strips.append(Strip(name, [Tile("normals", normal_colours(surface.normals[SHOWN])), error, valid]))
    picture = sheet(strips, width_px=960)
    cv2.imwrite(str(ROOT / "docs" / "pictures" / "motion.png"), picture[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


def sliding_bust() -> Filmed:
    """Film the bust of data_synth/bust.toml sliding to the right, with hardly any noise."""
    scene = read_scene(ROOT / "data_synth" / "bust.toml")
    step_m = STEP_PX * 0.70 / 640
    motion = MotionTable(velocity_m_per_s=[0.98 * step_m / PITCH_S, 0.2 * step_m / PITCH_S, 0.0])
    moving = scene.object[0].model_copy(update={"motion": motion})
    scene = scene.model_copy(update={"object": [moving, *scene.object[1:]]})
    stage = set_stage(scene, ROOT / "data_synth")
    chosen = [light for light in stage.rig.lights if light.name in LIGHTS]
    return Filmed(rounds=shoot(stage, LIGHTS, noise=0.001), lit=illumination(chosen, channels=3), stage=stage)


def _error_map(clip: Filmed, one: Round) -> np.ndarray:
    surface = clip.solved(one)
    normals, _ = clip.truth(one.time_s)
    chosen = surface.valid & (np.linalg.norm(normals, axis=-1) > 0.5)
    errors = np.zeros(chosen.shape)
    errors[chosen] = angles_deg(surface.normals[chosen], normals[chosen])
    codes = (np.clip(errors / FULL_DEG, 0, 1) * 255).astype(np.uint8)
    coloured = cv2.applyColorMap(codes, cv2.COLORMAP_INFERNO)[..., ::-1]
    return np.where(chosen[..., None], coloured, np.uint8(GREY)).astype(np.uint8)


if __name__ == "__main__":
    main()
