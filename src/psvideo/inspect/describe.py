"""What a file or folder is, and whether it fits together: the library behind ``psvideo info``."""

from pathlib import Path

from psvideo.clip.folder import MOVIES
from psvideo.errors import PsvideoError
from psvideo.inspect.about_clip import describe_clip
from psvideo.inspect.about_file import describe_file
from psvideo.inspect.about_movie import describe_preview
from psvideo.inspect.about_output import (
    describe_output,
    describe_takes,
    is_plates,
    is_results,
    output_around,
    solved_takes_in,
)
from psvideo.inspect.findings import Description


def describe(path: Path, *, plan: Path | None = None) -> Description:
    """Describe a clip, a movie, a plan, rig or timing file, an image, or a folder of plates or results,
    of one take or of several.

    ``plan`` names the plan of a clip where it does not lie beside it. What does not fit is among the findings; raises
    PsvideoError only where the path is nothing that psvideo knows.
    """
    try:
        path.stat()
    except FileNotFoundError:
        raise PsvideoError(f"{path}: there is no such file or folder. Check the name.") from None
    except OSError as fault:
        raise PsvideoError(f"{path}: cannot be looked at ({fault.strerror}). Check its permissions.") from fault
    around = output_around(path.absolute()) if plan is None else None
    if path.suffix.lower() in MOVIES and path.is_file():
        return describe_clip(path, plan) if around is None else describe_preview(path, around)
    if not path.is_dir():
        return describe_file(path)
    if plan is None and (is_results(path) or is_plates(path)):
        return describe_output(path)
    if plan is None and around is None and solved_takes_in(path):
        return describe_takes(path)
    return describe_clip(path, plan) if around is None else describe_output(around)
