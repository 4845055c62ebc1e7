"""A light's intensity, scaled to what plates show: a plan's full flash, a plate's saturation, what least arrives.

Every step here comes in a pair: what is done to a light is done to its plates, so that
``plate = albedo * intensity * max(0, n . direction)`` holds before and after.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Image
from psvideo.model.plan import Plan, reference_duration_s
from psvideo.model.rig import Light, Rig
from psvideo.model.rows.clipping import at_saturation

CHANNELS = 3


def measured_duration_s(light: Light, plan: Plan) -> float:
    """Return the flash for which a light's intensity holds: the rig's, or the plan's full flash where it names none."""
    return light.reference_duration_s or reference_duration_s(plan, light.name)


def lights_as_planned(rig: Rig, plan: Plan) -> tuple[Light, ...]:
    """Return the plan's lights from the rig, their intensities scaled to the plan's full flashes.

    Raises PsvideoError where the rig lacks a light.
    """
    return tuple(_at_full_flash(light, reference_duration_s(plan, light.name)) for light in rig.select(plan.lights))


def _at_full_flash(light: Light, duration_s: float) -> Light:
    """A longer flash than the one a light was measured with gives proportionally more light."""
    if light.reference_duration_s is None:
        return light
    return replace(_times(light, duration_s / light.reference_duration_s), reference_duration_s=duration_s)


def with_measured(light: Light, seen: Sequence[float], *, flash_s: float | None, coloured: bool) -> Light:
    """Return a light as it was measured, in place of what was known of its strength: ``seen`` by every channel.

    ``flash_s`` is for how long it shone, None where that is not known. A ``coloured`` light keeps a colour, whose
    brightest channel is 1 and has the intensity; it takes three channels.
    """
    measured = replace(light, reference_duration_s=flash_s, colour=None)
    if not coloured or len(seen) != CHANNELS:
        return replace(measured, intensity=tuple(float(f"{value:.6g}") for value in seen))
    most = max(seen)
    red, green, blue = (float(f"{value / most:.5g}") for value in seen)
    return replace(measured, intensity=(float(f"{most:.6g}"),), colour=(red, green, blue))


def per_saturation(light: Light, saturation: float) -> Light:
    """Return a light as plates show it that ``image_per_saturation`` gives."""
    return light if saturation == 1.0 else replace(light, intensity=tuple(one / saturation for one in light.intensity))


def image_per_saturation(image: Image, saturation: float) -> Image:
    """Return a plate on a scale on which it is clipped at 1.0."""
    return image if saturation == 1.0 else image / np.float32(saturation)


def where_least_arrives(light: Light, share: Image) -> Light:
    """Return a light as strong as where least of it arrives; ``share`` (row, col) is what arrives."""
    return _times(light, float(share.min()))


def image_evened(image: Image, share: Image) -> Image:
    """Return a plate as if everywhere as little light arrived as where least does; what is clipped stays clipped."""
    factor = share.min() / share
    even = image * (factor if image.ndim == 2 else factor[..., None])
    return np.where(at_saturation(image), image, even).astype(image.dtype, copy=False)


def _times(light: Light, factor: float) -> Light:
    return replace(light, intensity=tuple(strength * factor for strength in light.intensity))
