"""Lights found live on a chrome ball: one click on the page, and the newest round says where they are."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from psvideo.calibrate.light_pictures import pictures_of_round
from psvideo.calibrate.mirror.lights import calibrate_lights
from psvideo.calibrate.mirror.measured import MirrorCalibration
from psvideo.calibrate.mirror.sighting import sight_spheres
from psvideo.calibrate.sphere.sphere_view import Looking
from psvideo.compute.side_threads import run_beside
from psvideo.errors import PsvideoError
from psvideo.live.chain import NewestRound
from psvideo.live.showing.smaller import smaller_rig
from psvideo.model.rig import Rig

WHERE = "The live picture"


def lights_on_ball(newest: NewestRound, rig: Rig | None) -> MirrorCalibration:
    """Return the lights by their highlights on the mirror sphere that a round shows; the lens is the rig's, if any.

    Raises PsvideoError where no sphere is found, or no light can be measured on it.
    """
    looking = Looking()
    if rig is not None and rig.focal_px is not None:
        lens = smaller_rig(rig, newest.step)
        looking = Looking(focal_px=rig.focal_px[0] / newest.step, principal_px=lens.principal_px)
    return calibrate_lights(sight_spheres([pictures_of_round(newest.round)], looking, where=WHERE))


@dataclass(kw_only=True)
class BallLights:
    """Finds lights when somebody asks, beside what else goes on. ``found`` gets the rig, ``words`` say how it went."""

    rig: Rig | None
    found: Callable[[Rig], str]
    words: tuple[str, ...] = ()
    _asked: threading.Event = field(default_factory=threading.Event)

    def ask(self) -> None:
        """Have the next round looked at."""
        self.words = ("Looking for a chrome ball in the next round.",)
        self._asked.set()

    def look(self, newest: NewestRound) -> None:
        """Look at a round where somebody asked; in a thread of its own, as it takes a second or two."""
        if not self._asked.is_set():
            return
        self._asked.clear()
        run_beside(partial(self.calibrate, newest), name="psvideo ball")

    def calibrate(self, newest: NewestRound) -> None:
        """Find the lights that a round shows, and hand them on; what goes wrong is a sentence."""
        try:
            measured = lights_on_ball(newest, self.rig)
            before = self.rig
            rig = measured.rig
            if before is not None:  # the lens is that of the camera's own picture
                rig = replace(rig, focal_px=before.focal_px, principal_px=before.principal_px)
            missing = [f"{light.name}: {light.fault}" for light in measured.lights if light.fault]
            if missing:
                self.words = (*missing, "Nothing was changed: every light must show on the ball.")
                return
            kept = self.found(rig)
        except PsvideoError as fault:
            self.words = (str(fault),)
            return
        self.rig = rig
        each = [f"{one.name}: {_direction(one.direction)} ± {one.error_deg or 0:.1f} degrees" for one in rig.lights]
        self.words = (kept, *each, *measured.warnings)


def _direction(direction: tuple[float, float, float] | None) -> str:
    return "near" if direction is None else ", ".join(f"{axis:+.2f}" for axis in direction)
