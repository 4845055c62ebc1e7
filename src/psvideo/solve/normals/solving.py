"""Which solver a run uses, and what it is asked for: chosen once, carried to every round."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from psvideo.model.choices import Solver
from psvideo.model.surface import Surface
from psvideo.plates.mixture import Mixture
from psvideo.solve.normals import robust, woodham1980
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.task import Mask, Samples

Method = Literal["least-squares", "robust"]
ROBUST_FROM_LIGHTS = 5
"""With five lights a highlight and a shadow can both be seen; with fewer there is nothing to weigh."""


@dataclass(frozen=True, kw_only=True)
class Solving:
    """``solver`` "auto" is robust from ROBUST_FROM_LIGHTS lights on. ``half`` gives half floats; ``residual`` and
    ``error`` ask for what the surface may hold as well (only the robust solver predicts an error)."""

    solver: Solver = "auto"
    half: bool = False
    residual: bool = False
    error: bool = False

    def method(self, lights: int) -> Method:
        """Return the solver for so many lights."""
        if self.solver == "auto":
            return "robust" if lights >= ROBUST_FROM_LIGHTS else "least-squares"
        return self.solver

    def solve(
        self,
        plates: Sequence[Samples] | Sequence[Mixture],
        lit: Illumination,
        *,
        seen: Mask | None = None,
        mask: Mask | None = None,
    ) -> Surface:
        """Return the surface that explains one plate per light; see the solvers for the arguments."""
        if self.method(len(plates)) == "robust":
            return robust.solve(
                plates, lit, seen=seen, mask=mask, half=self.half, residual=self.residual, error=self.error
            )
        return woodham1980.solve(plates, lit, seen=seen, mask=mask, half=self.half, residual=self.residual)


def trust_note(method: Method, lights: int) -> str:
    """Return in one sentence what a valid normal of this solver and so many lights can be relied on for."""
    if lights == 3:
        return (
            "Three lights explain any three brightnesses exactly: a valid normal is one that no light leaves in shadow "
            "and none saturates, and highlights, soft shadows or light from neighbouring surfaces cannot be seen."
        )
    if method == "least-squares":
        return (
            "Least squares takes the surface as matte: shadow and saturation are left out, and a highlight turns the "
            "normal towards it though it stays valid. The residual shows where that may be."
        )
    if lights == 4:
        return (
            "Of four lights that contradict each other the likeliest highlight is left out; where a shadow or a second "
            "highlight spoils another, it is not seen."
        )
    how = robust.Reweighting()
    return (
        "Highlights and shadows weigh little, and a normal is valid where its predicted standard error is at most "
        f"{how.most_error_deg:g} degrees, or {how.beside_typical:g} times what is typical of the picture where that is "
        "more. So a rig that is wrong makes no pixel invalid: the judgement of the rig speaks of it. Where only three "
        "measurements are usable nothing is checked."
    )
