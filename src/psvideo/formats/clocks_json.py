"""The clocks of several cameras as JSON (schema ``psvideo-clocks/1``)."""

import json
from dataclasses import asdict
from pathlib import Path

from pydantic import Field

from psvideo.errors import PsvideoError
from psvideo.formats.contract import Contract, parse_record, read_json
from psvideo.model.camera_clocks import CameraClock, CameraClocks, Numbering

SCHEMA = "psvideo-clocks/1"


class _CameraFile(Contract):
    clip: str
    first_flash: int
    offset_s: float
    rate_ppm: float
    drift_ppm_per_s: float
    shared: int = Field(ge=0)
    error_s: float = Field(ge=0)


class _ClocksFile(Contract):
    schema_: str = Field(alias="schema")
    reference: str
    first_instant_s: float = Field(ge=0)
    numbering: Numbering
    cycle_s: float = Field(gt=0)
    cameras: list[_CameraFile] = Field(min_length=1)


def read_clocks(path: Path) -> CameraClocks:
    """Read clocks.json. Raises PsvideoError that names the file, the key and what was expected."""
    data = read_json(path, advice="Make it again: psvideo sync of all cameras' clips.")
    file = parse_record(data, _ClocksFile, SCHEMA, source=str(path))
    if file.reference != file.cameras[0].clip:
        raise PsvideoError(
            f"{path}: the reference is {file.reference!r}, and the first camera {file.cameras[0].clip!r}. Expected the "
            "reference first, whose clock is that of all: make the file again with psvideo sync."
        )
    return CameraClocks(
        cameras=tuple(CameraClock(**camera.model_dump()) for camera in file.cameras),
        numbering=file.numbering,
        cycle_s=file.cycle_s,
        first_instant_s=file.first_instant_s,
    )


def clocks_record(clocks: CameraClocks) -> dict[str, object]:
    """Return the clocks as what the file holds."""
    return {
        "schema": SCHEMA,
        "reference": clocks.cameras[0].clip,
        "first_instant_s": clocks.first_instant_s,
        "numbering": clocks.numbering,
        "cycle_s": clocks.cycle_s,
        "cameras": [asdict(camera) for camera in clocks.cameras],
    }


def format_clocks(clocks: CameraClocks) -> str:
    """Return the clocks as JSON text."""
    return json.dumps(clocks_record(clocks), indent=1) + "\n"
