"""The process that holds a GenICam camera: frames out on standard output, one line on standard error where it fails.

It is a process of its own because a camera's runtime brings libraries that do not stand beside others in one process,
and because one that crashes must take nothing else with it. Run as ``python -m psvideo.clip.streams.genicam_camera``.
"""

import json
import os
import re
import struct
import sys
from collections.abc import Iterator
from typing import Any, BinaryIO

HEAD = struct.Struct("<QQQ")
"""What stands before a frame's bytes: the camera's number of it, its time stamp, and how many bytes follow."""
WHERE = re.compile(r" : \w+Exception ")
"""Behind a fault's words stands where in the runtime's sources it was thrown."""
WAIT_MS = 5000
"""A camera from which nothing comes for this long has stopped."""


def cameras() -> list[dict[str, str]]:
    """Return what cameras there are: serial number, model, and how they are connected."""
    from pypylon import pylon

    found = pylon.TlFactory.GetInstance().EnumerateDevices()
    return [
        {"serial": one.GetSerialNumber(), "model": one.GetModelName(), "kind": one.GetDeviceClass()} for one in found
    ]


def _opened(serial: str, features: dict[str, str]) -> Any:
    from pypylon import pylon

    factory = pylon.TlFactory.GetInstance()
    found = [one for one in factory.EnumerateDevices() if serial in ("", one.GetSerialNumber())]
    if not found:
        known = ", ".join(one["serial"] for one in cameras()) or "none"
        raise LookupError(f"there is no such camera; there are: {known}")
    camera = pylon.InstantCamera(factory.CreateDevice(found[0]))
    camera.Open()
    for name, value in features.items():
        node = camera.GetNodeMap().GetNode(name)
        if node is None or not getattr(node, "IsValid", lambda: True)():  # newer runtimes give one of nothing
            raise LookupError(f"it has no feature {name}")
        try:
            node.FromString(value)
        except Exception as fault:  # the runtime raises what it likes, with where in its sources
            why = WHERE.split(" ".join(str(fault).split()))[0].rstrip(". ")
            raise ValueError(f"its feature {name} cannot be set to {value} ({why})") from None
    return camera


def _grabbed(camera: Any) -> Iterator[tuple[int, int, Any]]:
    """Yield number, time stamp and codes of every frame that came whole."""
    from pypylon import pylon

    camera.MaxNumBuffer.Value = 64
    camera.StartGrabbing(pylon.GrabStrategy_OneByOne)
    while camera.IsGrabbing():
        result = camera.RetrieveResult(WAIT_MS, pylon.TimeoutHandling_ThrowException)
        try:
            if result.GrabSucceeded():
                yield result.BlockID, result.TimeStamp, result.Array
        finally:
            result.Release()


def send(camera: Any, out: BinaryIO) -> None:
    """Write what the camera gives: a line of JSON on its mode, then frame by frame, until nobody reads."""
    first = True
    for number, stamp, codes in _grabbed(camera):
        if first:
            mode = {"format": camera.GetNodeMap().GetNode("PixelFormat").ToString(), "shape": list(codes.shape)}
            out.write(json.dumps({**mode, "type": codes.dtype.str}).encode() + b"\n")
            first = False
        out.write(HEAD.pack(number, stamp, codes.nbytes))
        out.write(memoryview(codes).cast("B"))
        out.flush()


def main(words: list[str]) -> int:
    """Serve the camera of a serial number (none: the first), with features set from JSON; or list those there are."""
    try:
        if words == ["list"]:
            print(json.dumps(cameras()))
            return 0
        send(_opened(words[0], json.loads(words[1])), sys.stdout.buffer)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except Exception as fault:  # the runtime raises what it likes; the other process says it
        print(" ".join(str(fault).split())[:300], file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
