"""What the options on delivery make together, with a program's preset."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from psvideo.cli.delivery_options import (
    CameraTime,
    CodecName,
    Encoding,
    MeshKind,
    PreviewName,
    ProgramName,
    SpaceName,
    YDirection,
)
from psvideo.errors import UsageError
from psvideo.export.programs import NO_PRESET, PRESETS, Preset
from psvideo.export.results import Delivery, Preview, Program
from psvideo.export.space import choose_space
from psvideo.model.quantities import AOVS, Aov
from psvideo.plates.beauty import parse_mix


@dataclass(frozen=True, kw_only=True)
class Asked:
    """A command's options on delivery, as they were given; None where they were not."""

    program: ProgramName | None
    space: SpaceName | None
    camera_to_world: Path | None
    camera: str | None
    camera_time: CameraTime | None
    y: YDirection | None
    float32: bool
    aovs: Sequence[Aov]
    meshes: Sequence[MeshKind]
    encode: Encoding | None
    multipart: bool | None
    plates: bool
    with_ambient: bool
    weights: Sequence[str]
    previews: Sequence[PreviewName]
    codec: CodecName


def delivery_of(asked: Asked) -> tuple[Delivery, tuple[str, ...]]:
    """Return the delivery that the options and the program's preset make, and where they are at odds, in sentences.

    What is given wins over the preset. Raises UsageError where options do not fit together.
    """
    program: Program | None = None if asked.program is None else asked.program.value
    preset = PRESETS[program] if program else NO_PRESET
    in_world = asked.camera_to_world is not None and preset.space == "camera"
    space = asked.space.value if asked.space else ("world" if in_world and program else preset.space)
    y = asked.y.value if asked.y else preset.y
    previews: tuple[Preview, ...] = tuple(dict.fromkeys(name.value for name in asked.previews))
    mix = parse_mix(asked.weights, with_ambient=asked.with_ambient)
    wanted = {*asked.aovs, *preset.aovs, *(["beauty"] if "beauty" in previews else [])}
    aovs = tuple(name for name in AOVS if name in wanted)
    if mix.weights and "beauty" not in aovs:
        raise UsageError(
            "--with-ambient and --weight: belong to the beauty plate. Add --aov beauty, or leave them out."
        )
    delivery = Delivery(
        space=choose_space(
            space,
            y,
            asked.camera_to_world,
            camera=asked.camera,
            camera_time=None if asked.camera_time is None else asked.camera_time.value,
        ),
        half=not asked.float32,
        aovs=aovs,
        meshes=tuple(dict.fromkeys(kind.value for kind in asked.meshes)),
        png16=asked.encode is Encoding.png16 or preset.png16,
        multipart=preset.multipart if asked.multipart is None else asked.multipart,
        plates=asked.plates or "plates" in previews,
        mix=mix,
        previews=previews,
        codec=asked.codec.value,
        program=program,
    )
    return delivery, _at_odds(program, preset, space=space, y=y, multipart=delivery.multipart)


def _at_odds(program: Program | None, preset: Preset, *, space: str, y: str, multipart: bool) -> tuple[str, ...]:
    if program is None:
        return ()
    said = []
    if y != preset.y:
        said.append(f"--y {y} goes against --for {program}: {preset.reasons['y']}. It is written as you say.")
    if space != preset.space and not (space == "world" and preset.space == "camera"):
        said.append(
            f"--space {space} goes against --for {program}: {preset.reasons['space']}. It is written as you say."
        )
    if preset.multipart and not multipart:
        said.append(f"--no-multipart goes against --for {program}, which reads all parts of one file as layers.")
    return tuple(said)
