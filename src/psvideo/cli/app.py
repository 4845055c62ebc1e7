"""psvideo: the commands, assembled, and how faults become one paragraph and an exit status."""

import sys
from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from psvideo import __version__
from psvideo.cli.capture_plan import capture_plan
from psvideo.cli.demo import demo
from psvideo.cli.info import info
from psvideo.cli.normals import normals
from psvideo.cli.split import split
from psvideo.cli.sync import sync
from psvideo.cli.synth import synth
from psvideo.errors import PsvideoError

COMMANDS: tuple[Callable[..., None], ...] = (capture_plan, synth, sync, split, normals, info, demo)

app = typer.Typer(
    name="psvideo",
    help="Normals and albedo for every instant, from strobed rolling-shutter video.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
for command in COMMANDS:
    app.command()(command)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"psvideo {__version__}")
        raise typer.Exit


@app.callback()
def psvideo(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Say which version this is.")
    ] = False,
) -> None:
    """Normals and albedo for every instant, from strobed rolling-shutter video."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status: 0 done, 1 a fault of the footage or the run, 2 wrong usage.

    A fault is printed as one paragraph on stderr.
    """
    try:
        app(args=arguments)
    except PsvideoError as fault:
        print(f"psvideo: {fault}", file=sys.stderr)
        return fault.exit_status
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
