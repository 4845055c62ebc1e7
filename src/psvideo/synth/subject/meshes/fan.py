"""A desk fan in two meshes, so that the blades can turn in the cage that stands still."""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.synth.subject.meshes.basic import Paint, grid_faces, lathe, painted, tube
from psvideo.synth.subject.shape import Shape, make_shape, merged

BLADES = 5
REACH_M = 0.150
CAGE_M = 0.168
HOOPS_M = (0.040, 0.066, 0.091, 0.117, 0.142, 0.168)
STEEL: Paint = (0.56, 0.57, 0.58)


def fan_blades() -> Shape:
    """Hub and five twisted blades that turn about the z axis, 0.30 m across."""
    colours: list[Paint] = [
        (0.62, 0.30, 0.07),
        (0.08, 0.33, 0.42),
        (0.62, 0.30, 0.07),
        (0.08, 0.33, 0.42),
        (0.55, 0.50, 0.40),
    ]
    blades = [painted(_blade(2 * np.pi * k / BLADES), colours[k]) for k in range(BLADES)]
    dome = [
        (0.0, 0.030),
        (0.012, 0.0288),
        (0.022, 0.0245),
        (0.029, 0.0165),
        (0.032, 0.006),
        (0.032, -0.016),
        (0.0, -0.016),
    ]
    hub = lathe([*dome[:5], None, *dome[4:6], None, *dome[5:]], columns=96)
    forward = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    return merged(painted(make_shape(hub.vertices @ forward.T, hub.faces), (0.10, 0.10, 0.11)), *blades)


def _blade(angle: float) -> Shape:
    """One blade: an aerofoil strip that is wide in the middle, twisted from hub to tip, and a little cupped."""
    rows, cols = 44, 26
    out, across = np.meshgrid(np.linspace(0, 1, rows), np.linspace(-1, 1, cols), indexing="ij")
    radius = 0.026 + out * (REACH_M - 0.026)
    width = 0.018 + 0.034 * np.sin(np.pi * np.clip(out * 0.78 + 0.10, 0, 1)) ** 0.8
    round_tip = np.sqrt(np.clip(1 - np.clip((out - 0.86) / 0.14, 0, 1) ** 2 * 0.96, 0, 1))
    pitch = np.deg2rad(42 - 24 * out)
    chord = across * width * round_tip
    cup = 0.006 * (1 - across**2)
    bow = angle + 0.32 * out + (chord * np.cos(pitch) - cup * np.sin(pitch)) / np.maximum(radius, 0.03)
    z = chord * np.sin(pitch) + cup * np.cos(pitch)
    middle = np.stack([radius * np.cos(bow), radius * np.sin(bow), z], axis=-1).reshape(-1, 3)
    face = make_shape(middle, grid_faces(rows, cols))
    back = make_shape(middle - 0.0012 * face.normals, face.faces[:, ::-1])
    return merged(face, back)


def fan_cage() -> Shape:
    """The wire guard in front of and behind the blades, the motor, and the foot; 0.44 m high."""
    wires = []
    for depth, bulge in ((0.034, 0.022), (-0.034, -0.022)):
        wires += [tube(_ring(r, depth + bulge * (1 - (r / CAGE_M) ** 2)), 0.0016, closed=True) for r in HOOPS_M]
        wires += [tube(_spoke(2 * np.pi * (k + 0.5) / 16, depth, bulge), 0.0013) for k in range(16)]
    rim = [tube(_ring(CAGE_M, depth), 0.0034, closed=True) for depth in (0.034, 0.0, -0.034)]
    badge = [(0.0, 0.0595), (0.020, 0.0585), (0.036, 0.0545), (0.040, 0.0510)]
    cap = lathe([*badge, None, badge[-1], (0.040, 0.048), (0.0, 0.048)], columns=96)
    motor = lathe([(0.046, -0.040), (0.044, -0.100), (0.030, -0.128), (0.0, -0.135)], columns=96)
    forward = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    dark = [painted(make_shape(part.vertices @ forward.T, part.faces), (0.11, 0.12, 0.13)) for part in (cap, motor)]
    stand = lathe(
        [
            (0.013, -0.120),
            (0.013, -0.235),
            (0.020, -0.250),
            (0.070, -0.262),
            (0.085, -0.270),
            None,
            (0.085, -0.270),
            (0.085, -0.276),
        ],
        columns=128,
    )
    foot = painted(make_shape(stand.vertices + np.array([0, 0, -0.075]), stand.faces), (0.11, 0.12, 0.13))
    return merged(*(painted(wire, STEEL) for wire in [*wires, *rim]), *dark, foot)


def _ring(radius: float, z: float) -> Doubles:
    angle = 2 * np.pi * np.arange(120) / 120
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(120, z)], axis=-1)


def _spoke(angle: float, depth: float, bulge: float) -> Doubles:
    radius = np.linspace(0.036, CAGE_M, 24)
    swirl = angle + 0.35 * radius / CAGE_M
    z = depth + bulge * (1 - (radius / CAGE_M) ** 2)
    return np.stack([radius * np.cos(swirl), radius * np.sin(swirl), z], axis=-1)
