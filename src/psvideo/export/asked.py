"""What the parameters on delivery make together, with a program's preset."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from psvideo.errors import UsageError
from psvideo.export.programs.presets import NO_PRESET, PRESETS, Preset
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.space import choose_space
from psvideo.model.choices import (
    USUAL_COMPRESSION,
    CameraTime,
    Compression,
    MapFiles,
    MeshKind,
    MovieCodec,
    Preview,
    Program,
    SpaceName,
    YDirection,
)
from psvideo.model.quantities import AOVS, Aov
from psvideo.plates.beauty import mix_of


@dataclass(frozen=True, kw_only=True)
class Asked:
    """The parameters on delivery as they were given; None where they were not."""

    preset: Program | None = None
    space: SpaceName | None = None
    camera_to_world: Path | None = None
    camera: str | None = None
    camera_time: CameraTime | None = None
    y: YDirection | None = None
    float32: bool = False
    aov: Sequence[Aov] = ()
    mesh: Sequence[MeshKind] = ()
    encode: MapFiles | None = None
    compression: Compression = USUAL_COMPRESSION
    multipart: bool | None = None
    plates: bool = False
    with_ambient: bool = False
    weight: Mapping[str, float] = field(default_factory=dict)
    preview: Sequence[Preview] = ()
    preview_codec: MovieCodec = "both"


def delivery_of(asked: Asked) -> tuple[Delivery, tuple[str, ...]]:
    """Return the delivery that parameters and the program's preset make, and where they are at odds, in sentences.

    What is given wins over the preset. Raises UsageError where parameters do not fit together.
    """
    program = asked.preset
    preset = PRESETS[program] if program else NO_PRESET
    in_world = asked.camera_to_world is not None and preset.space == "camera"
    space = asked.space or ("world" if in_world and program else preset.space)
    y = asked.y or preset.y
    mix = mix_of(asked.weight, with_ambient=asked.with_ambient)
    wanted = {*asked.aov, *preset.aovs, *(["beauty"] if "beauty" in asked.preview else [])}
    aovs = tuple(name for name in AOVS if name in wanted)
    if mix.weights and "beauty" not in aovs:
        raise UsageError(
            '`with_ambient` and `weight`: belong to the beauty plate. Add `aov=["beauty"]`, or leave them out.'
        )
    delivery = Delivery(
        space=choose_space(space, y, asked.camera_to_world, camera=asked.camera, camera_time=asked.camera_time),
        half=not asked.float32,
        aovs=aovs,
        meshes=tuple(dict.fromkeys(asked.mesh)),
        png16=asked.encode == "png16" or preset.png16,
        multipart=preset.multipart if asked.multipart is None else asked.multipart,
        plates=asked.plates or "plates" in asked.preview,
        mix=mix,
        previews=tuple(dict.fromkeys(asked.preview)),
        codec=asked.preview_codec,
        program=program,
        compression=asked.compression,
    )
    return delivery, _at_odds(program, preset, space=space, y=y, multipart=delivery.multipart)


def _at_odds(program: Program | None, preset: Preset, *, space: str, y: str, multipart: bool) -> tuple[str, ...]:
    if program is None:
        return ()
    said = []
    if y != preset.y:
        said.append(f"`y={y!r}` goes against `preset={program!r}`: {preset.reasons['y']}. It is written as you say.")
    if space != preset.space and not (space == "world" and preset.space == "camera"):
        said.append(
            f"`space={space!r}` goes against `preset={program!r}`: {preset.reasons['space']}. It is written as you say."
        )
    if preset.multipart and not multipart:
        said.append(
            f"`multipart=False` goes against `preset={program!r}`, which reads all parts of one file as layers."
        )
    return tuple(said)
