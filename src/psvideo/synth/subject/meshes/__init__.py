"""The built-in meshes, made by formulas when they are asked for: nothing is stored, nothing is downloaded.

Every mesh is in metres at a natural size, y up, facing +z. ``basic`` has plain bodies, ``still_life`` and ``fan`` have
things; ``head`` and its ``face`` are sculpted with ``fields`` and made a mesh by ``surface_nets``.
"""

import dataclasses
from collections.abc import Callable
from functools import cache

import numpy as np

from psvideo.synth.subject.meshes.basic import box, cylinder, plane, sphere
from psvideo.synth.subject.meshes.fan import fan_blades, fan_cage
from psvideo.synth.subject.meshes.head import bust
from psvideo.synth.subject.meshes.still_life import apple, book, cloth, pear, vase
from psvideo.synth.subject.shape import Shape

_MAKERS: dict[str, Callable[[], Shape]] = {
    maker.__name__: maker
    for maker in (sphere, box, plane, cylinder, bust, vase, apple, pear, book, cloth, fan_blades, fan_cage)
}


def builtin_names() -> tuple[str, ...]:
    """Return the names of the built-in meshes."""
    return tuple(_MAKERS)


@cache
def builtin_shape(name: str) -> Shape:
    """Make a built-in mesh, once in a process: the bust takes 3 s. ``name`` is one of ``builtin_names()``; what is
    returned cannot be written into."""
    shape = _MAKERS[name]()
    for one in dataclasses.fields(shape):
        if isinstance(held := getattr(shape, one.name), np.ndarray):
            held.flags.writeable = False
    return shape
