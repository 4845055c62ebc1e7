"""The beauty plate: the scene under all lights of a round at once, each as strong as wished, ambient off or on."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from psvideo.errors import UsageError, nearest
from psvideo.model.plan import Plan
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import AMBIENT, Round

BEAUTY = "beauty"


@dataclass(frozen=True, kw_only=True)
class Mix:
    """How strong each light is in the sum: ``weights`` by name, 1 where not named, and 0 for ``ambient``."""

    weights: tuple[tuple[str, float], ...] = ()

    def of(self, light: str) -> float:
        """Return a light's weight."""
        return dict(self.weights).get(light, 0.0 if light == AMBIENT else 1.0)

    def check(self, plan: Plan) -> None:
        """Raise UsageError where a weight's light is not in the plan, or ambient light was never seen alone."""
        known = (*plan.lights, AMBIENT)
        for light, _ in self.weights:
            if light not in known:
                raise UsageError(f"`weight` {light}: the plan has no such light; {nearest(light, known)}")
        if self.of(AMBIENT) and all(not flash.is_dark for flash in plan.flashes):
            raise UsageError(
                "`with_ambient`: the plan has no dark slot, so that ambient light was never seen alone; it is in every "
                "plate already. Leave the option out."
            )


def mix_of(weights: Mapping[str, float], *, with_ambient: bool) -> Mix:
    """Return the mix of weights by light, 0 or more, and of ambient light as one exposure saw it.

    Raises UsageError where a weight is no such number.
    """
    found = {AMBIENT: 1.0} if with_ambient else {}
    for light, weight in weights.items():
        if not np.isfinite(weight) or weight < 0:
            raise UsageError(f"`weight` of {light}, {weight:g}: expected how strong it is to be, 0 or more.")
        found[light] = float(weight)
    return Mix(weights=tuple(sorted(found.items())))


def beauty_of(one: Round, mix: Mix, ambient: LightPlate | None = None) -> LightPlate:
    """Return the sum of a round's plates and, where the mix asks for it, of what one exposure saw of ambient light.

    ``ambient`` is the latest that was seen, where the round has no dark slot of its own. What motion hides in a plate
    is not seen in the sum, which shows the best guess there; rows that no frame saw are 0. A pixel that is clipped in a
    light is at least as bright as the sum says.
    """
    parts: Mapping[str, LightPlate | None] = {plate.light: plate for plate in one.open_plates or one.plates} | {
        AMBIENT: one.ambient or ambient
    }
    used = [(plate, mix.of(name)) for name, plate in parts.items() if plate is not None and mix.of(name)]
    image = np.zeros(one.plates[0].shape, np.float32)
    for plate, weight in used:
        image += np.float32(weight) * plate.image
    by_row = all(plate.seen.ndim == 1 for plate, _ in used)
    known = [plate.seen if by_row else plate.pixels_seen for plate, _ in used]
    seen = np.all(known, axis=0) if used else np.ones(image.shape[0], np.bool_)
    for plate, _ in used:
        image[~np.broadcast_to(plate.lines_seen, image.shape[:2])] = 0
    return LightPlate(light=BEAUTY, number=one.number, time_s=one.time_s, picture=mixture_of(image), seen=seen)
