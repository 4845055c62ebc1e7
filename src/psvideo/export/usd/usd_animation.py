"""An animated mesh as USD: one prim whose points and triangles change over time.

usd-core (Pixar's OpenUSD, Tomorrow Open Source Technology Licence 1.0, which is Apache 2.0 with other words on
trademarks) is an optional part of the installation and is imported only when something is written.
"""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from psvideo import __version__
from psvideo.export.mesh_files import read_part
from psvideo.export.space import CAMERA_SPACE, Space
from psvideo.formats.whole_files import whole_file
from psvideo.solve.depth.mesh import Mesh

PRIM = "/surface"


def write_animation(
    path: Path, parts: Mapping[int, Path], fps: Fraction, *, metric: bool, space: Space = CAMERA_SPACE
) -> None:
    """Write the meshes kept in ``parts``, by number, as one animated USD file, whole or not at all.

    Time codes are the numbers, so that frame 1001 of the stage is number 1001 of the pictures. The up axis and unit
    are those of ``space``, in which the parts are (the camera's: y up, one unit a metre); ``metric`` False notes in the
    layer's data that the scale is relative. Colours are linear (displayColor), and triangles are used as they are (no
    subdivision). Instants are written one by one: memory holds one mesh.
    """
    from pxr import Usd

    with whole_file(path) as beside:
        named = beside.with_name(f"{beside.name}.usdc")  # USD knows a file's kind by its ending
        try:
            stage = Usd.Stage.CreateNew(str(named))
            stage.GetRootLayer().customLayerData = {"psvideo:version": __version__, "psvideo:metric": metric}
            stage.SetStartTimeCode(min(parts))
            stage.SetEndTimeCode(max(parts))
            stage.SetTimeCodesPerSecond(float(fps))
            stage.SetFramesPerSecond(float(fps))
            prim = _prim(stage, space)
            for number, part in sorted(parts.items()):
                _sample(prim, read_part(part), number)
                stage.Save()  # frees what this instant held
            del prim, stage
            named.replace(beside)
        finally:
            named.unlink(missing_ok=True)


def _prim(stage: Any, space: Space) -> Any:
    """Return the stage's one mesh, with all that does not change over time."""
    from pxr import Sdf, UsdGeom

    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z if space.up == "z" else UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, space.unit_m)
    prim = UsdGeom.Mesh.Define(stage, PRIM)
    stage.SetDefaultPrim(prim.GetPrim())
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateDoubleSidedAttr(True)
    prim.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    colours = UsdGeom.PrimvarsAPI(prim)
    colours.CreatePrimvar("displayColor", Sdf.ValueTypeNames.Color3fArray, UsdGeom.Tokens.vertex)
    colours.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
    return prim


def _sample(prim: Any, mesh: Mesh, number: int) -> None:
    """Set the mesh of one instant."""
    from pxr import UsdGeom, Vt

    ends = np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)]) if len(mesh.points) else np.zeros((2, 3))
    counts = np.full(len(mesh.triangles), 3, np.int32)
    vectors = [
        (prim.GetPointsAttr(), mesh.points),
        (prim.GetNormalsAttr(), mesh.normals),
        (prim.GetDisplayColorAttr(), mesh.colours),
        (prim.GetExtentAttr(), ends.astype(np.float32)),
    ]
    for attribute, values in vectors:
        attribute.Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values)), float(number))
    places = UsdGeom.PrimvarsAPI(prim).GetPrimvar("st")
    places.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(mesh.places)), float(number))
    prim.GetFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(mesh.triangles.reshape(-1)), float(number))
    prim.GetFaceVertexCountsAttr().Set(Vt.IntArray.FromNumpy(counts), float(number))
