"""The virtual shoot: scenes, a renderer and a sensor, which give footage whose truth is known.

It never uses the code that it tests: how a row integrates light is computed here by another method.

``shoot`` does it: begin there. It reads a ``scene`` of ``scene_tables`` (``scenes`` finds those that come with
psvideo; ``other_cameras`` gives it as another of its cameras films it), makes plan, rig and clock of it (``shotplan``),
sets it up from ``subject`` and ``lamps`` (``stage``), films it with ``camera``, and writes the ``truth`` beside the
clip, that of every flash (``flash_truth``) as it is rendered.
"""

from psvideo.synth.camera.exposure import Exposure, expose
from psvideo.synth.camera.noise import Noise
from psvideo.synth.camera.sensor import MainsSwing
from psvideo.synth.lamps.true_flashes import TrueClock, TrueFlash
from psvideo.synth.scene import Scene, read_scene
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.shoot import VirtualTake, shoot

__all__ = [
    "Exposure",
    "MainsSwing",
    "Noise",
    "Scene",
    "TrueClock",
    "TrueFlash",
    "VirtualTake",
    "builtin_scene",
    "expose",
    "read_scene",
    "shoot",
]
