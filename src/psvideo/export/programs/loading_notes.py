"""A note beside each delivery that says how to load it into a program.

What a note says of Blender was tried in Blender itself (tests/test_clients_blender.py); the notes for Nuke, Unreal and
Houdini follow their manuals.
"""

from collections.abc import Sequence

from psvideo.export.programs.blender_addon import ADDON_FILE
from psvideo.export.programs.delivered import Delivered
from psvideo.export.sequences.result_files import result_name
from psvideo.model.choices import Program
from psvideo.model.units import counted


def note_name(program: Program) -> str:
    """Return the name of a program's note in the output folder."""
    return f"README-{program}.txt"


def loading_note(program: Program, made: Delivered) -> str:
    """Return how to load a delivery into a program: steps, colour space, direction of y, numbers, wrong ways."""
    parts = {"nuke": _nuke, "blender": _blender, "unreal": _unreal, "houdini": _houdini}[program](made)
    steps, wrong = parts
    return "\n".join(
        [
            f"{made.clip} in {program.capitalize()}",
            "",
            *_facts(made),
            "",
            "How to load it",
            *(f"{n}. {step}" for n, step in enumerate(steps, start=1)),
            "",
            "Known wrong ways",
            *(f"- {sentence}" for sentence in wrong),
            "",
        ]
    )


def _facts(made: Delivered) -> list[str]:
    space, count = made.delivery.space, len(made.numbers)
    missing = made.last - made.first + 1 - count
    results = counted(count, "result") + (f"; {counted(missing, 'number')} between them missing" if missing else "")
    frame = {
        "camera": "camera space: x right, y up, z towards the camera",
        "world": f"world space: the axes of the camera's file, {space.up} up",
        "tangent": "tangent space of a flat card that faces the camera: x right, y up, z out of it",
    }[space.name]
    usual = "" if space.name == "world" else " (y up, OpenGL)"
    flipped = "; the green channel is flipped (y down, DirectX)" if space.y == "down" else usual
    rate = f"{float(made.fps):.6g}" + (f" ({made.fps})" if made.fps.denominator > 1 else "")
    facts = [
        f"Numbers {made.first} to {made.last} ({results}), {rate} frames a second.",
        f"Normals are in {frame}{flipped}.",
        "EXR: signed unit vectors, -1 to 1, and 0 where there is none. They are data: no colour space, no curve.",
    ]
    if made.delivery.png16:
        facts.append("PNG, 16 bits: 0.5 + 0.5 n, data as well. Its tags say linear, but many programs assume sRGB.")
    if "position" in made.delivery.aovs:
        unit = "the unit of the camera's file" if space.name == "world" else "metres"
        facts.append(f"Positions are in the frame of the normals, in {unit if made.metric else 'a relative unit'}.")
    elif made.delivery.needs_depth:
        facts.append(f"Depth is in {'metres' if made.metric else 'a relative unit'}.")
    return [
        *facts,
        "valid/ is 1 where a normal was measured and is to be trusted; where it is 0, a normal is a best estimate at "
        "most. Multiply by it where only measured ones may count, and never filter across its edge.",
    ]


def _nuke(made: Delivered) -> tuple[Sequence[str], Sequence[str]]:
    bundle = f"{made.clip}.####.exr"
    files = bundle if made.delivery.multipart else f"normals/{made.clip}_normals.####.exr (and the others, one each)"
    world = made.delivery.space.name == "world"
    camera = (
        "the camera whose file `camera_to_world` named"
        if world
        else "a Camera at the origin without rotation (camera space is its own), with the shot's focal length"
    )
    relight = [
        "ReLight: this into color, normal vectors = normals, point positions = position, use alpha on; "
        f"cam = {camera}; lights = a Scene with your lights, in the same frame and unit.",
        "ReLight needs a material: a Diffuse node (white) on its material input gives albedo * n.l.",
    ]
    without = (
        "ReLight needs point positions in metres, which this rig does not give (lens and plane): use the script's "
        "groups."
    )
    groups = (
        "a relighting group for every light of the shoot"
        if made.lights
        else "a relighting group for one light of its own, since those of the shoot have no one direction here"
    )
    return (
        [
            f"Open {made.clip}.nk, which lies beside this note: the sequences read as they must be, {groups} (drag its "
            "direction and colour), and their sum. Or by hand:",
            f"Read: {files}, range {made.first}-{made.last}; tick Raw Data. Set the project to "
            f"{float(made.fps):.6g} fps.",
            f"The parts of the file are layers of these names: {', '.join(made.delivery.bundle)}. x, y, z are in red, "
            "green, blue; beauty is the sum of all lights, with alpha.",
            "Shuffle albedo into rgba, valid into alpha.",
            *(relight if "position" in made.delivery.aovs else [without]),
        ],
        [
            "Without Raw Data a colour space may be applied to vectors: the light comes from wrong directions.",
            "Normals of one space with positions of another: ReLight takes both as one space.",
            "Reformat, blur or retime of normals: average, then divide by the length again, or leave it.",
        ],
    )


def _blender(made: Delivered) -> tuple[Sequence[str], Sequence[str]]:
    space = made.delivery.space
    exr, png = (result_name(made.clip, "normals", made.first, suffix=kind) for kind in ("exr", "png"))
    turn = [
        "Vector Math, Multiply by (1, 1, -1): the camera of the next node looks along +z.",
        "Vector Transform: type Normal, from Camera to World, into the Normal of a BSDF.",
    ]
    return (
        [
            f"Edit > Preferences > Add-ons > Install from Disk: {ADDON_FILE}, which lies beside this note. Then File > "
            "Import > psvideo results, and choose this folder's delivery.json: card, material, lights, camera, frame "
            "rate and range come in as they must be. Or by hand:",
            f"Image Texture: open {exr}, Source = Image Sequence, Frames = {made.last - made.first + 1}, Start Frame = "
            f"1, Offset = {made.first - 1}, Auto Refresh on; Color Space = Non-Color; interpolation Closest.",
            f"Output properties: frame rate {float(made.fps):.6g}.",
            *(["Vector Math, Multiply by (1, -1, 1): y points down in these files."] if space.y == "down" else []),
            *(turn if space.name != "world" else ["Straight into the Normal of a BSDF."]),
            "Material properties, Settings, Surface: Bump Map Correction off.",
            "A card that fills the camera's view, and lights. For exact n.l: Diffuse BSDF, a Sun of strength pi, and a "
            "black world.",
            f"With the PNG ({png}) the first node after the texture is Vector Math, Multiply Add by (2, 2, 2), "
            "(-1, -1, -1). It must be set to Non-Color by hand.",
        ],
        [
            "sRGB as Color Space (Blender's choice for every PNG): off by 0.3 to 0.4 of n.l on average.",
            'y the wrong way (`y="down"`): light comes from below when it stands above.',
            "A Normal Map node on the EXR: it expects 0 to 1 (off by 0.5). It takes the PNG, in Tangent space.",
            "The multipart file: Image Texture shows nothing of it. Use the folders, one sequence each.",
        ],
    )


def _unreal(made: Delivered) -> tuple[Sequence[str], Sequence[str]]:
    png = result_name(made.clip, "normals", made.first, suffix="png")
    return (
        [
            f"Import {png} (one picture) as a texture: Compression Settings = Normalmap, sRGB off, Flip Green Channel "
            f"{'off' if made.delivery.space.y == 'down' else 'on'}. The engine keeps 8 bits of x and y in that format.",
            "For full precision choose Compression Settings = HDR (RGB, no sRGB) and in the material 2 * rgb - 1.",
            f"A sequence: an Img Media Source on the folder normals/ (EXR, signed, numbers from {made.first}), frame "
            f"rate {float(made.fps):.6g}, played by a Media Player; source encoding linear, no colour transform.",
            "Material: the texture into Normal (tangent space), albedo into Base Color, on a plane that faces the "
            "camera with its texture upright.",
        ],
        [
            "sRGB on: every normal is bent towards the edge of the map.",
            "y up files without Flip Green Channel: bumps become dents, light from above seems to come from below.",
            "World space normals into a tangent space material: untick Tangent Space Normal there.",
        ],
    )


UNSIZED = ("One Houdini unit is a metre: what is relative (see above) has no size.",)
POINTS = (
    "Points: read position and normals into P and N of a grid of points by pixel, and delete points where valid is 0.",
)


def _houdini(made: Delivered) -> tuple[Sequence[str], Sequence[str]]:
    files = f"{made.clip}.$F4.exr" if made.delivery.multipart else f"normals/{made.clip}_normals.$F4.exr"
    meshes = [f"Meshes: File SOP, mesh/{made.clip}_mesh.$F4.ply."] if "ply" in made.delivery.meshes else []
    meshes += [f"Meshes: USD Import, mesh/{made.clip}_mesh.usdc."] if "usd" in made.delivery.meshes else []
    return (
        [
            f"Copernicus or COP2 File node: {files}, frames {made.first} to {made.last}; colour space Raw (no "
            f"conversion). The parts of the file are planes: {', '.join(made.delivery.bundle)}.",
            f"Set the scene to {float(made.fps):.6g} frames a second and the frame range to {made.first}-{made.last}.",
            *(POINTS if "position" in made.delivery.aovs else ()),
            *meshes,
            "Karma or Mantra: a normal from camera space is turned with ntransform from the camera's space.",
        ],
        [
            "A colour space conversion on reading: set Raw.",
            "A Normal Map shader with signed values: it expects 0 to 1.",
            *(UNSIZED if made.delivery.needs_depth and not made.metric else ()),
        ],
    )
