"""Rounds of plates in, the surface at every instant out."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from psvideo.model.clipping import at_saturation
from psvideo.model.falloff import Falloff
from psvideo.model.plan import Plan, reference_duration_s
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Surface
from psvideo.plates.align.denoise import Average, averaged
from psvideo.plates.sequence import LightPlate, Round
from psvideo.plates.split import Image
from psvideo.solve.near_surface import NearSurface, solve_near
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.solving import Solving


def lights_as_planned(rig: Rig, plan: Plan) -> tuple[Light, ...]:
    """Return the plan's lights from the rig, their intensities scaled to the plan's full flashes.

    Raises PsvideoError where the rig lacks a light.
    """
    return tuple(_at_full_flash(light, reference_duration_s(plan, light.name)) for light in rig.select(plan.lights))


def _at_full_flash(light: Light, duration_s: float) -> Light:
    """A longer flash than the one a light was measured with gives proportionally more light."""
    if light.reference_duration_s is None:
        return light
    factor = duration_s / light.reference_duration_s
    return replace(
        light,
        intensity=tuple(strength * factor for strength in light.intensity),
        reference_duration_s=duration_s,
    )


@dataclass(frozen=True, kw_only=True)
class Instant:
    """The surface at one instant, and the round of plates that it was solved from."""

    round: Round
    surface: Surface


def surfaces(
    gathered: Iterable[Round],
    plan: Plan,
    rig: Rig,
    *,
    mask: NDArray[np.bool_] | None = None,
    solving: Solving = Solving(),
    near: NearSurface | None = None,
    falloff: Falloff | None = None,
) -> Iterator[Instant]:
    """Solve every round that has a plate of each of the plan's lights; the clip's start and end cut the others.

    ``near`` says where near lights find the surface, ``falloff`` what share of their light arrives where. Raises
    PsvideoError where the rig lacks a light, or its lights give no normals.
    """
    lights = lights_as_planned(rig, plan)
    shares = None if falloff is None else [falloff.field(light.name) for light in lights]
    if shares is not None:
        lights = tuple(_at_least(light, share) for light, share in zip(lights, shares, strict=True))

    def solved(one: Round) -> Instant:
        scaled = [_weaker(light, plate.saturation) for light, plate in zip(lights, one.plates, strict=True)]
        light = partial(illumination, scaled, channels=1 if one.plates[0].image.ndim == 2 else 3)
        whole = all(plate.seen.ndim == 1 for plate in one.plates)
        seen = np.stack([plate.seen if whole else plate.pixels_seen for plate in one.plates])
        plates = [_until_saturation(plate) for plate in one.plates]
        if shares is not None:
            plates = [_evened(plate, share) for plate, share in zip(plates, shares, strict=True)]
        shown = None if seen.all() else seen

        def solve(lit: Illumination) -> Surface:
            return solving.solve(plates, lit, seen=shown, mask=mask)

        if near is None:
            return Instant(round=one, surface=solve(light()))
        surface = solve_near(near.at(one.number), lambda ground: light(ground=ground), solve)
        return Instant(round=one, surface=surface)

    # map and filter hold no round while the next one gathers, as a loop's variable would
    return map(solved, filter(lambda one: one.lights == plan.lights, gathered))


def denoised(instants: Iterable[Instant], results: int) -> Iterator[Instant]:
    """Average every surface with those before it, up to so many ``results``, where nothing moves."""
    average: Average | None = None
    for instant in instants:
        average, surface = averaged(average, instant.surface, results)
        yield replace(instant, surface=surface)
        del instant, surface


def _weaker(light: Light, saturation: float) -> Light:
    """Return a light as the solver is to see it, whose plates are clipped at 1.0."""
    return replace(light, intensity=tuple(strength / saturation for strength in light.intensity))


def _at_least(light: Light, share: NDArray[np.float32]) -> Light:
    """Return a light as strong as where least of it arrives."""
    least = float(share.min())
    return replace(light, intensity=tuple(strength * least for strength in light.intensity))


def _evened(image: Image, share: NDArray[np.float32]) -> Image:
    """Return a plate as if everywhere as little light arrived as where least does; what is clipped stays clipped."""
    factor = share.min() / share
    even = image * (factor if image.ndim == 2 else factor[..., None])
    return np.where(at_saturation(image), image, even).astype(image.dtype, copy=False)


def _until_saturation(plate: LightPlate) -> Image:
    """Return a plate on a scale on which it is clipped at 1.0."""
    return plate.image if plate.saturation == 1.0 else plate.image / np.float32(plate.saturation)
