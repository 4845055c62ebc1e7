"""psvideo calibrate: measure cameras and lights before a shoot."""

import typer

from psvideo.cli.commands.calibrate.colours import colours
from psvideo.cli.commands.calibrate.convert import convert
from psvideo.cli.commands.calibrate.flat_field import flat_field
from psvideo.cli.commands.calibrate.guess import guess
from psvideo.cli.commands.calibrate.intensities import intensities
from psvideo.cli.commands.calibrate.matte_sphere import matte_sphere
from psvideo.cli.commands.calibrate.mirror_sphere import mirror_sphere
from psvideo.cli.commands.calibrate.readout import readout

calibrate = typer.Typer(help="Measure cameras and lights before a shoot.", no_args_is_help=True)
calibrate.command("mirror-sphere")(mirror_sphere)
calibrate.command("matte-sphere")(matte_sphere)
calibrate.command("flat-field")(flat_field)
calibrate.command("colours")(colours)
calibrate.command("intensities")(intensities)
calibrate.command("guess")(guess)
calibrate.command("convert")(convert)
calibrate.command("readout")(readout)


@calibrate.callback()
def _calibrate() -> None:
    """Measure cameras and lights before a shoot."""
