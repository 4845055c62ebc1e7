"""Options that say how results are delivered, each written once."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from psvideo.cli.console import plain
from psvideo.cli.options.per_light import parse_weights
from psvideo.cli.options.typed import chosen_previews
from psvideo.model.choices import (
    USUAL_COMPRESSION,
    CameraTime,
    Compression,
    MapFiles,
    MeshKind,
    MovieCodec,
    PlatesPreview,
    Preview,
    Program,
    SpaceName,
    YDirection,
)
from psvideo.model.quantities import Aov

if TYPE_CHECKING:
    AovWord = Aov
    MeshWord = MeshKind
    PreviewWord = Preview
    PlatesPreviewWord = PlatesPreview
else:

    def _words(choices: Any) -> type[StrEnum]:
        """Return choices as typer takes them in a list, where it takes no Literal."""
        return StrEnum("Word", {word: word for word in get_args(choices)})

    AovWord, MeshWord, PreviewWord, PlatesPreviewWord = map(_words, (Aov, MeshKind, Preview, PlatesPreview))

SpaceOption = Annotated[
    SpaceName | None,
    typer.Option("--space", help="Axes of the normals: the camera's (the default), the world's, or a flat card's."),
]
CameraToWorld = Annotated[
    Path | None,
    typer.Option(
        "--camera-to-world",
        help="For --space world: a USD file with the camera, or a text file with a 3 x 3 or 4 x 4 matrix.",
    ),
]
CameraName = Annotated[
    str | None, typer.Option("--camera", help="Which camera of the USD file: its prim's path or name.")
]
CameraTimeOption = Annotated[
    CameraTime | None,
    typer.Option(
        "--camera-time",
        help="An animated camera's time codes: one per frame of the clip (frames, the default), the numbers of the "
        "results (numbers), or seconds at the stage's rate (seconds).",
    ),
]
YOption = Annotated[YDirection | None, typer.Option("--y", help="up as in OpenGL (the default), down as in DirectX.")]
FloatOption = Annotated[bool, typer.Option("--float", help="Write normals as 32-bit floats, not half floats.")]
AovOption = Annotated[
    list[AovWord] | None, typer.Option("--aov", help="Also write this quantity; may be given several times.")
]
MeshOption = Annotated[
    list[MeshWord] | None,
    typer.Option("--mesh", help="Also write meshes: ply, one per instant; usd, one animated file."),
]
CompressionOption = Annotated[
    Compression,
    typer.Option("--compression", help="How EXR files are packed, without loss: zips suits Nuke, rle fast disks."),
]
EncodeOption = Annotated[MapFiles | None, typer.Option("--encode", help="Also write 16-bit PNG maps of 0 to 1.")]
Separate = Annotated[bool, typer.Option("--separate", help="One sequence per quantity; this is the default.")]
Multipart = Annotated[
    bool | None, typer.Option("--multipart/--no-multipart", help="Also write one EXR with all quantities.")
]
Plates = Annotated[bool, typer.Option("--plates", help="Also write the plates, one sequence per light.")]
WithAmbient = Annotated[
    bool, typer.Option("--with-ambient", help="Leave ambient light in the beauty plate, as much as one exposure saw.")
]
Weights = Annotated[
    list[str] | None,
    typer.Option("--weight", help="How strong a light is in the beauty plate: key=0.5; may be given several times."),
]
PreviewOption = Annotated[
    list[PreviewWord] | None,
    typer.Option(
        "--preview", help="Which preview movies to make instead of the relit one; may be given several times."
    ),
]
NoPreview = Annotated[bool, typer.Option("--no-preview", help="Make no preview movie.")]
PlatesPreviewOption = Annotated[
    list[PlatesPreviewWord] | None,
    typer.Option("--preview", help="Also make this preview movie; may be given several times."),
]
CodecOption = Annotated[
    MovieCodec,
    typer.Option("--preview-codec", help="vp9 (.mp4) for browsers and players, prores (.mov) for editors, or both."),
]
ProgramOption = Annotated[
    Program | None,
    typer.Option(
        "--for", help="Write what this program needs (single options come first), and a note on how to load it."
    ),
]


@dataclass(frozen=True, kw_only=True)
class BeautyWords:
    """What the beauty plate adds up, as typed."""

    with_ambient: WithAmbient = False
    weight: Weights = None

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them."""
        return vars(self) | {"weight": parse_weights(self.weight)}


@dataclass(frozen=True, kw_only=True)
class DeliveryWords:
    """What is written of normals, and in which convention, as typed."""

    preset: ProgramOption = None
    space: SpaceOption = None
    camera_to_world: CameraToWorld = None
    camera: CameraName = None
    camera_time: CameraTimeOption = None
    y: YOption = None
    float32: FloatOption = False
    aov: AovOption = None
    mesh: MeshOption = None
    encode: EncodeOption = None
    separate: Separate = True
    compression: CompressionOption = USUAL_COMPRESSION
    multipart: Multipart = None
    plates: Plates = False
    preview: PreviewOption = None
    no_preview: NoPreview = False
    preview_codec: CodecOption = "both"

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them, to which separate files are no choice. Raises UsageError where movies
        are named and none are wanted."""
        said = {name: word for name, word in vars(self).items() if name not in ("separate", "no_preview")}
        previews = chosen_previews(self.preview, no_preview=self.no_preview)
        return said | {"aov": plain(self.aov), "mesh": plain(self.mesh), "preview": previews}
