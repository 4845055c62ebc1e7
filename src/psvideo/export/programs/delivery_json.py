"""delivery.json: what other programs need to know of a folder of results, in one file that any language reads."""

import json
from typing import Any

from psvideo.export.programs.delivered import Delivered
from psvideo.model.rig import Rig

SCHEMA = "psvideo-delivery/1"
DELIVERY_FILE = "delivery.json"


def delivery_text(made: Delivered, rig: Rig) -> str:
    """Return the file's text: numbers, rate, space, the lights in the normals' frame, the camera and its place.

    ``camera`` is None where the rig gives no focal length, ``camera_to_world`` (16 numbers, row by row) where normals
    are not in world space or the camera moves.
    """
    space = made.delivery.space
    matrix = space.attributes().get("psvideo:camera_to_world") if space.moving is None else None
    camera: dict[str, Any] | None = None
    if rig.focal_px is not None:
        principal = None if rig.principal_px is None else list(rig.principal_px)
        camera = {"focal_px": list(rig.focal_px), "principal_px": principal}
    content = {
        "schema": SCHEMA,
        "clip": made.clip,
        "first": made.first,
        "last": made.last,
        "fps": [made.fps.numerator, made.fps.denominator],
        "width_px": made.width_px,
        "height_px": made.height_px,
        "space": space.name,
        "y": space.y,
        "quantities": list(made.delivery.quantities),
        "lights": [
            {"name": one.name, "direction": list(one.direction), "colour": list(one.colour)} for one in made.lights
        ],
        "camera": camera,
        "camera_to_world": None if matrix is None else [float(number) for number in str(matrix).split()],
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
