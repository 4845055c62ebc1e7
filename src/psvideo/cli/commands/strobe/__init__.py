"""psvideo strobe: make lights flash as planned, on a board or on an emulated one."""

from psvideo.cli.commands.strobe.board import strobe

__all__ = ["strobe"]
