"""The virtual shoot: scenes, a renderer and a sensor, made to give footage whose truth is known.

It never uses the code that it is there to test: how a row integrates light is computed here by another method.
"""

from psvideo.synth.exposure import Exposure, expose
from psvideo.synth.noise import Noise
from psvideo.synth.scene import Scene, read_scene
from psvideo.synth.sensor import Flicker
from psvideo.synth.shoot import Shot, builtin_scene, shoot
from psvideo.synth.strobe import StrobeClock, TrueFlash

__all__ = [
    "Exposure",
    "Flicker",
    "Noise",
    "Scene",
    "Shot",
    "StrobeClock",
    "TrueFlash",
    "builtin_scene",
    "expose",
    "read_scene",
    "shoot",
]
