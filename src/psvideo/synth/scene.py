"""scene.toml: what stands before the virtual camera, how it is lit, and what it is filmed with.

Space is the camera's own: x right, y up, z towards the camera, metres. A perspective camera sits at the origin and sees
negative z; an orthographic one looks along -z from far away.
"""

from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from psvideo.formats.contract import Contract, read_toml
from psvideo.synth.scene_tables import (
    AmbientTable,
    CameraTable,
    ClaimTable,
    Kind,
    LightTable,
    ObjectTable,
    OtherCameraTable,
    OutputTable,
    StrobeTable,
)

SCHEMA = "psvideo-scene/1"


class Scene(Contract):
    """A whole scene file. ``frames`` counts the clip's frames, dropped ones included."""

    schema_: str = Field(alias="schema")
    name: str = Field(default="scene", pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")
    frames: int = Field(default=60, ge=1)
    seed: int = Field(default=1, ge=0)
    motion_samples: int = Field(default=1, ge=1, le=64)
    starts_s: float = 0.0
    camera: CameraTable
    other_camera: list[OtherCameraTable] = Field(default_factory=list)
    strobe: StrobeTable = Field(default_factory=StrobeTable)
    light: list[LightTable] = Field(min_length=1)
    ambient: AmbientTable = Field(default_factory=AmbientTable)
    object: list[ObjectTable] = Field(min_length=1)
    plan: ClaimTable = Field(default_factory=ClaimTable)
    output: OutputTable = Field(default_factory=OutputTable)

    @property
    def moves(self) -> bool:
        """Whether any object moves."""
        return any(thing.motion is not None for thing in self.object)

    @property
    def dropped(self) -> frozenset[int]:
        """The indices (from 0) of the frames that the camera lost."""
        return frozenset(self.output.dropped)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        names = [light.name for light in self.light]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"two lights have the name {twice[0]!r}; expected a name of its own for each")
        cameras = [self.camera.name, *(one.name for one in self.other_camera)]
        if again := sorted({name for name in cameras if cameras.count(name) > 1}):
            raise ValueError(f"two cameras have the name {again[0]!r}; expected a name of its own for each")
        flashed = {name for flash in self.strobe.flash for name in flash.lights}
        if unknown := sorted(flashed - set(names)):
            raise ValueError(f"strobe.flash lights {unknown[0]!r}; expected one of the scene's: {', '.join(names)}")
        if self.dropped and max(self.dropped) >= self.frames:
            raise ValueError(f"output.dropped names frame {max(self.dropped)}; expected indices below {self.frames}")
        if len(self.dropped) == self.frames:
            raise ValueError("output.dropped names every frame; expected at least one that is kept")
        _check_files(self.camera, self.output.kind)
        return self


def _check_files(camera: CameraTable, kind: Kind) -> None:
    """Refuse what a kind of file cannot hold."""
    if kind == "exr" and camera.transfer != "linear":
        raise ValueError(f'output.kind "exr" holds linear light; expected transfer = "linear", not {camera.transfer!r}')
    if kind == "png8" and camera.bits != 8:
        raise ValueError(f'output.kind "png8" needs camera.bits = 8; found {camera.bits}')
    if kind == "dng" and camera.cfa is None:
        raise ValueError('output.kind "dng" holds a mosaic; expected camera.cfa such as "RGGB"')
    if kind == "dng" and camera.transfer != "linear":
        raise ValueError(f'output.kind "dng" holds linear codes; expected transfer = "linear", not {camera.transfer!r}')
    if kind == "dpx" and (camera.cfa is not None or camera.colour == "grey" or camera.bits not in (10, 16)):
        raise ValueError('output.kind "dpx" needs colour = "rgb", no cfa, and camera.bits of 10 or 16')


def read_scene(path: Path) -> Scene:
    """Read a scene file. Raises PsvideoError that names file, key, what was found and what was expected."""
    return read_toml(path, Scene, SCHEMA)
