"""A camera in a USD file: where it stands at any moment, in the stage's own axes and unit.

A USD camera looks along its -z with y up and x to the right, which is psvideo's camera frame: its local-to-world
transform (OpenUSD, UsdGeomXformable) is camera-to-world as it is. usd-core is optional and imported only here and where
USD is written.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from psvideo.errors import PsvideoError
from psvideo.export.sequences.tags import sha256_of
from psvideo.export.usd import require_usd
from psvideo.export.usd.pose import Pose, pose_of

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
UpAxis = Literal["y", "z"]
CODE_TOLERANCE = 1.0
"""Time codes by which an instant may lie before or after the camera's animation: it is held still there."""


@dataclass(frozen=True, kw_only=True)
class UsdCamera:
    """One camera prim of a stage.

    ``unit_m`` is the stage's metersPerUnit, ``up`` its upAxis. ``codes`` are the first and last time code of the
    camera's animation, None where it stands still, and ``codes_per_s`` how many of them pass in a second. ``lens`` is
    the focal length over the picture's width, as the animation begins; None where the view has none.
    """

    path: Path
    prim: str
    sha256: str
    unit_m: float
    up: UpAxis
    codes: tuple[float, float] | None
    codes_per_s: float
    lens: float | None
    stage: Any = field(repr=False, compare=False)

    def pose(self, code: float) -> Pose:
        """Return where the camera stands at a time code; raises PsvideoError outside its animation."""
        from pxr import UsdGeom

        if self.codes and not self.codes[0] - CODE_TOLERANCE <= code <= self.codes[1] + CODE_TOLERANCE:
            raise PsvideoError(
                f"{self.path}: the camera {self.prim} moves from time code {self.codes[0]:g} to {self.codes[1]:g}, and "
                f"the clip needs it at {code:.6g}. Say with `camera_time` how time codes count (frames of the clip, "
                "numbers of the results, or seconds), export the whole range, or use fewer frames with `frames`."
            )
        held = min(max(code, self.codes[0]), self.codes[1]) if self.codes else 0.0
        prim = UsdGeom.Xformable(self.stage.GetPrimAtPath(self.prim))
        matrix = np.array(prim.ComputeLocalToWorldTransform(held), np.float64).T
        return pose_of(matrix, source=f"{self.path}: camera {self.prim} at time code {held:g}")


def open_usd_camera(path: Path, name: str | None = None) -> UsdCamera:
    """Open a USD file's camera: the one named (its prim's path, or the last part of it), or the only one.

    Raises PsvideoError where the file is no stage, holds no camera, or several of which none is named.
    """
    require_usd("`camera_to_world` with a USD file", otherwise="a text file with the matrix")
    from pxr import Tf, Usd, UsdGeom

    if not path.is_file():
        raise PsvideoError(f"{path}: is not a file. Name the USD file that holds the camera.")
    try:
        stage = Usd.Stage.Open(str(path.resolve()))
    except Tf.ErrorException as fault:
        raise PsvideoError(
            f"{path}: cannot be read as USD ({str(fault).strip().splitlines()[-1].strip()}). Export the camera again."
        ) from None
    found = [str(prim.GetPath()) for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    chosen = _chosen(path, found, name)
    codes = _animated(stage, chosen)
    return UsdCamera(
        path=path,
        prim=chosen,
        sha256=sha256_of(path),
        unit_m=float(UsdGeom.GetStageMetersPerUnit(stage)),
        up="z" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else "y",
        codes=codes,
        codes_per_s=float(stage.GetTimeCodesPerSecond()),
        lens=_lens(stage, chosen, codes),
        stage=stage,
    )


def _chosen(path: Path, found: list[str], name: str | None) -> str:
    if not found:
        raise PsvideoError(f"{path}: holds no camera. Export the stage with its camera, or name another file.")
    listed = ", ".join(found[:8]) + (", ..." if len(found) > 8 else "")
    if name is None:
        if len(found) > 1:
            raise PsvideoError(f"{path}: holds {len(found)} cameras ({listed}). Name one with `camera`.")
        return found[0]
    fitting = [prim for prim in found if name == prim or prim.endswith("/" + name.lstrip("/"))]
    if len(fitting) != 1:
        many = "no camera" if not fitting else f"{len(fitting)} cameras"
        raise PsvideoError(f"{path}: holds {many} named {name!r}; it has {listed}. Give the prim's whole path.")
    return fitting[0]


def _animated(stage: Any, prim: str) -> tuple[float, float] | None:
    """Return the first and last time sample of a prim's transform and those above it, None where it stands still."""
    from pxr import UsdGeom

    samples: set[float] = set()
    at = stage.GetPrimAtPath(prim)
    while at and not at.IsPseudoRoot():
        samples.update(UsdGeom.Xformable(at).GetTimeSamples() if at.IsA(UsdGeom.Xformable) else ())
        at = at.GetParent()
    return (min(samples), max(samples)) if len(samples) > 1 else None


def _lens(stage: Any, prim: str, codes: tuple[float, float] | None) -> float | None:
    """Return a camera's focal length over its aperture's width, both in the same unit (a tenth of the stage's)."""
    from pxr import UsdGeom

    camera = UsdGeom.Camera(stage.GetPrimAtPath(prim)).GetCamera(codes[0] if codes else 0.0)
    if camera.projection != camera.Perspective or camera.horizontalAperture <= 0:
        return None
    return float(camera.focalLength / camera.horizontalAperture)
