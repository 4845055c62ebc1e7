"""What a movie says of itself beside its pixels: which way is up, how it codes light, at which rate it was shot.

Codes of primaries are those of ITU-T H.273, table 2.
"""

from collections.abc import Mapping
from typing import Any

import av
import numpy as np
from av.sidedata.sidedata import SideDataContainer
from av.video.codeccontext import VideoCodecContext

from psvideo.clip.decoded import shot_of
from psvideo.clip.transfer import BY_H273
from psvideo.model.turn import UPRIGHT, Turn, of_matrix

GAMUTS = {1: "lin_rec709_scene", 9: "lin_rec2020_scene", 12: "lin_p3d65_scene"}
"""The colour interop ids of linear light with these primaries."""
SPOKEN = {
    **{"h264": "H.264", "hevc": "H.265", "mjpeg": "Motion JPEG", "dnxhd": "DNxHD", "prores": "ProRes", "av1": "AV1"},
    **{"vp8": "VP8", "vp9": "VP9", "mpeg1video": "MPEG-1", "mpeg2video": "MPEG-2", "mpeg4": "MPEG-4"},
}
ANDROID_RATE = "com.android.capture.fps"
FEW_WHOLE_FRAMES = 0.5
FEW_BITS = 8
FIXED_ONE = 65536


SAID_BY_MOVIES = {
    "cameraMake": ("com.apple.quicktime.make", "make", "com.android.manufacturer"),
    "cameraModel": ("com.apple.quicktime.model", "model", "com.android.model"),
    "lensModel": ("com.apple.quicktime.camera.lens_model", "lens_model"),
    "reelName": ("reel_name", "com.apple.proapps.reel"),
}
"""By what names containers say what took a movie."""


def shot_by(metadata: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """Return what a container says of camera, lens and reel."""
    first = {name: [key for key in keys if key in metadata] for name, keys in SAID_BY_MOVIES.items()}
    return shot_of({name: metadata[keys[0]] for name, keys in first.items() if keys})


def side_data_of(frame: av.VideoFrame) -> Mapping[str, Any]:
    """Return what comes with a frame beside its picture.

    PyAV's own ``frame.side_data`` ties frame and data into a circle, so that every frame's memory stays (8 MB of 1080p
    ProRes) until Python happens to look for reference cycles.
    """
    container: Any = SideDataContainer
    found: Mapping[str, Any] = container(frame)
    return found


def turn_of(frame: av.VideoFrame) -> tuple[Turn, str | None]:
    """Return how the container wants its frames turned, and a warning where it wants what is no quarter turn."""
    found = side_data_of(frame).get("DISPLAYMATRIX")
    if found is None:
        return UPRIGHT, None
    (a, b, _), (c, d, _), _ = (np.frombuffer(bytes(found), np.int32).reshape(3, 3) / FIXED_ONE).round(3).tolist()
    turn = of_matrix((a, b), (c, d))
    if turn is None:
        return UPRIGHT, f"the movie asks to be shown through the matrix {a:g} {b:g} {c:g} {d:g}, which is not applied"
    return turn, None


def transfer_of(tagged: av.VideoFrame | VideoCodecContext) -> str | None:
    """Return the name of the curve that a frame or a stream is tagged with, None where it says nothing known here."""
    return BY_H273.get(int(tagged.color_trc or 0))


def gamut_of(tagged: av.VideoFrame | VideoCodecContext) -> str | None:
    """Return the colour interop id of the primaries that a frame or a stream is tagged with, None where of none."""
    return GAMUTS.get(int(tagged.color_primaries or 0))


def capture_rate_hz(metadata: Mapping[str, str]) -> float | None:
    """Return the rate at which a phone shot what plays slowed down, where it says so.

    >>> capture_rate_hz({"com.android.capture.fps": "240.000000"})
    240.0
    """
    try:
        return float(metadata.get(ANDROID_RATE, "")) or None
    except ValueError:
        return None


def compression_warning(codec: str, bits: int, *, frames: int, whole_frames: int) -> str | None:
    """Say what the movie's coding costs: few bits, or frames that are coded as changes of others."""
    few = bits <= FEW_BITS
    chained = frames > 1 and whole_frames < FEW_WHOLE_FRAMES * frames
    if not (few or chained):
        return None
    costs = [f"{bits} bits leave few steps for dim light"] if few else []
    if chained:
        whole = "is a whole one" if whole_frames == 1 else "are whole ones"
        costs.append(f"of {frames} frames only {whole_frames} {whole}, the others are coded as changes")
    better = "10 bits and only whole frames" if few else "only whole frames"
    return (
        f"{SPOKEN.get(codec, codec)} costs accuracy: {', and '.join(costs)}. Where the camera can, record {better} "
        "(ProRes, DNxHR, All-Intra), or raw"
    )
