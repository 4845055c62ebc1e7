"""The plates of all lights as a body is fitted to them: small pictures, smoothed, with their lights and their times."""

from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Flags, Floats
from psvideo.plates.align.by_surface import BySurface
from psvideo.plates.align.rigid.near_plates import DOWN, NearPlates
from psvideo.plates.align.rigid.rigid_motion import Pixels, RigidMotion
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.brightness import EVERY_CODE, light_of


@dataclass(frozen=True, kw_only=True)
class PlatesSeen:
    """What the plates of all lights show, ``pictures`` (plate, row, col, 3): light, and how much it grows to the right
    and down; ``spans_s`` (plate,), the times from them to the instant, below 0 where they come after it; and ``lamps``
    (plate, 3), how they light a normal times albedo along right, down and near; of ``near`` lights in the middle. A
    light under which nothing moves has one plate, at the instant."""

    pictures: Floats
    spans_s: Doubles
    lamps: Doubles
    near: NearPlates | None = None

    @classmethod
    def of(cls, surface: BySurface, lights: AllLights, smooth_px: float) -> "PlatesSeen":
        """Return the plates of all lights, smoothed, of as many pixels as there are velocities."""
        table = light_of(EVERY_CODE)
        plates = [(light, plate) for light in range(len(surface.places)) for plate in surface.plates(lights, light)]
        pictures = np.empty((len(plates), *lights.shape, 3), np.float32)

        def show(number: int, _: int) -> None:
            small = cv2.resize(plates[number][1].codes, lights.shape[::-1], interpolation=cv2.INTER_AREA)
            light = cv2.GaussianBlur(np.asarray(cv2.LUT(small, table), np.float32), (0, 0), smooth_px)
            pictures[number, ..., 0] = light
            for plane, axis in ((1, (1, 0)), (2, (0, 1))):
                pictures[number, ..., plane] = cv2.Sobel(light, cv2.CV_32F, *axis, ksize=3, scale=1 / 8)

        over_ranges(show, len(plates), each=1)
        return cls(
            pictures=pictures,
            spans_s=np.array([plate.span_s for _, plate in plates]),
            lamps=np.stack([surface.matrix[light] * DOWN for light, _ in plates]),
            near=NearPlates.of(surface.lamps, surface.matrix, [light for light, _ in plates], lights.shape),
        )

    @property
    def at_rest(self) -> Floats:
        """The times to the instant and how plates light a normal that does not turn, (plate, 4 or more)."""
        return self._turned(np.broadcast_to(np.eye(3), (len(self.lamps), 3, 3)))

    def turned(self, motion: RigidMotion) -> Floats:
        """Return the times to the instant and how plates light a body's normals at the instant, (plate, 4 or more): as
        the body turned on since then, it is as if lights had. Beyond four columns stands where near lights are."""
        return self._turned(np.stack([cv2.Rodrigues(motion.spin * span_s)[0] for span_s in self.spans_s]))

    def _turned(self, turns: Doubles) -> Floats:
        lamps = np.stack([turn @ lamp for turn, lamp in zip(turns, self.lamps, strict=True)])
        told = np.concatenate([self.spans_s[:, None], lamps], axis=1).astype(np.float32)
        return told if self.near is None else np.concatenate([told, self.near.turned(turns)], axis=1)

    def above(self, near: Floats, where: Pixels | Flags) -> Floats:
        """Return how much nearer than the ground's middle some pixels are that are so ``near`` the ground, (point,)."""
        return near if self.near is None else near + self.near.rise[where]
