"""The whole of ``psvideo calibrate guess``: pictures of any rounded subject in, a rig of guessed directions out."""

from pathlib import Path

from psvideo.calibrate.guess import ERROR_DEG, Guess, guess_rig
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import said_of
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.whole_files import write_text
from psvideo.model.choices import Prior
from psvideo.runs.calibrate.reading import pictures_of, reading_of, rig_out
from psvideo.runs.steps.caller import PYTHON, Caller


def guess(
    pictures: Path | str,
    *,
    out: Path | str,
    prior: Prior | None = None,
    transfer: str | None = None,
    plan: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> Guess:
    """Guess directions of distant lights from pictures of a matte, rounded subject, where nothing was calibrated.

    ``prior``: "equal-lights" (six or more of one strength) or "equal-albedo"; left out: by how many there are. ``out``
    is the rig file to write; the other parameters are those of ``matte_sphere``. Raises UsageError where the output
    exists, and PsvideoError where there is too little to go by, or where the prior contradicts the pictures.
    """
    rig_path = rig_out(out, force=force)
    found = pictures_of(Path(pictures), reading_of(plan, frames, first_light, transfer), watch=watch, caller=caller)
    with said_of(pictures):
        made = guess_rig(found, prior=prior)
    said = (
        f"A GUESS: directions from the pictures alone ({made.prior}, and a subject that bulges to the camera). Expect "
        f"them to be wrong by {ERROR_DEG:g} degrees, and hollow may stand for bulging. Calibrate on a sphere."
    )
    write_text(rig_path, f"# {said}\n{format_rig(made.rig)}")
    caller.warn(said)
    return made
