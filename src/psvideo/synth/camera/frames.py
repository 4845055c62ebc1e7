"""Frames as files: what each kind of file holds of what the sensor read."""

from pathlib import Path

import cv2
import numpy as np
import tifffile
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.formats.exr_files import write_exr
from psvideo.synth.camera.dpx_writer import dpx_bytes
from psvideo.synth.camera.encode import Codes
from psvideo.synth.scene_tables import CameraTable, Kind

SUFFIX: dict[Kind, str] = {"png16": ".png", "png8": ".png", "tif": ".tif", "exr": ".exr", "dng": ".dng", "dpx": ".dpx"}
CFA_CODES = {"R": 0, "G": 1, "B": 2}


def write_frame(path: Path, codes: NDArray[np.uint16], *, kind: Kind, camera: CameraTable, scale: Codes) -> None:
    """Write one frame's codes, (row, col) or (row, col, 3), as the kind of file says; EXR holds linear light."""
    if kind == "exr":
        light = scale.to_light(codes)
        planes = {"Y": light} if light.ndim == 2 else dict(zip("RGB", np.moveaxis(light, -1, 0), strict=True))
        write_exr(path, planes, fps=camera.rate)
    elif kind == "dng":
        _write_dng(path, codes, camera, scale)
    elif kind == "tif":
        tifffile.imwrite(path, codes, photometric="rgb" if codes.ndim == 3 else "minisblack", compression="zlib")
    elif kind == "dpx":
        path.write_bytes(dpx_bytes(codes, camera.bits))
    else:
        stored = codes if kind == "png16" else codes.astype(np.uint8)
        path.write_bytes(_png_bytes(path, stored))


def _png_bytes(path: Path, codes: NDArray[np.integer]) -> bytes:
    """Return a PNG; OpenCV takes colours as blue, green, red, and is fastest where no level is named."""
    ordered = codes if codes.ndim == 2 else codes[..., ::-1]
    done, data = cv2.imencode(".png", ordered)
    if not done:
        raise PsvideoError(
            f"{path}: OpenCV cannot encode this frame of {codes.shape[1]} x {codes.shape[0]} pixels as PNG."
        )
    return data.tobytes()


def _write_dng(path: Path, codes: NDArray[np.uint16], camera: CameraTable, scale: Codes) -> None:
    """Write a mosaic as an uncompressed CinemaDNG frame (DNG 1.4) with its levels, colour filters and rate."""
    pattern = bytes(CFA_CODES[name] for name in camera.cfa or "RGGB")
    matrix = tuple(value for row in np.eye(3, dtype=int).tolist() for number in row for value in (number, 1))
    model = camera.name.encode("ascii", "replace").decode()
    tags = [
        (33421, "H", 2, (2, 2), True),  # CFARepeatPatternDim
        (33422, "B", 4, pattern, True),  # CFAPattern
        (50706, "B", 4, (1, 4, 0, 0), True),  # DNGVersion
        (50707, "B", 4, (1, 1, 0, 0), True),  # DNGBackwardVersion
        (50708, "s", 0, model, True),  # UniqueCameraModel
        (50714, "H", 1, round(scale.black), True),  # BlackLevel
        (50717, "H", 1, round(scale.white), True),  # WhiteLevel
        (50721, "2i", 9, matrix, True),  # ColorMatrix1
        (50778, "H", 1, 21, True),  # CalibrationIlluminant1: D65
        (51044, "2i", 1, (camera.rate.numerator, camera.rate.denominator), True),  # FrameRate
    ]
    tifffile.imwrite(path, codes, photometric=32803, extratags=tags, software="psvideo synth")
