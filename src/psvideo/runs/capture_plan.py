"""The whole of ``psvideo capture-plan``: what is wanted of a shoot in, its plan out."""

from pathlib import Path

from psvideo.capture.drawing.diagram import check_diagram_name, write_diagram
from psvideo.capture.planning import Shoot, plan_shoot
from psvideo.capture.request import ShootRequest
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.whole_files import PICTURE_MARK, refuse_existing, write_text

MARK = "psvideo-plan/"
"""By which a file is known for a plan, which may be replaced."""


def capture_plan(
    request: ShootRequest,
    *,
    out: Path | str | None = None,
    diagram: str | None = None,
    force: bool = False,
) -> Shoot:
    """Plan a shoot, and write its plan and its timing diagram where they are asked for.

    ``out`` is the plan.toml to write; ``diagram`` a picture of the timing (.svg or .png; "-" means text, and draws
    none); ``force`` replaces either where it exists. Returns the shoot with its figures and ``cautions``: what may
    spoil it. Raises UsageError where an output exists, or where wishes exclude each other.
    """
    plan_path, picture = None if out is None else Path(out), check_diagram_name(diagram)
    if plan_path is not None:
        refuse_existing(plan_path, force=force, mark=MARK)
    if picture is not None:
        refuse_existing(picture, force=force, mark=PICTURE_MARK)
    shoot = plan_shoot(request)
    if picture is not None:
        write_diagram(shoot.plan, picture)
    if plan_path is not None:
        write_text(plan_path, plan_text(shoot))
    return shoot


def plan_text(shoot: Shoot) -> str:
    """Return the plan as its file holds it."""
    return format_plan(shoot.plan).rstrip("\n") + "\n"
