"""A frame in memory, as timing and plates take it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.model.coded import IDENTITY, Coded, Tone


@dataclass(frozen=True)
class MemoryFrame:
    """A frame's place in time and its picture: linear light, or codes and what light they stand for."""

    index: int
    image: NDArray[Any]
    tone: Tone = IDENTITY

    @property
    def coded(self) -> Coded:
        """The picture in codes."""
        kind = np.float32 if self.tone is IDENTITY else self.image.dtype
        return Coded(codes=np.ascontiguousarray(self.image, kind), tone=self.tone)
