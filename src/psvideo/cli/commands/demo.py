"""psvideo demo: the whole chain, no camera, no arguments."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.records import spread


@spread
def demo(
    *,
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder to write.")] = Path("psvideo-demo"),
    force: Force = False,
    voice: Voice,
) -> None:
    """Film a virtual bust, find the flashes, solve for normals, and print the path of a picture of it all."""
    from psvideo.runs.demo import run_demo

    picture = run_demo(out, force=force, watch=voice.track)
    voice.result({"picture": str(picture)})
    voice.say(f"Results in {out / 'out'}; the clip and its truth in {out / 'clip'}. The picture:")
    voice.say(str(picture))
