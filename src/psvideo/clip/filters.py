"""Colour filters on the sensor: what a picture says of them, compared with what the plan says."""

from pathlib import Path

from psvideo.clip.decoded import Header
from psvideo.errors import PsvideoError

COLOUR = 3
"""Channels of a picture that is colour already."""


def check_filters(name: str | Path, header: Header, cfa: str | None, *, plan: str | Path = "the plan") -> None:
    """Raise PsvideoError where ``cfa`` of ``plan`` is not what the picture that is called ``name`` holds."""
    if cfa is not None and header.channels == COLOUR:
        raise PsvideoError(
            f"{name}: is a colour picture, and {plan} says cfa = {cfa!r}, which is for mosaiced frames of one "
            "channel. Leave cfa out of the plan."
        )
    if cfa is not None and header.cfa is not None and header.cfa != cfa:
        raise PsvideoError(
            f"{name}: says that its colour filters are {header.cfa} from the top left pixel on, and {plan} says "
            f"cfa = {cfa!r}. Write cfa = {header.cfa!r} in the plan."
        )


def check_live_filters(name: str | Path, header: Header, cfa: str | None) -> None:
    """The same of a picture that comes while it is filmed, whose filters have to be known before the first one."""
    check_filters(name, header, cfa)
    if cfa is None and header.cfa is not None:
        raise PsvideoError(
            f"{name}: is a mosaic of colour filters, and the plan does not say so, as it has to before frames come: "
            f"write cfa = {header.cfa!r} under [camera] in it."
        )
