"""psvideo capture-plan: plan a shoot before a light is set.

Without ``-o`` the plan goes to standard output and everything for people to standard error, so that
``psvideo capture-plan ... > plan.toml`` is the same as ``-o plan.toml``.
"""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import psvideo.cli.options.capture as option
from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.records import spread
from psvideo.cli.spelling import spelled

if TYPE_CHECKING:
    from rich.console import Console

    from psvideo.capture.cameras import CameraMode
    from psvideo.capture.planning import Shoot

PIPE_WIDTH = 120
WIDEST_DIAGRAM = 120


@spread
def capture_plan(
    *,
    words: option.ShootWords,
    rig: option.LightsRig = None,
    out: option.PlanOut = None,
    diagram: option.Diagram = None,
    list_cameras: option.ListCameras = False,
    force: Force = False,
    voice: Voice,
) -> None:
    """Plan a shoot: write plan.toml, and print its figures and warnings."""
    from rich.console import Console

    from psvideo.cli.options.shoot_words import parse_request
    from psvideo.runs.capture_plan import capture_plan as plan_it

    if list_cameras:
        _list_cameras(voice)
        return
    request = parse_request(words)
    shoot = plan_it(request, out=out, rig=rig, diagram=diagram, force=force)
    _deliver(shoot, out, voice)
    if request.preset is not None:
        voice.detail(f"readout of the {request.preset.name}: {request.preset.source}")
    if not (voice.json or voice.quiet):
        _report(shoot, request.preset, Console(stderr=out is None, highlight=False), diagram=diagram)
    if out is not None:
        for path in (out, *([] if diagram in (None, "-") else [diagram])):
            voice.say(f"{path}: written.")
    for caution in shoot.cautions:
        if caution.level == "warning":
            voice.warn(caution.text)


def _list_cameras(voice: Voice) -> None:
    from rich.console import Console

    from psvideo.capture.cameras import camera_modes
    from psvideo.capture.tables import camera_table

    if voice.json:
        modes = [{**dataclasses.asdict(mode), "fps": str(mode.fps)} for mode in camera_modes()]
        voice.result({"cameras": modes})
    else:
        console = Console(highlight=False)
        console.width = console.width if console.is_terminal else PIPE_WIDTH
        console.print(camera_table(camera_modes()))


def _deliver(shoot: Shoot, out: Path | None, voice: Voice) -> None:
    """Print the plan where no file was asked for and --json does not take standard output for its own."""
    from psvideo.runs.capture_plan import plan_text

    text = plan_text(shoot)
    if out is None and not voice.json:
        print(text, end="")
        sys.stdout.flush()
    result = {"figures": dataclasses.asdict(shoot.figures), "chosen": shoot.chosen}
    cautions = [dataclasses.asdict(caution) for caution in shoot.cautions]
    voice.result({"path": str(out) if out else None, "plan": text, **result, "cautions": cautions})


def _report(shoot: Shoot, preset: CameraMode | None, console: Console, *, diagram: str | None) -> None:
    from psvideo.capture.drawing.diagram import TERMINAL, diagram_text
    from psvideo.capture.tables import shoot_report

    if diagram == TERMINAL or (diagram is None and console.is_terminal):
        console.print(diagram_text(shoot.plan, width=min(console.width, WIDEST_DIAGRAM)))
    for part in shoot_report(shoot, preset=preset):
        console.print(part)
        console.print()
    for caution in shoot.cautions:
        if caution.level == "note":
            console.print(f"note: {spelled(caution.text)}", markup=False)
