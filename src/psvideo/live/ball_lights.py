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
from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.showing.smaller import smaller_rig
from psvideo.model.rig import Rig

WHERE = "The live picture"
ELSEWHERE = ("`circle`", "`outline_picture`", "`focal_px`", "`focal_mm`")
"""What calibrating a recording can be given, and its sentences advise."""
ON_A_RECORDING = (
    "What is named here are options of psvideo calibrate mirror-sphere, for a recording of the ball. Live has none of "
    "them: it takes the lens from `rig`."
)
MEASURE = "Measure them by psvideo calibrate flat-field, and name the rig that it writes."


def lights_on_ball(newest: NewestRound, rig: Rig | None) -> MirrorCalibration:
    """Return the lights by their highlights on the mirror sphere that a round shows; the lens is the rig's, if any.

    Raises PsvideoError where no sphere is found, or no light can be measured on it.
    """
    looking = Looking()
    if rig is not None and rig.focal_px is not None:
        lens = smaller_rig(rig, newest.step)
        looking = Looking(focal_px=rig.focal_px[0] / newest.step, principal_px=lens.principal_px)
    return calibrate_lights(sight_spheres([pictures_of_round(newest.round)], looking, where=WHERE))


def with_strengths(found: Rig, named: Rig | None) -> tuple[Rig, str]:
    """Return the lights that a ball showed with all that it does not show, from the rig that was named, and what is to
    be said of their strengths.

    A ball shows directions. Intensities (and for how long each was measured) and colours are the named rig's, by the
    lights' names, and so is the lens, that of the camera's own picture. Near lights have intensities of another kind.
    """
    if named is None:
        return found, f"All lights are taken to be equally strong, as no `rig` is named. {MEASURE}"
    known = {light.name: light for light in named.lights}
    found = replace(found, focal_px=named.focal_px, principal_px=named.principal_px)
    strange = [light.name for light in found.lights if light.name not in known or known[light.name].position_m]
    lights = [
        replace(light, colour=known[light.name].colour) if light.name in known else light for light in found.lights
    ]
    if strange:
        which = f"`rig` has no strength of {', '.join(strange)} for a light that is far away"
        return replace(found, lights=tuple(lights)), f"All lights are taken to be equally strong: {which}. {MEASURE}"
    strong = [
        replace(
            light,
            intensity=known[light.name].intensity,
            reference_duration_s=known[light.name].reference_duration_s,
        )
        for light in lights
    ]
    return replace(found, lights=tuple(strong)), ""


@dataclass(kw_only=True)
class BallLights:
    """Finds lights when somebody asks, beside what else goes on. ``found`` gets the rig, ``words`` say how it went.

    ``rig`` is the one that was named for the run, if any.
    """

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
            words = self._calibrated(newest)
        except PsvideoError as fault:
            words = (str(fault),)
        except Exception as fault:  # nobody waits for this thread but who reads the words
            words = (f"Looking for a chrome ball went wrong, and nothing was changed: {fault!r}.",)
        elsewhere = any(name in word for word in words for name in ELSEWHERE)
        self.words = (*words, ON_A_RECORDING) if elsewhere else words

    def _calibrated(self, newest: NewestRound) -> tuple[str, ...]:
        measured = lights_on_ball(newest, self.rig)
        missing = [f"{light.name}: {light.fault}" for light in measured.lights if light.fault]
        if missing:
            return (*missing, "Nothing was changed: every light must show on the ball.")
        rig, strengths = with_strengths(measured.rig, self.rig)
        kept = self.found(rig)
        each = [f"{one.name}: {_direction(one.direction)} ± {one.error_deg or 0:.1f} degrees" for one in rig.lights]
        return (kept, *filter(None, [strengths]), *each, *measured.warnings)


def _direction(direction: tuple[float, float, float] | None) -> str:
    return "near" if direction is None else ", ".join(f"{axis:+.2f}" for axis in direction)
