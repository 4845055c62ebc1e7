"""From what the sensor collected to the numbers in a file: mosaic, noise, converter, transfer curve, container."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Image
from psvideo.synth.camera.curves import CURVES, CameraCurve
from psvideo.synth.camera.noise import Noise
from psvideo.synth.scene_tables import CameraTable, Kind

COLOURS = {"R": 0, "G": 1, "B": 2}


@dataclass(frozen=True, kw_only=True)
class Codes:
    """How linear light becomes code values: ``black`` and ``white`` are codes of 0 and 1, ``top`` the largest code.

    ``bits`` are the camera's; ``top`` belongs to the file, whose codes may be spread over more bits.
    """

    curve: CameraCurve
    bits: int
    black: float
    white: float
    top: int

    def from_light(self, light: Image) -> NDArray[np.uint16]:
        """Return the file's codes; light above saturation and far below black is cut off."""
        steps = 2**self.bits - 1
        low, high = (self.curve.decode(np.array(level / self.top)) for level in (self.black, self.white))
        code = self.curve.encode(low + np.minimum(light, np.float32(1.0)) * (high - low))
        counted = np.clip(np.round(code * np.float32(steps)), 0, steps)
        return np.round(counted * np.float32(self.top / steps)).astype(np.uint16)

    def to_light(self, codes: NDArray[np.uint16]) -> Image:
        """Return the linear light that codes stand for, 1.0 = saturation: the inverse, but for its steps."""
        low, high, here = (self.curve.decode(np.asarray(c) / self.top) for c in (self.black, self.white, codes))
        return np.asarray((here - low) / (high - low), np.float32)


def codes_of(camera: CameraTable, kind: Kind) -> Codes:
    """Return the codes of a kind of file. PNG and TIFF spread the camera's bits over the file's whole range.

    Left out in the scene, black is a sixteenth of the range for linear codes and the curve's own zero for others, and
    white is the largest code.
    """
    curve = CURVES[camera.transfer]
    steps = 2**camera.bits - 1
    top = 65535 if kind in ("png16", "tif") else steps
    black = 2.0 ** (camera.bits - 4) if camera.transfer == "linear" else curve.zero * steps
    white = float(steps)
    if camera.black_level is not None:
        black = camera.black_level
    if camera.white_level is not None:
        white = camera.white_level
    return Codes(
        curve=curve,
        bits=camera.bits,
        black=float(round(black * top / steps)),
        white=float(round(white * top / steps)),
        top=top,
    )


def mosaic(image: Image, cfa: str) -> Image:
    """Return the samples that a sensor keeps whose colour filters repeat ``cfa`` (top left, top right, bottom ...)."""
    kept = np.empty(image.shape[:2], np.float32)
    for place, name in enumerate(cfa):
        row, col = divmod(place, 2)
        kept[row::2, col::2] = image[row::2, col::2, COLOURS[name]]
    return kept


def sensor_noise(camera: CameraTable) -> Noise:
    """Return the noise that the scene gives its camera."""
    return Noise(full_well_e=camera.full_well_e, read_e=camera.read_e)
