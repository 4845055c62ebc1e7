"""A USD stage beside a delivery: camera, lights, card or mesh, and a material with the image sequences.

Text (usda), so that it needs no library. Under ``/delivery/shot``, which stands where the camera stands, everything is
in the camera's frame: camera, lights, and a card that fills its view. The material is a Lambert surface twice:
UsdPreviewSurface (specification 2.6: ``normal`` in tangent space, which of the card is the camera's frame) and
MaterialX (standard_surface, normals turned from the card's frame, or world normals as they are). A mesh, where there is
one, takes the card's place and brings its own normals. Time codes are the results' numbers.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.export.mesh_files import animation_name
from psvideo.export.programs.delivered import Delivered, SeenLight
from psvideo.export.usd.usd_material import MATERIAL, material
from psvideo.export.usd.usda import asset, identifiers, indented, matrix_of, numbers_of, prim
from psvideo.model.arrays import Doubles
from psvideo.model.rig import Light

CARD_M = 1.0
"""How far before the camera the card stands where no depth is known; only its angular size shows."""
APERTURE_M = 0.036
"""Width of the sensor in the camera prim; only its ratio to the focal length shows."""
TENTHS = 10
"""Lenses and apertures count in tenths of the stage's unit (UsdGeomCamera)."""
WHITE = math.pi
"""Irradiance under which a white matte surface that faces the light shows 1."""


@dataclass(frozen=True, kw_only=True)
class StageView:
    """The camera of a stage, and the lights as it sees them.

    ``focal`` and ``middle`` (right, up) are in widths of the picture, ``middle`` being where the optical axis meets it
    from its centre; ``focal`` None is an orthographic view. ``pixel_height`` is in widths of a pixel: other than 1 of
    anamorphic lenses, and a little of calibrated ones. ``away_m`` is how far the subject is. ``poses`` are
    camera-to-world matrices (4, 4) by number, one where it stands still, none in camera space. ``near`` are lights with
    a position, each with its axis where that is known, ``lights`` the others; both in the camera's frame.
    """

    focal: float | None
    middle: tuple[float, float]
    away_m: float | None
    poses: Mapping[int, Doubles]
    lights: Sequence[SeenLight]
    near: Sequence[Light] = ()
    pixel_height: float = 1.0


def stage_name(clip: str) -> str:
    """Return the stage's name in the output folder."""
    return f"{clip}.usda"


def stage_text(made: Delivered, numbers: Sequence[int], view: StageView) -> str:
    """Return the stage of one delivery. Files are named from where it lies, so that the folder moves as a whole."""
    space = made.delivery.space
    mesh = "usd" in made.delivery.meshes
    names = identifiers([*(one.name for one in view.lights), *(one.name for one in view.near)])
    lights = [
        *map(_sun, view.lights, names),
        *(_lamp(one, name, space.unit_m) for one, name in zip(view.near, names[len(view.lights) :], strict=True)),
    ]
    return "\n".join(
        [
            "#usda 1.0",
            "(",
            '    defaultPrim = "delivery"',
            f"    metersPerUnit = {space.unit_m:.9g}",
            f'    upAxis = "{space.up.upper()}"',
            f"    startTimeCode = {numbers[0]}",
            f"    endTimeCode = {numbers[-1]}",
            f"    timeCodesPerSecond = {float(made.fps):.9g}",
            f"    framesPerSecond = {float(made.fps):.9g}",
            ")",
            "",
            'def Xform "delivery" (',
            '    kind = "component"',
            ")",
            "{",
            *indented(_shot(made, view, lights, card=not mesh)),
            *indented(_mesh(made) if mesh else []),
            *indented(material(made, numbers, with_normals=not mesh)),
            "}",
            "",
        ]
    )


def _shot(made: Delivered, view: StageView, lights: Sequence[Sequence[str]], *, card: bool) -> list[str]:
    place: list[str] = []
    if len(view.poses) > 1:
        samples = [f"    {number}: {matrix_of(pose)}," for number, pose in sorted(view.poses.items())]
        place = ["matrix4d xformOp:transform.timeSamples = {", *samples, "}"]
    elif view.poses:
        place = [f"matrix4d xformOp:transform = {matrix_of(next(iter(view.poses.values())))}"]
    order = ['uniform token[] xformOpOrder = ["xformOp:transform"]'] if place else []
    inner = [_camera(made, view), prim('def Scope "lights"', *lights), *([_card(made, view)] if card else [])]
    return prim('def Xform "shot"', place, order, *inner)


def _camera(made: Delivered, view: StageView) -> list[str]:
    unit = made.delivery.space.unit_m
    # without a lens the picture is as wide as one unit of its relative depth, in metres as far as anybody knows
    wide = TENTHS * (APERTURE_M if view.focal is not None else 1.0) / unit
    nearest = (
        0.01 if view.focal is not None else -1000
    )  # relative depth stands before an orthographic camera and behind
    lens = [f"float focalLength = {view.focal * wide:.9g}"] if view.focal is not None else []
    return prim(
        'def Camera "camera"',
        f'token projection = "{"orthographic" if view.focal is None else "perspective"}"',
        lens,
        f"float horizontalAperture = {wide:.9g}",
        f"float verticalAperture = {wide * _shape(made, view):.9g}",
        f"float horizontalApertureOffset = {-view.middle[0] * wide:.9g}",
        f"float verticalApertureOffset = {-view.middle[1] * wide:.9g}",
        f"float2 clippingRange = {numbers_of((nearest / unit, 1000 / unit))}",
    )


def _shape(made: Delivered, view: StageView) -> float:
    """Return the picture's height in its widths."""
    return view.pixel_height * made.height_px / made.width_px


def _card(made: Delivered, view: StageView) -> list[str]:
    away = view.away_m or CARD_M
    wide = (1.0 if view.focal is None else away / view.focal) / made.delivery.space.unit_m
    high, deep = wide * _shape(made, view), -away / made.delivery.space.unit_m
    right, up = (-part * wide for part in view.middle)
    across = (right - wide / 2, right + wide / 2)
    upward = (up - high / 2, up + high / 2)
    corners = [(x, y, deep) for x, y in zip((0, 1, 1, 0), (0, 0, 1, 1), strict=True)]
    points = [(across[int(x)], upward[int(y)], z) for x, y, z in corners]
    return prim(
        'def Mesh "card" (\n        prepend apiSchemas = ["MaterialBindingAPI"]\n    )',
        f"rel material:binding = <{MATERIAL}>",
        "uniform bool doubleSided = 1",
        f"float3[] extent = [{numbers_of(np.min(points, axis=0))}, {numbers_of(np.max(points, axis=0))}]",
        "int[] faceVertexCounts = [4]",
        "int[] faceVertexIndices = [0, 1, 2, 3]",
        "normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)] (\n"
        '            interpolation = "vertex"\n        )',
        f"point3f[] points = [{', '.join(numbers_of(point) for point in points)}]",
        "texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (\n"
        '            interpolation = "vertex"\n        )',
        'uniform token subdivisionScheme = "none"',
    )


def _mesh(made: Delivered) -> list[str]:
    return prim(
        f'def Mesh "mesh" (\n        prepend apiSchemas = ["MaterialBindingAPI"]\n        prepend references = '
        f"{asset(animation_name(made.clip))}\n    )",
        f"rel material:binding = <{MATERIAL}>",
    )


def _sun(light: SeenLight, name: str) -> list[str]:
    """A distant light: it shines along its own -z; normalized, so that its strength is the light that arrives."""
    return prim(
        f'def DistantLight "{name}"',
        "float inputs:angle = 0",
        "bool inputs:normalize = 1",
        _shine(light.colour, WHITE),
        f"matrix4d xformOp:transform = {matrix_of(_shining(from_=light.direction))}",
        'uniform token[] xformOpOrder = ["xformOp:transform"]',
    )


def _lamp(light: Light, name: str, unit_m: float) -> list[str]:
    """A near light: a point whose irradiance at one metre is the rig's; a normalized sphere gives strength / (4 d²).

    ``focus`` is the power of the cosine from its axis (OpenUSD's guide to ShapingAPI), the rig's anisotropy.
    """
    place, shaped = np.eye(4), bool(light.anisotropy) and light.axis is not None
    if light.axis is not None:
        place = _shining(from_=-np.asarray(light.axis, np.float64))
    place[:3, 3] = np.array(light.position_m, np.float64) / unit_m
    return prim(
        f'def SphereLight "{name}"' + (' (\n        prepend apiSchemas = ["ShapingAPI"]\n    )' if shaped else ""),
        f"float inputs:radius = {0.01 / unit_m:.9g}",
        "bool inputs:normalize = 1",
        "bool treatAsPoint = 1",
        [f"float inputs:shaping:focus = {light.anisotropy:.9g}"] if shaped else [],
        _shine(light.intensity if len(light.intensity) == 3 else light.intensity[:1] * 3, 4 * WHITE / unit_m**2),
        f"matrix4d xformOp:transform = {matrix_of(place)}",
        'uniform token[] xformOpOrder = ["xformOp:transform"]',
    )


def _shining(*, from_: Sequence[float] | Doubles) -> Doubles:
    """Return how a light turns (4, 4) that shines along its own -z, to shine from a direction."""
    z = np.asarray(from_, np.float64) / np.linalg.norm(from_)
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.99 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    turn = np.eye(4)
    turn[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return turn


def _shine(colour: Sequence[float], factor: float) -> list[str]:
    most = max(max(colour), 1e-9)
    return [
        f"color3f inputs:color = {numbers_of([part / most for part in colour])}",
        f"float inputs:intensity = {most * factor:.9g}",
    ]
