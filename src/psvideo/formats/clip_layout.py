"""How a clip lies on disk: its frames beside a plan, or in a folder beside it."""

from pathlib import Path

from psvideo.errors import PsvideoError

FRAMES, PLAN_FILE = "frames", "plan.toml"
"""What may hold a clip's frames in its folder, and what its plan is called there."""
SETUP = "setup"
"""The folder in a result of photographs that holds how they were taken to be: plan, rig, and the lights as a list."""


def find_plan(path: Path, *, given: Path | None = None) -> Path:
    """Return the plan that belongs to a clip: the one given, else plan.toml in the folder or beside the movie."""
    if given is not None:
        return given
    folder = path if path.is_dir() else path.parent
    plan = folder / PLAN_FILE
    if not plan.is_file() and folder.name == FRAMES and (folder.parent / PLAN_FILE).is_file():
        raise PsvideoError(f"{folder}: there is no plan.toml here, but one folder up. Name the clip: {folder.parent}")
    if not plan.is_file():
        raise PsvideoError(
            f"{path}: there is no plan.toml {'here' if path.is_dir() else 'beside it'}. Put the plan that the strobe "
            "played beside the footage, "
            "name it with `plan`, or write one with psvideo capture-plan. Photographs, one per light, need none: "
            "psvideo stills."
        )
    return plan
