"""The material of a delivery as USD: a Lambert surface with the image sequences, twice.

UsdPreviewSurface (specification 2.6) takes its normal in tangent space, which of a card that faces the camera is the
camera's frame; standard_surface of MaterialX takes it in the world's, into which the card's frame is turned.
"""

from collections.abc import Sequence

from psvideo.export.programs.delivered import Delivered
from psvideo.export.sequences.result_files import result_name
from psvideo.export.usd.usda import asset, prim

MATERIAL = "/delivery/surface"


def material(made: Delivered, numbers: Sequence[int], *, with_normals: bool) -> list[str]:
    """Return the material of results of these numbers; a mesh brings its own normals, a card takes the sequence's.

    UsdPreviewSurface has no place for normals of the world: in world space only MaterialX takes them.
    """
    here = MATERIAL
    in_world, down = made.delivery.space.name == "world", made.delivery.space.y == "down"
    preview_normals = with_normals and not in_world
    parts = [
        prim(
            'def Shader "preview"',
            'uniform token info:id = "UsdPreviewSurface"',
            f"color3f inputs:diffuseColor.connect = <{here}/albedo.outputs:rgb>",
            f"normal3f inputs:normal.connect = <{here}/normals.outputs:rgb>" if preview_normals else [],
            "float inputs:roughness = 1",
            "int inputs:useSpecularWorkflow = 1",
            "color3f inputs:specularColor = (0, 0, 0)",
            "token outputs:surface",
        ),
        prim(
            'def Shader "st"',
            'uniform token info:id = "UsdPrimvarReader_float2"',
            'string inputs:varname = "st"',
            "float2 outputs:result",
        ),
        _texture("albedo", made, numbers, here),
        *([_texture("normals", made, numbers, here)] if preview_normals else []),
        *_materialx(made, numbers, here, with_normals=with_normals, in_world=in_world, down=down),
    ]
    return prim(
        'def Material "surface"',
        f"token outputs:surface.connect = <{here}/preview.outputs:surface>",
        f"token outputs:mtlx:surface.connect = <{here}/mtlx_surface.outputs:out>",
        *parts,
    )


def _files(made: Delivered, quantity: str, numbers: Sequence[int], suffix: str = "exr") -> list[str]:
    first, *_ = names = [asset(result_name(made.clip, quantity, number, suffix=suffix)) for number in numbers]
    still = [f"asset inputs:file = {first}"]
    if len(names) == 1:
        return still
    samples = [f"    {number}: {name}," for number, name in zip(numbers, names, strict=True)]
    return [*still, "asset inputs:file.timeSamples = {", *samples, "}"]


def _texture(quantity: str, made: Delivered, numbers: Sequence[int], here: str) -> list[str]:
    """Return a texture read as numbers; normals from PNG where there is one, which readers that know no signed maps
    (Blender) take as well, but not where y points down: USD's checks want a map's scale to be 2."""
    is_normals, down = quantity == "normals", made.delivery.space.y == "down"
    png = is_normals and made.delivery.png16 and not down
    decoded = ["float4 inputs:scale = (2, 2, 2, 1)", "float4 inputs:bias = (-1, -1, -1, 0)"] if png else []
    flipped = ["float4 inputs:scale = (1, -1, 1, 1)"] if is_normals and down else []
    return prim(
        f'def Shader "{quantity}"',
        'uniform token info:id = "UsdUVTexture"',
        _files(made, quantity, numbers, "png" if png else "exr"),
        decoded,
        flipped,
        'token inputs:sourceColorSpace = "raw"',
        f"float2 inputs:st.connect = <{here}/st.outputs:result>",
        'token inputs:wrapS = "black"',
        'token inputs:wrapT = "black"',
        "float3 outputs:rgb",
    )


def _materialx(
    made: Delivered, numbers: Sequence[int], here: str, *, with_normals: bool, in_world: bool, down: bool
) -> list[list[str]]:
    """Return standard_surface as a Lambert surface; its ``normal`` is in world space, into which the card's turn."""
    upright = "mtlx_flip" if down else "mtlx_normals"
    turned = upright if in_world else "mtlx_turn"
    parts = [
        _lambert(here, turned if with_normals else None),
        _image("albedo", "color3", made, numbers, here),
        prim(
            'def Shader "mtlx_st"',
            'uniform token info:id = "ND_geompropvalue_vector2"',
            'string inputs:geomprop = "st"',
            "float2 outputs:out",
        ),
    ]
    if not with_normals:
        return parts
    parts.append(_image("normals", "vector3", made, numbers, here))
    if down:
        parts.append(_flip(here))
    if not in_world:
        parts.append(_turn(here, upright))
    return parts


def _lambert(here: str, normals: str | None) -> list[str]:
    """Return a matte surface, lit by the normals that a shader of this name gives, or by the card's own."""
    return prim(
        'def Shader "mtlx_surface"',
        'uniform token info:id = "ND_standard_surface_surfaceshader"',
        "float inputs:base = 1",
        f"color3f inputs:base_color.connect = <{here}/mtlx_albedo.outputs:out>",
        "float inputs:diffuse_roughness = 0",
        "float inputs:specular = 0",
        f"float3 inputs:normal.connect = <{here}/{normals}.outputs:out>" if normals is not None else [],
        "token outputs:out",
    )


def _flip(here: str) -> list[str]:
    """Return normals whose y points down with y up."""
    return prim(
        'def Shader "mtlx_flip"',
        'uniform token info:id = "ND_multiply_vector3"',
        f"float3 inputs:in1.connect = <{here}/mtlx_normals.outputs:out>",
        "float3 inputs:in2 = (1, -1, 1)",
        "float3 outputs:out",
    )


def _turn(here: str, upright: str) -> list[str]:
    """Return the camera's normals in world space."""
    return prim(
        'def Shader "mtlx_turn"',
        'uniform token info:id = "ND_transformnormal_vector3"',
        f"float3 inputs:in.connect = <{here}/{upright}.outputs:out>",
        'string inputs:fromspace = "object"',
        'string inputs:tospace = "world"',
        "float3 outputs:out",
    )


def _image(quantity: str, kind: str, made: Delivered, numbers: Sequence[int], here: str) -> list[str]:
    usd_kind = "color3f" if kind == "color3" else "float3"
    return prim(
        f'def Shader "mtlx_{quantity}"',
        f'uniform token info:id = "ND_image_{kind}"',
        _files(made, quantity, numbers),
        f"float2 inputs:texcoord.connect = <{here}/mtlx_st.outputs:out>",
        'string inputs:filtertype = "closest"' if quantity == "normals" else [],
        f"{usd_kind} outputs:out",
    )
