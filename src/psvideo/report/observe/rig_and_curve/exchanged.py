"""Whether two lights of a rig are taken for each other: exchanged back, they explain what the rig leaves over."""

from itertools import combinations

import numpy as np

from psvideo.model.arrays import Doubles

LIGHTS_FOR_EXCHANGE = 6
"""Of fewer lights, other faults than an exchange are explained as well by one."""
EXPLAINED, BEST = 0.6, 0.75
"""Two lights are exchanged where that leaves less than the first of what is left over (root mean square), and less than
the second of what any other two leave. (Photographs under right rigs: 0.87 and more; each light 7 degrees off: 0.69 and
more; a list that is one off: 0.64 and more; two of six to 24 exchanged: mostly 0.2 to 0.6.)"""


def exchanged(moments: Doubles, beyond: Doubles) -> tuple[int, int] | None:
    """Return the two lights that are surely exchanged; None where none are.

    ``moments`` (light, light) is the sum of points' light times itself, ``beyond`` projects to what no normal explains.
    """
    count = len(moments)
    if count < LIGHTS_FOR_EXCHANGE:
        return None
    left = float((beyond * moments).sum())
    found = []
    for pair in combinations(range(count), 2):
        order = np.arange(count)
        order[list(pair)] = pair[::-1]
        found.append((float((beyond[np.ix_(order, order)] * moments).sum()), pair))
    (least, pair), (next_least, _) = sorted(found)[:2]
    return pair if least < min(EXPLAINED**2 * left, BEST**2 * next_least) else None
