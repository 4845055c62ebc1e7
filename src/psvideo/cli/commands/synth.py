"""psvideo synth: film a virtual scene."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.per_light import parse_lines
from psvideo.cli.options.records import spread
from psvideo.errors import UsageError

if TYPE_CHECKING:
    from psvideo.synth.lamps.traced import TraceOptions


@spread
def synth(
    scene: Annotated[
        Path,
        typer.Argument(
            help="A scene file, or a scene of psvideo: bust, cameras, colour, fan, gloss, sphere, still_life."
        ),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The clip folder to write.")],
    *,
    camera: Annotated[
        str | None,
        typer.Option("--camera", metavar="NAME", help="Which of the scene's cameras films; left out, the first."),
    ] = None,
    trace: Annotated[
        Path | None,
        typer.Option("--trace", help="Light the scene by the edges of psvideo strobe emulate --trace FILE."),
    ] = None,
    line: Annotated[
        list[str] | None,
        typer.Option("--line", metavar="NAME=NUMBER", help="Which line of the trace a light is wired to."),
    ] = None,
    force: Force = False,
    voice: Voice,
) -> None:
    """Film a virtual scene: a clip folder as a camera would leave it, and the truth beside it in truth/."""
    from psvideo.synth.shoot import shoot

    shot = shoot(
        scene,
        out,
        camera=camera,
        force=force,
        track=lambda frames: voice.track(frames, total=len(frames), what="filming"),
        trace=_trace_options(trace, parse_lines(line)),
    )
    for warning in shot.warnings:
        voice.warn(warning)
    clock = shot.clock
    voice.detail(
        f"a cycle began at {clock.phase_s * 1e3:.4f} ms; the strobe's clock is {clock.offset_ppm:+.1f} ppm off"
    )
    voice.say(
        f"{out}: {shot.frames} frames; {shot.complete} of {shot.flashes} flashes complete; truth in {out / 'truth'}"
    )
    voice.result({**dataclasses.asdict(shot), "path": str(shot.path)})


def _trace_options(trace: Path | None, lines: dict[str, int]) -> "TraceOptions | None":
    from psvideo.synth.lamps.traced import TraceOptions

    if trace is None:
        if lines:
            raise UsageError("--line: says which line of a trace a light is wired to; give --trace FILE with it.")
        return None
    return TraceOptions(path=trace, lines=lines)
