"""What a program's preset sets: the frame of normals, which way y points, and what is written besides normals."""

from dataclasses import dataclass

from psvideo.model.choices import Program, SpaceName, YDirection
from psvideo.model.quantities import Aov


@dataclass(frozen=True, kw_only=True)
class Preset:
    """What a program's preset sets where the options say nothing, and ``reasons`` for each by the option's name."""

    space: SpaceName
    y: YDirection
    reasons: dict[str, str]
    png16: bool = False
    multipart: bool = False
    aovs: tuple[Aov, ...] = ()


NO_PRESET = Preset(space="camera", y="up", reasons={})
PRESETS: dict[Program, Preset] = {
    "nuke": Preset(
        space="camera",
        y="up",
        multipart=True,
        aovs=("beauty", "position"),
        reasons={"y": "Nuke's axes have y up", "space": "ReLight needs normals in the frame of its positions"},
    ),
    "blender": Preset(
        space="camera",
        y="up",
        png16=True,
        reasons={"y": "Blender takes y as up", "space": "the note's nodes turn camera space"},
    ),
    "unreal": Preset(
        space="tangent",
        y="down",
        png16=True,
        reasons={"y": "Unreal takes green as down (DirectX)", "space": "Unreal's normal maps are in tangent space"},
    ),
    "houdini": Preset(
        space="camera",
        y="up",
        multipart=True,
        aovs=("depth", "position"),
        reasons={"y": "Houdini's axes have y up", "space": "positions and normals share the camera's frame"},
    ),
}
