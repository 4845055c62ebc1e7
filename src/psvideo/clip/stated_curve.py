"""The curve by which photographs of one scene code light, where nobody names it: what they say, else what is usual."""

from collections.abc import Sequence
from pathlib import Path

from psvideo.clip.decoded import Header
from psvideo.clip.folder import RAWS
from psvideo.clip.stated import Stated
from psvideo.clip.transfer import LOGARITHMIC
from psvideo.errors import PsvideoError


def curve_of_pictures(files: Sequence[Path], kind: str, header: Header, stated: Sequence[Stated]) -> tuple[str, str]:
    """Return the name of the curve of pictures of one ``kind``, and why; ``header`` is the first one's.

    Raises PsvideoError where they say different things, or name a curve that is not known.
    """
    named = [one.transfer or "" for one in stated]
    odd = next((place for place, name in enumerate(named) if name != named[0]), None)
    if odd is not None:
        raise PsvideoError(
            f"{files[odd]}: says that its curve is {named[odd] or 'nothing in particular'} "
            f"({stated[odd].by or 'no profile'}), and {files[0].name} {named[0] or 'says nothing'} "
            f"({stated[0].by or 'no profile'}). Pictures with different curves cannot be compared: export them all "
            "alike, or say with `transfer` what holds for all."
        )
    if named[0] == "unknown":
        raise PsvideoError(
            f"{files[0]}: {stated[0].by} has a curve that psvideo does not know. Export the pictures as sRGB or "
            "linear, or say with `transfer` which curve comes nearest."
        )
    if header.transfer == LOGARITHMIC:
        raise PsvideoError(
            f"{files[0]}: says that it holds a logarithm of light, and not which. Say with `transfer` which curve it "
            "is, such as slog3 or logc3, or export the pictures as linear."
        )
    if header.transfer:
        return header.transfer, "as their header says"
    if named[0] and kind not in RAWS:
        return named[0], f"as {stated[0].by} says"
    if header.bits == 8:
        return "srgb", "the usual curve of 8-bit pictures: they say nothing themselves"
    depth = f"{header.bits} bits" if header.bits else "floating point"
    return "linear", f"the usual meaning of {kind.upper()} pictures of {depth}: they say nothing themselves"
