"""Pictures that wait for the next round, held in half the memory: 16-bit codes over the range of what they show."""

import numpy as np

from psvideo.model.coded import Coded, Tone
from psvideo.plates.mixture import Mixture

MOST_CODE = 65535


def packed(picture: Mixture, saturation: float) -> Mixture:
    """Return a picture in half its memory, good to half a step of its codes; what is saturated is so still.

    One that is not made yet is held by its frames, and comes back as it is.
    """
    if not picture.is_made:
        return picture
    image = picture.image()
    least, most = float(image.min()), float(image.max())
    step = max((most - least) / MOST_CODE, 1e-12)
    codes = image - np.float32(least)
    codes *= np.float32(1 / step)
    codes += np.float32(0.5)
    tone = Tone(zero=np.full((1, 1), -least / step), gain=np.full((1, 1), step))
    coded = Coded(codes=np.clip(codes, 0, MOST_CODE, out=codes).astype(np.uint16), tone=tone)
    return Mixture(
        frames=(coded,),
        coefficients=np.ones((1, len(image))),
        ceiling=saturation,
        clips_from=saturation - step if most >= saturation else np.inf,
    )
