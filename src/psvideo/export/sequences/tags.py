"""What every delivered EXR says of itself in its header, the time code of its instant among it."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from psvideo import __version__
from psvideo.errors import PsvideoError
from psvideo.formats.exr_files import Attribute
from psvideo.formats.frame_rates import broadcast_fps
from psvideo.formats.paths import check_file

CODE = re.compile(r"(\d\d):(\d\d):(\d\d)([:;.])(\d\d)")
MOST_FRAMES = 30
"""EXR's time code counts at most 30 frames a second."""
COUNTED = tuple(Fraction(rate) for rate in ("24000/1001", "24", "25", "30000/1001", "30"))
"""The rates that time codes count (SMPTE ST 12-1)."""
DROP_RATE, DROPPED = COUNTED[3], 2
"""The rate at which drop-frame codes keep to the clock, and how many numbers they leave out at the start of each minute
but every tenth (SMPTE ST 12-1)."""


D65 = (0.3127, 0.3290)
PRIMARIES: Mapping[str, tuple[float, ...]] = {
    "lin_rec709_scene": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, *D65),
    "lin_rec2020_scene": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *D65),
    "lin_p3d65_scene": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *D65),
    "lin_ap1_scene": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
    "lin_ap0_scene": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767),
}
"""x and y of red, green, blue and white: ITU-R BT.709, BT.2020, SMPTE RP 431-2 with D65, and ACES (S-2014-004)."""


@dataclass(frozen=True, kw_only=True)
class Tags:
    """What is the same for a whole sequence. ``colour`` is the colour interop id of plates and albedo, ``shot`` what
    the footage says of camera, lens and reel."""

    fps: Fraction
    colour: str
    plan_sha256: str
    rig_sha256: str | None = None
    space: str = "camera"
    y: str = "up"
    camera_fps: Fraction | None = None
    first_time_code: str | None = None
    shot: tuple[tuple[str, str], ...] = ()

    def time_code(self, time_s: float) -> str | None:
        """Return the time code of an instant, where the clip has one that goes on to it."""
        if self.first_time_code is None or self.camera_fps is None:
            return None
        camera, delivered = (broadcast_fps(float(rate)) for rate in (self.camera_fps, self.fps))
        counted = camera if _has_time_code(camera) else _counted(delivered, camera)
        return None if counted is None else advanced(self.first_time_code, time_s, counted)

    def attributes(self, *, time_s: float, data: bool) -> dict[str, Attribute]:
        """Return the header attributes of one picture; ``data`` marks what is no colour (normals, masks)."""
        known: dict[str, Attribute] = {
            "colorInteropID": "data" if data else self.colour,
            "psvideo:time_s": float(time_s),
            "psvideo:space": self.space,
            "psvideo:y": self.y,
            "psvideo:version": __version__,
            "psvideo:plan_sha256": self.plan_sha256,
        }
        if self.rig_sha256 is not None:
            known["psvideo:rig_sha256"] = self.rig_sha256
        return known | dict(self.shot) | ({} if data else self._space())

    def _space(self) -> dict[str, Attribute]:
        """Return what is known of the colour's primaries: those of a space with a name, or that it is a sensor's."""
        if self.colour in PRIMARIES:
            return {"chromaticities": PRIMARIES[self.colour]}
        if self.colour == "unknown":
            said = dict(self.shot)
            camera = " ".join(said[name] for name in ("cameraMake", "cameraModel") if name in said) or "the camera"
            return {"psvideo:colour": f"linear light as the sensor of {camera} saw it, not converted, no white balance"}
        return {}


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal digits."""
    try:
        check_file(path)
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as fault:
        raise PsvideoError(f"{path}: cannot be read ({fault.strerror}). Check the file and its permissions.") from fault


def _has_time_code(fps: Fraction) -> bool:
    """Return whether a camera's time code counts its frames; one that is faster counts those of the project."""
    return round(fps) <= MOST_FRAMES and fps.denominator in (1, 1001)


def _counted(delivered: Fraction, camera: Fraction) -> Fraction | None:
    """Return the rate that the code of a fast camera counts: the delivery's. A delivery below 24 frames a second, such
    as 12, is a part of the project's rate; None where it may be a part of several, or of none."""
    whole = [rate for rate in COUNTED if (rate / delivered).denominator == 1]
    fitting = [rate for rate in whole if (camera / rate).denominator == 1]
    return delivered if delivered in COUNTED else fitting[0] if len(fitting) == 1 else None


def advanced(code: str, time_s: float, fps: Fraction) -> str | None:
    """Return the code of the frame that is exposed at ``time_s``; ``code`` is frame 0's, ``HH:MM:SS:FF``, drop-frame
    with ``;`` or ``.`` before the frame.

    None where that cannot be said: above 30 frames a second, for drop-frame codes at other rates than 29.97, and for a
    code that numbers more frames a second than these.

    >>> advanced("01:00:59:23", 2 / 24, Fraction(24))
    '01:01:00:01'
    >>> advanced("01:00:59;29", 1.5 * 1001 / 30000, Fraction(30000, 1001))
    '01:01:00;02'
    >>> advanced("01:00:59:23", 0.1, Fraction(120)) is None
    True
    """
    found = CODE.fullmatch(code)
    base = round(fps)
    if found is None or base > MOST_FRAMES:
        return None
    hours, minutes, seconds, frame = (int(found[part]) for part in (1, 2, 3, 5))
    drop = found[4] != ":"
    if frame >= base or (drop and fps != DROP_RATE):
        return None
    frames = ((hours * 60 + minutes) * 60 + seconds) * base + frame
    if drop:
        frames -= _dropped_before(hours * 60 + minutes)
    frames += int(time_s * fps + Fraction(1, 10**6))
    if drop:
        frames = _numbered(frames)
    seconds, frame = divmod(frames, base)
    mark = ";" if drop else ":"
    return f"{seconds // 3600 % 24:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}{mark}{frame:02d}"


def _dropped_before(minutes: int) -> int:
    """Return how many numbers of drop-frame codes are left out up to the start of a minute, its own among them."""
    return DROPPED * (minutes - minutes // 10)


def _numbered(frames: int) -> int:
    """Return the number, at 30 a second, that a drop-frame code shows for the frame with this index from midnight."""
    base = round(DROP_RATE)
    minute, tens = 60 * base - DROPPED, 600 * base - _dropped_before(10)
    whole, rest = divmod(frames, tens)
    within = max(rest - DROPPED, 0) // minute  # the first minute of ten is longer: nothing is left out in it
    return frames + DROPPED * (9 * whole + within)
