"""A clip on disk becomes linear float frames, lazily. The only room that knows decoders.

``open_clip`` finds the footage and its plan and checks that they fit; ``read_frames`` decodes, takes the transfer
curve off and gives one frame after the other; ``keeping_near`` keeps what was decoded for a second look; ``demosaic``
makes colour of a mosaic.

``decode`` has a module for each kind of file. ``record`` and ``take`` hold the records; ``folder`` and ``opening``
find files, ``stills`` photographs; ``reading`` reads, with ``transfer`` and ``linear`` from codes to light,
``in_file`` and ``kept`` for codes that are not in memory; ``stated`` is what photographs say of themselves,
``filters`` whether they are a mosaic. What comes
while it is recorded: ``growing_folder``, ``stream``, ``genicam`` with ``genicam_camera``. Beside the footage: ``mask``
and ``mask_sequence``, ``depth_map``.
"""

from psvideo.clip.decode.malvar2004 import demosaic
from psvideo.clip.depth_map import DepthMaps, open_depth
from psvideo.clip.kept import Kept, keeping_near
from psvideo.clip.mask import read_mask
from psvideo.clip.mask_sequence import Masks, open_masks
from psvideo.clip.opening import open_clip
from psvideo.clip.reading import holds_plain_codes, parse_range, read_frames
from psvideo.clip.record import Clip, Frame, holes
from psvideo.clip.take import Take, check_take, decoded_once

__all__ = [
    "Clip",
    "DepthMaps",
    "Frame",
    "Kept",
    "Masks",
    "Take",
    "check_take",
    "decoded_once",
    "demosaic",
    "holds_plain_codes",
    "holes",
    "keeping_near",
    "open_clip",
    "open_depth",
    "open_masks",
    "parse_range",
    "read_frames",
    "read_mask",
]
