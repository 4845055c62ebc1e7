"""A scene set up for filming: its bodies, its lights, and pictures of them at any instant.

A scene that stands still is looked at once, and every slot of the plan has one plate. A moving scene is looked at again
for every flash, at the middle of the flash, and for every frame's ambient light, at the middle of the frame.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from psvideo.model.arrays import Image
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.lamps.true_flashes import TrueFlash, row_opens_s
from psvideo.synth.scene import Scene
from psvideo.synth.shotplan import true_plan, true_rig
from psvideo.synth.subject.body import Body, make_body
from psvideo.synth.subject.render import SeenScene, cast_rays
from psvideo.synth.subject.shading import ambient_plate, flash_plate
from psvideo.synth.truth import as_seen


@dataclass(frozen=True, kw_only=True)
class Stage:
    """What stands before the camera. ``still`` is the one view of a scene without motion."""

    scene: Scene
    plan: Plan
    rig: Rig
    bodies: tuple[Body, ...]
    still: SeenScene | None

    def view(self, time_s: float) -> SeenScene:
        """Return what the camera sees at a time on its clock."""
        return self.still or cast_rays(self.bodies, self.scene.camera, self.scene.starts_s + time_s)

    def plate(self, flash: TrueFlash, view: SeenScene) -> Image:
        """Return the scene as one whole flash lights it; averaged over the flash where the scene asks for that."""
        samples = self.scene.motion_samples
        if self.still is not None or samples == 1:
            return self._lit(flash, view)
        instants_s = flash.start_s + flash.duration_s * (np.arange(samples) + 0.5) / samples
        return np.asarray(np.mean([self._lit(flash, self.view(float(t))) for t in instants_s], axis=0), np.float32)

    def _lit(self, flash: TrueFlash, view: SeenScene) -> Image:
        emission = Emission(rise_s=self.plan.rise_s, fall_s=self.plan.fall_s)
        duration_s = self.plan.flashes[flash.slot].duration_s
        return as_seen(flash_plate(view, self.rig, flash.lights, duration_s, emission), self.scene.camera.channels)

    def ambient(self) -> Callable[[int], Image] | None:
        """Return the ambient light of each frame, or None where there is none."""
        table = self.scene.ambient
        if not np.any(table.level):
            return None
        channels = self.scene.camera.channels
        if self.still is not None:
            steady = as_seen(ambient_plate(self.still, table), channels)
            return lambda _: steady
        camera = self.plan.camera
        middle_s = 0.5 * (float(row_opens_s(camera).max()) + camera.exposure_s)
        return lambda n: as_seen(ambient_plate(self.view(n * camera.frame_period_s + middle_s), table), channels)


def set_stage(scene: Scene, folder: Path) -> Stage:
    """Load and place everything. ``folder`` is where the scene's relative paths start."""
    bodies = tuple(make_body(table, folder) for table in scene.object)
    still = None if scene.moves else cast_rays(bodies, scene.camera, 0.0)
    rig = true_rig(scene, _subject_m(scene, bodies))
    return Stage(scene=scene, plan=true_plan(scene), rig=rig, bodies=bodies, still=still)


def _subject_m(scene: Scene, bodies: Sequence[Body]) -> float | None:
    """Return how far before the lens the scene's first body stands, as a tape shows it; None where nobody needs it."""
    if all(light.position_m is None for light in scene.light) or not bodies:
        return None
    depth_m = -cast_rays(bodies[:1], scene.camera, scene.starts_s).hits.point_m[:, 2]
    return float(np.median(depth_m)) if len(depth_m) else None
