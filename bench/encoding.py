"""What one EXR of noisy normals at 1080p costs by compression: processor time, of which OpenEXR's own, and size."""

import io
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np
import OpenEXR

from bench.observing import noisy_surface
from psvideo.export.sequences.planes import InstantPictures, planes_of
from psvideo.export.space import Space
from psvideo.formats.exr_files import write_exr
from psvideo.model.choices import Compression

REPEATS = 3


class Encoded(NamedTuple):
    """Times in milliseconds; ``beside`` is what is not OpenEXR's: checks, and the bytes' way to the disk."""

    compression: str
    half: str
    openexr_alone: str
    beside: str
    size: str
    float_32_bit: str
    float_size: str


def rows() -> Iterator[Encoded]:
    """Write the normals of one surface with every compression, as half floats and as floats."""
    made = InstantPictures(surface=noisy_surface(0), space=Space())
    planes = {name: np.ascontiguousarray(plane) for name, plane in planes_of("normals", made).items()}
    with tempfile.TemporaryDirectory(prefix="psvideo-bench-") as folder:
        path = Path(folder) / "normals.exr"
        for compression in get_args(Compression):
            half_s = _taken_s(partial(write_exr, path, planes, compression=compression))
            half_mb = path.stat().st_size / 1e6
            alone_s = _taken_s(partial(_openexr_alone, planes, compression))
            float_s = _taken_s(partial(write_exr, path, planes, half=False, compression=compression))
            yield Encoded(
                compression=compression,
                half=f"{1e3 * half_s:.0f}",
                openexr_alone=f"{1e3 * alone_s:.0f}",
                beside=f"{1e3 * (half_s - alone_s):.0f}",
                size=f"{half_mb:.1f} MB",
                float_32_bit=f"{1e3 * float_s:.0f}",
                float_size=f"{path.stat().st_size / 1e6:.1f} MB",
            )


def _openexr_alone(planes: dict[str, np.ndarray], compression: Compression) -> None:
    kind = getattr(OpenEXR, "NO_COMPRESSION" if compression == "none" else f"{compression.upper()}_COMPRESSION")
    header = {"type": OpenEXR.scanlineimage, "compression": kind}
    OpenEXR.File(header, dict(planes)).write(io.BytesIO())


def _taken_s(action: Callable[[], object]) -> float:
    taken_s = []
    for _ in range(REPEATS):
        began = time.process_time()
        action()
        taken_s.append(time.process_time() - began)
    return min(taken_s)
