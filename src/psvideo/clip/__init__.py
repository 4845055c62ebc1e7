"""A clip on disk becomes frames in linear light, read when they are needed. The only room that knows decoders.

``open_clip`` finds the footage and its plan and checks that they fit. ``read_frames`` decodes, removes the transfer
curve and gives one frame after the other. ``keeping_near`` keeps decoded frames for a second look; ``demosaic`` makes
colour of a mosaic.

- records: ``record`` (a clip), ``take`` (a clip and the frames that are used), ``decoded`` (what decoders hand over)
- finding: ``opening``, ``folder``, ``stills`` (photographs), with ``stated`` (what photographs say of themselves),
  ``profile_curve`` and ``stated_curve`` (by which curve they code light), ``filters`` (whether they are a mosaic) and
  ``movie_rate`` (how a movie's rate goes with the plan's)
- reading: ``reading``, ``transfer`` and ``linear`` (from codes to light), ``tagged_curve`` (whether files say that they
  were coded otherwise), ``in_file``, ``kept`` and ``shown_file`` (codes that are not in memory)

Rooms: ``decode`` (one module for each kind of file), ``streams`` (frames that come while they are recorded), ``maps``
(masks and depth that others made of the footage).
"""

from psvideo.clip.decode.malvar2004 import demosaic
from psvideo.clip.kept import Kept, keeping_near
from psvideo.clip.maps.depth_map import DepthMaps, open_depth
from psvideo.clip.maps.mask import read_mask
from psvideo.clip.maps.mask_sequence import Masks, open_masks
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
