"""What is measured on mirror spheres: every light, what it rests on, and the rig that it makes."""

from dataclasses import dataclass

from psvideo.calibrate.mirror.law import Ray
from psvideo.calibrate.mirror.sighting import Sighting
from psvideo.model.arrays import Doubles
from psvideo.model.rig import Light, Rig


@dataclass(frozen=True, kw_only=True)
class MeasuredLight:
    """What is known of one light: a direction with its standard error, and a position where rays could be crossed.

    ``error_deg`` is the root mean square angle. ``fault`` says why the light is left out of the rig.
    """

    name: str
    rays: tuple[Ray, ...] = ()
    direction: Doubles | None = None
    error_deg: float = 0.0
    position_m: Doubles | None = None
    position_error_m: float = 0.0
    fault: str = ""


@dataclass(frozen=True, kw_only=True)
class MirrorCalibration:
    """The lights measured on mirror spheres, the sightings that they rest on, and what is to be distrusted."""

    lights: tuple[MeasuredLight, ...]
    sightings: tuple[Sighting, ...]
    warnings: tuple[str, ...]

    @property
    def rig(self) -> Rig:
        """The rig of the lights that could be measured."""
        view = self.sightings[0].outline.view
        focal = None if view.focal_px is None else (view.focal_px, view.focal_px)
        return Rig(
            lights=tuple(_as_light(light) for light in self.lights if not light.fault),
            focal_px=focal,
            principal_px=None if focal is None else view.principal_px,
        )


def _as_light(light: MeasuredLight) -> Light:
    error_deg = round(light.error_deg, 3)
    if light.position_m is not None:
        x, y, z = (round(float(value), 5) for value in light.position_m)
        return Light(name=light.name, position_m=(x, y, z), error_deg=error_deg)
    if light.direction is None:
        raise ValueError(f"light {light.name!r} has no direction")
    across, up, towards = (float(value) for value in light.direction)
    return Light(name=light.name, direction=(across, up, towards), error_deg=error_deg)
