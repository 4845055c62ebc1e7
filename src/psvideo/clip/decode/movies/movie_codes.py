"""A decoded frame of a movie as codes: FFmpeg's planes in, R'G'B' codes and what the frame is tagged with out.

Colours are converted by ``yuv`` with the matrix and range that the file is tagged with.
"""

from dataclasses import replace
from pathlib import Path

import av
import numpy as np

from psvideo.clip.decode.movies.ffmpeg_planes import planes
from psvideo.clip.decode.movies.movie_tags import gamut_of, side_data_of, transfer_of, turn_of
from psvideo.clip.decode.movies.yuv import CODES, HIGHEST, LOWEST, LUMA_WEIGHTS, signal_range, to_rgb
from psvideo.clip.decoded import CodedPicture, Header
from psvideo.errors import PsvideoError

VIDEO_RANGE, FULL_RANGE = 1, 2  # FFmpeg's AVCOL_RANGE_MPEG and AVCOL_RANGE_JPEG
UNTAGGED = 2  # matrix coefficients "unspecified" (H.273)
HD_HEIGHT_PX = 720


def rgb_codes(path: Path, frame: av.VideoFrame) -> CodedPicture:
    """Take a decoded frame's planes and make R'G'B' codes of them."""
    if frame.interlaced_frame:
        raise PsvideoError(f"{path}: is interlaced; expected whole frames. Record progressive footage.")
    found = planes(path, frame)
    bits = frame.format.components[0].bits
    is_yuv = frame.format.name.startswith("yuv") or (not frame.format.is_rgb and len(found) > 1)
    full_by_name = frame.format.name.startswith("yuvj") or not is_yuv
    video_range = frame.color_range == VIDEO_RANGE or (frame.color_range != FULL_RANGE and not full_by_name)
    zero, one = signal_range(bits, video_range=video_range)
    turn, askew = turn_of(frame)
    alpha = ("the movie's alpha channel is left out",) if len(found) in (2, 4) else ()
    header = Header(
        width_px=frame.width,
        height_px=frame.height,
        channels=3 if len(found) > 2 else 1,
        bits=bits,
        signal_at_0=-zero / (one - zero),
        signal_per_code=1 / (one - zero),
        video_range=video_range,
        turn=turn,
        transfer=transfer_of(frame),
        colour=gamut_of(frame),
        warnings=(askew,) if askew else (),
        notes=alpha,
    )
    if not is_yuv:
        return CodedPicture(header=header, codes=found[0].copy() if len(found) < 3 else np.stack(found[:3], axis=-1))
    matrix, warnings = _matrix(path, frame)
    codes = to_rgb(found[0], found[1], found[2], bits=bits, matrix=matrix, video_range=video_range)
    span = (HIGHEST - LOWEST) / CODES
    header = replace(header, signal_at_0=LOWEST, signal_per_code=span, warnings=header.warnings + warnings)
    return CodedPicture(header=header, codes=codes)


def _matrix(path: Path, frame: av.VideoFrame) -> tuple[int, tuple[str, ...]]:
    """Return the matrix coefficients that the frame is tagged with, or what its height makes likely, with a note."""
    tagged = UNTAGGED if frame.colorspace is None else int(frame.colorspace)
    if tagged in LUMA_WEIGHTS:
        return tagged, ()
    if tagged == UNTAGGED and side_data_of(frame).get("DOVI_METADATA") is not None:
        raise PsvideoError(
            f"{path}: is Dolby Vision whose picture stands for light only together with its metadata (profile 5), "
            "which is not read; expected HLG, PQ or SDR. Record or export one of these."
        )
    if tagged != UNTAGGED:
        names = ", ".join(sorted({name for name, *_ in LUMA_WEIGHTS.values()}))
        raise PsvideoError(
            f"{path}: its colours are coded with matrix {tagged} (ITU-T H.273), which is not read; expected {names} or "
            "RGB. Export the movie with one of these."
        )
    likely = 1 if frame.height >= HD_HEIGHT_PX else 6
    return likely, (
        "the movie does not say which matrix its colours are coded with; taken for "
        f"{LUMA_WEIGHTS[likely][0]}, as is usual at {frame.height} rows",
    )
