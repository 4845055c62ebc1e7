"""psvideo calibrate guess: directions of lights from pictures of the subject alone."""

from __future__ import annotations

from typing import Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.calibrate import Pictures, RigOut, Transfer
from psvideo.cli.options.clip_and_run import ClipWords, Force
from psvideo.cli.options.records import spread
from psvideo.model.choices import Prior
from psvideo.model.units import counted


@spread
def guess(
    pictures: Pictures,
    out: RigOut,
    *,
    prior: Annotated[
        Prior | None,
        typer.Option(
            help="What to assume: equal-lights (six or more, equally strong) or equal-albedo (one paint); left out: "
            "chosen by the number of lights."
        ),
    ] = None,
    transfer: Transfer = None,
    words: ClipWords,
    force: Force = False,
    voice: Voice,
) -> None:
    """Guess directions of distant lights from pictures of a matte, rounded subject, where nothing was calibrated."""
    from psvideo.runs.calibrate.guess import guess as guess_lights

    made = guess_lights(
        pictures,
        out=out,
        prior=prior,
        transfer=transfer,
        **vars(words),
        force=force,
        watch=voice.track,
        caller=voice.caller(),
    )
    for light in made.rig.lights:
        where = ", ".join(f"{value:+.2f}" for value in light.direction or ())
        voice.say(f"  {light.name:12} direction {where}  intensity {light.intensity[0]:.3f}")
    voice.say(
        f"A matte surface explains {made.explained:.1%} of the pictures; {made.prior} holds to {made.spread:.1%}."
    )
    voice.say(f"{out}: {counted(len(made.rig.lights), 'light')} written.")
    voice.result({"guess": True, "prior": made.prior, "explained": made.explained, "spread": made.spread})
