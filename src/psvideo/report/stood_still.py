"""Whether lights moved or changed between one calibration and the next, given the errors of both."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from psvideo.report.rigs_report import LightOfTake, RigResult

SURE = 3.0
"""Standard errors of the difference beyond which a light is said to have changed. An error of a direction is the root
mean square angle: chance alone exceeds this many once in 8,000 (Rayleigh), and an intensity's once in 370."""


def changes(results: Sequence[RigResult]) -> tuple[RigResult, ...]:
    """Return takes, in the order in which they were shot, with what changed in each among its findings.

    A light is compared with the first take since it changed last, so that slow drift adds up until it shows.
    """
    stood: dict[str, tuple[RigResult, LightOfTake]] = {}
    shone: dict[str, tuple[RigResult, LightOfTake]] = {}
    return tuple(replace(one, findings=(*one.findings, *_changes(one, stood, shone))) for one in results)


def _changes(
    one: RigResult,
    stood: dict[str, tuple[RigResult, LightOfTake]],
    shone: dict[str, tuple[RigResult, LightOfTake]],
) -> Iterator[str]:
    """Give what changed in a take, and note it as what later ones are compared with."""
    for light in one.lights:
        if light.direction is not None and light.error_deg is not None:
            before, then = stood.setdefault(light.name, (one, light))
            apart_deg, error_deg = _apart_deg(light, then), np.hypot(light.error_deg, then.error_deg or 0.0)
            if apart_deg > SURE * error_deg:
                stood[light.name] = one, light
                yield (
                    f"Light {light.name!r} stands {apart_deg:.1f} degrees (± {error_deg:.2g}) from where it stood in "
                    f"{before.take.name}: it was moved, or the camera was. Use this rig from here on."
                )
        if light.intensity and light.intensity_error is not None:
            before, then = shone.setdefault(light.name, (one, light))
            ratio = light.intensity / (then.intensity or 1.0)
            error = float(np.hypot(light.intensity_error, then.intensity_error or 0.0))
            if abs(np.log(ratio)) > SURE * error:
                shone[light.name] = one, light
                yield (
                    f"Light {light.name!r} shines {ratio:.3g} times as bright (± {error:.1%}) "
                    f"as in {before.take.name}: its power, its lamp or the aperture changed. Use this rig from here on."
                )


def _apart_deg(one: LightOfTake, other: LightOfTake) -> float:
    both = np.array([one.direction, other.direction], np.float64)
    across = float(np.linalg.norm(np.cross(both[0], both[1])))
    return float(np.degrees(np.arctan2(across, both[0] @ both[1])))
