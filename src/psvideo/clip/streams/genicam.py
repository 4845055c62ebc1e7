"""Frames of a GenICam camera as they come, from a process of its own (``genicam_camera``); the extra ``genicam``.

A camera is named ``genicam`` (the first that is found) or ``genicam:SERIAL``, and may be set on the way:
``genicam:SERIAL?PixelFormat=BayerRG12&ExposureTime=8000``.
"""

import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from typing import IO, Any
from urllib.parse import parse_qsl

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decoded import CodedPicture, Header
from psvideo.clip.filters import check_live_filters
from psvideo.clip.linear import in_codes
from psvideo.clip.record import Frame
from psvideo.clip.streams.genicam_camera import HEAD
from psvideo.errors import PsvideoError
from psvideo.model.camera import Camera

SCHEME = "genicam"
BITS = re.compile(r"(?:Mono|RGB|BGR|Bayer[A-Z]{2})(\d+)")
AGAIN_S = 1.0
"""A camera that was lost is looked for again after this long."""
GIVES_UP_S = 60.0
"""And no longer than this."""
LONGEST_NUMBER = 65_535
"""Frames of older network cameras are numbered up to this, and then from 1 again."""


def is_genicam(source: str) -> bool:
    """Return whether a name is that of a GenICam camera."""
    return source == SCHEME or source.startswith((SCHEME + ":", SCHEME + "?"))


@dataclass(frozen=True, kw_only=True)
class FoundCamera:
    """A camera that is there: ``source`` is what to call it."""

    source: str
    label: str


def found_cameras() -> tuple[FoundCamera, ...]:
    """Return the GenICam cameras that there are; none where the extra is not installed.

    Raises PsvideoError where the camera's runtime fails.
    """
    if find_spec("pypylon") is None:
        return ()
    run = subprocess.run(_command("list"), capture_output=True, text=True, check=False)
    if run.returncode:
        raise PsvideoError(f"GenICam cameras cannot be listed: {run.stderr.strip() or _ended(run.returncode)}.")
    found = json.loads(run.stdout)
    return tuple(
        FoundCamera(source=f"{SCHEME}:{one['serial']}", label=f"{one['model']} ({one['kind']})") for one in found
    )


def read_genicam(source: str, camera: Camera, *, noted: Callable[[str], None]) -> Iterator[Frame]:
    """Give a camera's frames at their places in time, by the camera's own numbers.

    Where the camera vanishes, or its process breaks, ``noted`` gets a sentence and it is looked for again for a minute.
    Raises PsvideoError where it is not there to begin with, or gives other frames than the plan says.
    """
    if find_spec("pypylon") is None:
        raise PsvideoError(
            f"{source}: GenICam cameras need one more library: python -m pip install 'psvideo[genicam]'. Its runtime "
            "is Basler's, not free software, and comes with the wheel."
        )
    place, lost_s = -1, None
    while True:
        began = place + 1
        if lost_s is not None:
            began += round((time.monotonic() - lost_s) / camera.frame_period_s)
        try:
            for number, coded in _frames(source, camera):
                place, lost_s = began + number, None
                yield Frame(index=place, number=place, coded=in_codes(coded, camera.encoding))
        except _LostError as fault:
            if place < 0 or (lost_s is not None and time.monotonic() - lost_s > GIVES_UP_S):
                raise PsvideoError(
                    f"{source}: {fault}. Check cable and power, and what cameras there are (psvideo live, `list`)."
                ) from None
            if lost_s is None:
                lost_s = time.monotonic()
                noted(f"{source}: {fault}. It is looked for again.")
            time.sleep(AGAIN_S)


@dataclass(frozen=True, kw_only=True)
class _Mode:
    """What a camera's process says before its first frame: the pixel format's name, and the arrays that follow."""

    form: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]


class _LostError(Exception):
    """The camera's process gives no more frames."""


def _frames(source: str, camera: Camera) -> Iterator[tuple[int, CodedPicture]]:
    """Give the frames of one process, numbered from 0; raises _LostError when it ends."""
    name, _, query = source.removeprefix(SCHEME).removeprefix(":").partition("?")
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            _command(name, json.dumps(dict(parse_qsl(query)))), stdout=subprocess.PIPE, stderr=said
        )
        try:
            assert process.stdout is not None  # noqa: S101
            yield from _received(source, process.stdout, camera)
            raise _LostError(_words(said) or _ended(process.wait()))
        finally:
            process.kill()
            process.wait()
            with suppress(OSError):
                process.stdout.close()  # type: ignore[union-attr]


def _received(source: str, pipe: IO[bytes], camera: Camera) -> Iterator[tuple[int, CodedPicture]]:
    line = pipe.readline()
    if not line:
        return
    said = json.loads(line)
    mode = _Mode(form=said["format"], shape=tuple(said["shape"]), dtype=np.dtype(said["type"]))
    header = _header(source, mode, camera)
    first, turns, before = None, 0, 0
    while len(head := pipe.read(HEAD.size)) == HEAD.size:
        number, _, count = HEAD.unpack(head)
        codes = np.empty(mode.shape, mode.dtype)
        if count != codes.nbytes or not _filled(pipe, codes):
            return
        turns += LONGEST_NUMBER if number + turns < before else 0
        first, before = number + turns if first is None else first, number + turns
        yield before - first, CodedPicture(header=header, codes=codes)


def _filled(pipe: IO[bytes], codes: NDArray[Any]) -> bool:
    """Read a frame's bytes to where they are wanted; False where the pipe ends before."""
    left = codes.reshape(-1).view(np.uint8).data
    while left:
        count = pipe.readinto(left)  # type: ignore[attr-defined]
        if not count:
            return False
        left = left[count:]
    return True


def _header(source: str, mode: "_Mode", camera: Camera) -> Header:
    """Return what the camera's mode says of its frames, compared with the plan."""
    form, (height_px, width_px, *rest) = mode.form, mode.shape
    bits = BITS.match(form)
    if bits is None or form.startswith("BGR"):
        raise PsvideoError(
            f"{source}: sends {form}; expected Mono, Bayer or RGB of 8 to 16 bits. Set it: {SCHEME}?PixelFormat=Mono8."
        )
    if (width_px, height_px) != (camera.width_px, camera.height_px):
        raise PsvideoError(
            f"{source}: sends {width_px} x {height_px} pixels, and the plan says {camera.width_px} x "
            f"{camera.height_px}. Set the camera to the plan's size ({SCHEME}?Width=…&Height=…), or use the plan of "
            "this mode."
        )
    filters = {"RG": "RGGB", "GR": "GRBG", "GB": "GBRG", "BG": "BGGR"}
    cfa = filters[form[5:7]] if form.startswith("Bayer") else None
    channels = rest[0] if rest else 1
    header = Header(width_px=width_px, height_px=height_px, channels=channels, bits=int(bits[1]), cfa=cfa)
    check_live_filters(source, header, camera.encoding.cfa)
    return header


def _command(*words: str) -> list[str]:
    return [sys.executable, "-m", "psvideo.clip.streams.genicam_camera", *words]


def _words(said: IO[bytes]) -> str:
    said.seek(0)
    lines = said.read().decode("utf-8", "replace").strip().splitlines()
    return lines[-1].rstrip(".") if lines else ""


def _ended(status: int) -> str:
    return f"the camera's process ended by itself ({'signal' if status < 0 else 'status'} {abs(status)})"
