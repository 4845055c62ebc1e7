"""What every delivered EXR says of itself in its header."""

import hashlib
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from psvideo import __version__
from psvideo.errors import PsvideoError
from psvideo.export.timecode import advanced


@dataclass(frozen=True, kw_only=True)
class Tags:
    """What is the same for a whole sequence. ``colour`` is the colour interop id of plates and albedo."""

    fps: Fraction
    colour: str
    plan_sha256: str
    rig_sha256: str | None = None
    space: str = "camera"
    y: str = "up"
    camera_fps: Fraction | None = None
    first_time_code: str | None = None

    def time_code(self, time_s: float) -> str | None:
        """Return the time code of an instant, where the clip has one that goes on to it."""
        if self.first_time_code is None or self.camera_fps is None:
            return None
        return advanced(self.first_time_code, time_s, self.camera_fps)

    def attributes(self, *, time_s: float, data: bool) -> dict[str, str | float]:
        """Return the header attributes of one picture; ``data`` marks what is no colour (normals, masks)."""
        known: dict[str, str | float] = {
            "colorInteropID": "data" if data else self.colour,
            "psvideo:time_s": float(time_s),
            "psvideo:space": self.space,
            "psvideo:y": self.y,
            "psvideo:version": __version__,
            "psvideo:plan_sha256": self.plan_sha256,
        }
        return known if self.rig_sha256 is None else known | {"psvideo:rig_sha256": self.rig_sha256}


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal digits."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as fault:
        raise PsvideoError(f"{path}: cannot be read ({fault.strerror}). Check the file and its permissions.") from fault
