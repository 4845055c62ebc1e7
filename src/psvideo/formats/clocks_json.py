"""The clocks of several cameras as JSON (schema ``psvideo-clocks/1``)."""

import json
from dataclasses import asdict

from psvideo.model.camera_clocks import CameraClocks

SCHEMA = "psvideo-clocks/1"


def clocks_record(clocks: CameraClocks) -> dict[str, object]:
    """Return the clocks as what the file holds."""
    return {
        "schema": SCHEMA,
        "reference": clocks.cameras[0].clip,
        "numbering": clocks.numbering,
        "cycle_s": clocks.cycle_s,
        "cameras": [asdict(camera) for camera in clocks.cameras],
    }


def format_clocks(clocks: CameraClocks) -> str:
    """Return the clocks as JSON text."""
    return json.dumps(clocks_record(clocks), indent=1) + "\n"
