"""Light that grows and shrinks in a clip though nothing asked it to: by how much, and whose doing it seems to be."""

from dataclasses import dataclass
from typing import Literal

Cause = Literal["camera", "lamps", "either"]

CAMERA = "the camera seems to have set its exposure or gain by itself"
FIXED = "Film with exposure, gain and white balance fixed."
SUPPLY = "Check their drivers and supply, and that no dimmer (PWM) is in their lines."


@dataclass(frozen=True, kw_only=True)
class Swing:
    """Light that grows and shrinks from picture to picture.

    ``share`` is by how much the larger gains exceed the smaller ones. ``cause``: the ``camera`` where whole frames
    change, the ``lamps`` where flashes do, each by its own gain in all frames that saw it; ``either`` where both
    explain the pictures.
    """

    share: float
    cause: Cause

    @property
    def found(self) -> str:
        """What was seen, and the likeliest cause first."""
        by = f"by {100 * self.share:.0f} %"
        if self.cause == "lamps":
            return f"Flashes give more and less light, {by}, each in all frames that saw it: the lamps, not the camera."
        compared = "Plates of different moments cannot be compared."
        if self.cause == "camera":
            return f"Whole frames grow brighter and darker {by}: {CAMERA}. {compared}"
        return (
            f"Light grows and shrinks {by}: {CAMERA}, the lamps' supply changes, or something bright comes or goes. "
            f"{compared}"
        )

    @property
    def advice(self) -> str:
        """What to change on the set."""
        return {"camera": FIXED, "lamps": SUPPLY, "either": f"{FIXED} Then check the lamps' supply."}[self.cause]

    @property
    def sentence(self) -> str:
        """What was seen, and what to do about it."""
        return f"{self.found} {self.advice}"
