"""What rows that split a flash between two frames say of the curve by which light was read."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class HalfFlash:
    """``share`` is how bright half of a flash looks against all of it: 0.5 in linear light."""

    share: float

    @property
    def found(self) -> str:
        """What was seen, and what it means."""
        return (
            f"Rows that saw half of a flash look {100 * self.share:.0f} % as bright as rows that saw all of it, and "
            "should look 50 %: the files are coded by another curve than the plan's, or by another black level. That "
            "tilts all normals, and looks like motion."
        )

    @property
    def advice(self) -> str:
        """What to change."""
        curve = (
            "a gamma or logarithmic curve (rec709, srgb, slog3, ...), where the plan's is straighter"
            if self.share > 0.5
            else "linear light, or a straighter curve than the plan's"
        )
        return f"Write the camera's own curve into the plan's [camera], transfer: it is likely {curve}."

    @property
    def sentence(self) -> str:
        """What was seen, and what to do about it."""
        return f"{self.found} {self.advice}"
