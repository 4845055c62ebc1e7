"""The whole of ``psvideo capture-plan``: what is wanted of a shoot in, its plan out."""

from dataclasses import replace
from pathlib import Path

from psvideo.capture.caution import Caution
from psvideo.capture.drawing.diagram import check_diagram_name, write_diagram
from psvideo.capture.planning import Shoot, plan_shoot
from psvideo.capture.request import ShootRequest
from psvideo.errors import PsvideoError
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.whole_files import PICTURE_MARK, refuse_existing, write_text
from psvideo.model.irradiance.ground import ground_of
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.irradiance.near_light import is_near
from psvideo.model.plan import Plan
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.solve.normals.illumination import illumination

MARK = "psvideo-plan/"
"""By which a file is known for a plan, which may be replaced."""


def capture_plan(
    request: ShootRequest,
    *,
    out: Path | str | None = None,
    rig: Path | str | None = None,
    diagram: str | None = None,
    force: bool = False,
) -> Shoot:
    """Plan a shoot, and write its plan and its timing diagram where they are asked for.

    ``out`` is the plan.toml to write; ``rig`` says where the lights will stand, which is compared with what normals
    need; ``diagram`` is a picture of the timing (.svg or .png; "-" means text, and draws none); ``force`` replaces
    either where it exists. Returns the shoot with its figures and ``cautions``: what may spoil it. Raises UsageError
    where an output exists, or where wishes exclude each other, and PsvideoError where the rig lacks a light.
    """
    plan_path, picture = None if out is None else Path(out), check_diagram_name(diagram)
    if plan_path is not None:
        refuse_existing(plan_path, force=force, mark=MARK)
    if picture is not None:
        refuse_existing(picture, force=force, mark=PICTURE_MARK)
    shoot = plan_shoot(request)
    if rig is not None:
        shoot = replace(shoot, cautions=(*shoot.cautions, *_about_the_rig(shoot.plan, Path(rig))))
    if picture is not None:
        write_diagram(shoot.plan, picture)
    if plan_path is not None:
        write_text(plan_path, plan_text(shoot))
    return shoot


def _about_the_rig(plan: Plan, path: Path) -> tuple[Caution, ...]:
    """Say whether the lights give normals, and how well. Raises PsvideoError where the rig lacks a planned light."""
    known = read_rig(path, plan_lights=plan.lights)
    lights = lights_as_planned(known, plan)
    if len(lights) < LEAST_LIGHTS:
        return ()
    camera = plan.camera
    near = is_near(lights)
    try:
        ground = ground_of(known, height_px=camera.height_px, width_px=camera.width_px) if near else None
        lit = illumination(lights, channels=3, ground=ground)
    except PsvideoError as fault:
        return (Caution(kind="rig", level="warning", text=f"{path}: {fault}"),)
    noise = f"The lights of {path} give normals. The condition number of their directions is {lit.condition:.2f}"
    return (Caution(kind="rig", level="note", text=f"{noise} (1 is best; noise grows with it)."),)


def plan_text(shoot: Shoot) -> str:
    """Return the plan as its file holds it."""
    return format_plan(shoot.plan).rstrip("\n") + "\n"
