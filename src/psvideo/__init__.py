"""psvideo: normals and albedo for every instant, from strobed rolling-shutter video.

This is the front door: what ``import psvideo as ps`` offers, each name loaded when it is first used.
"""

import sys
from collections.abc import Callable
from importlib import import_module
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # what editors and type checkers see; _HOMES is the same for Python
    from psvideo.clip.maps.mask import read_mask as read_mask
    from psvideo.errors import PsvideoError as PsvideoError
    from psvideo.formats.plan_toml import read_plan as read_plan
    from psvideo.formats.rig_toml import read_rig as read_rig
    from psvideo.formats.timing_json import read_timing as read_timing
    from psvideo.model.plan import Plan as Plan
    from psvideo.model.rig import Light as Light
    from psvideo.model.rig import Rig as Rig
    from psvideo.model.surface import Surface as Surface
    from psvideo.model.timing import Timing as Timing
    from psvideo.pictures.quantity import picture_of as picture_of
    from psvideo.pictures.relighting import relight as relight
    from psvideo.plates.gather import gather as gather
    from psvideo.runs.check import check as check
    from psvideo.runs.many_takes.normals_of_takes import normals_of_takes as normals_of_takes
    from psvideo.runs.many_takes.split_of_takes import split_of_takes as split_of_takes
    from psvideo.runs.normals import normals as normals
    from psvideo.runs.photographs.light_sets import read_images as read_images
    from psvideo.runs.split import split as split
    from psvideo.runs.stills import stills as stills
    from psvideo.runs.sync import sync as sync
    from psvideo.runs.sync_cameras import sync_cameras as sync_cameras
    from psvideo.solve.depth.shaping import find_depth as find_depth
    from psvideo.solve.images import solve_images as solve_images
    from psvideo.solve.of_take import solve as solve
    from psvideo.sync.open_take import open_take as open_take
    from psvideo.sync.take_timing import find_timing as find_timing
    from psvideo.synth.shoot import shoot as shoot

_HOMES = {
    "Light": "psvideo.model.rig",
    "Plan": "psvideo.model.plan",
    "PsvideoError": "psvideo.errors",
    "Rig": "psvideo.model.rig",
    "Surface": "psvideo.model.surface",
    "Timing": "psvideo.model.timing",
    "check": "psvideo.runs.check",
    "find_depth": "psvideo.solve.depth.shaping",
    "find_timing": "psvideo.sync.take_timing",
    "gather": "psvideo.plates.gather",
    "normals": "psvideo.runs.normals",
    "normals_of_takes": "psvideo.runs.many_takes.normals_of_takes",
    "open_take": "psvideo.sync.open_take",
    "picture_of": "psvideo.pictures.quantity",
    "read_images": "psvideo.runs.photographs.light_sets",
    "read_mask": "psvideo.clip.maps.mask",
    "read_plan": "psvideo.formats.plan_toml",
    "read_rig": "psvideo.formats.rig_toml",
    "read_timing": "psvideo.formats.timing_json",
    "relight": "psvideo.pictures.relighting",
    "shoot": "psvideo.synth.shoot",
    "solve": "psvideo.solve.of_take",
    "solve_images": "psvideo.solve.images",
    "split": "psvideo.runs.split",
    "split_of_takes": "psvideo.runs.many_takes.split_of_takes",
    "stills": "psvideo.runs.stills",
    "sync": "psvideo.runs.sync",
    "sync_cameras": "psvideo.runs.sync_cameras",
}
"""Where each name lives; after a colon, its name there where it has another one."""

__all__ = [  # noqa: RUF022  (in the order of the work)
    "open_take",
    "read_plan",
    "read_rig",
    "read_timing",
    "read_images",
    "read_mask",
    "find_timing",
    "gather",
    "solve",
    "solve_images",
    "find_depth",
    "relight",
    "picture_of",
    "sync",
    "sync_cameras",
    "split",
    "normals",
    "normals_of_takes",
    "split_of_takes",
    "stills",
    "check",
    "shoot",
    "Plan",
    "Timing",
    "Rig",
    "Light",
    "Surface",
    "PsvideoError",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":  # read when asked for: importlib.metadata takes a tenth of a second, and most never ask
        from importlib.metadata import version

        return version("psvideo")
    if name not in _HOMES:
        raise AttributeError(f"module 'psvideo' has no attribute {name!r}")
    found = getattr(import_module(_HOMES[name]), name)
    globals()[name] = found = _answering(name, found) if isinstance(found, FunctionType) else found
    return found


def _answering(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with unknown and missing parameters answered as all mistakes are: by a PsvideoError."""
    from functools import wraps
    from inspect import signature

    from psvideo.errors import UsageError, nearest

    parameters = signature(function).parameters

    @wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        try:
            signature(function).bind(*given, **named)
        except TypeError as fault:
            unknown = next((one for one in named if one not in parameters), None)
            said = f"{fault}; its parameters are {', '.join(parameters)}."
            said = said if unknown is None else f"there is no parameter `{unknown}`; {nearest(unknown, parameters)}"
            raise UsageError(f"psvideo.{name}: {said}") from None
        return function(*given, **named)

    room = sys.modules.get(f"{__name__}.{name}")
    return call if room is None else _with_modules_of(room, call)


def _with_modules_of(room: ModuleType, call: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with the attributes of the room of its name, so that ``psvideo.solve.images`` is a module.

    Functions keep their attributes in a dictionary, as modules do: here both have the same one, so that modules which
    are imported later are seen as well.
    """
    room.__dict__.update(call.__dict__)  # __wrapped__, where inspect looks for the parameters
    call.__dict__ = room.__dict__
    return call


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


class _FrontDoor(ModuleType):
    """Keeps ``solve`` and ``sync`` functions: importing a room of the same name would put the room there."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _FrontDoor
