"""The built-in meshes, made by formulas when they are asked for: nothing is stored, nothing is downloaded.

Every mesh is in metres at a natural size, y up, facing +z.
"""

from collections.abc import Callable

from psvideo.synth.meshes.basic import box, cylinder, plane, sphere
from psvideo.synth.meshes.head import bust
from psvideo.synth.shape import Shape

_MAKERS: dict[str, Callable[[], Shape]] = {
    "sphere": sphere,
    "box": box,
    "plane": plane,
    "cylinder": cylinder,
    "bust": bust,
}


def builtin_names() -> tuple[str, ...]:
    """Return the names of the built-in meshes."""
    return tuple(_MAKERS)


def builtin_shape(name: str) -> Shape:
    """Make a built-in mesh; ``name`` is one of ``builtin_names()``."""
    return _MAKERS[name]()
