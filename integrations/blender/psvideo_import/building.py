"""From results to objects: a card or a mesh under one material, a sun per light, the camera.

Normals are data: read without a colour space and without interpolation, and turned from the camera's frame to the
world's. A Diffuse surface, so that a sun of strength pi gives albedo * n . l.
"""

import math

import bpy
from mathutils import Matrix, Vector

from .reading import NotResultsError, Results

DISTANCE = 2.0
"""Where the card stands before the camera; nothing depends on it."""
SENSOR_MM = 36.0


def build(context, found: Results, *, shape: str, lights: bool, camera: bool, timing: bool):
    """Put the results into the scene, in a collection of their own, and return that collection."""
    width, height = _size(found)
    made = bpy.data.collections.new(f"psvideo {found.clip}")
    context.scene.collection.children.link(made)
    place = _camera_place(found)
    high = found.pixel_height * height / width
    surface = _mesh(context, found, made, high) if shape == "MESH" else _card(found, made, high)
    if shape == "CARD":
        surface.matrix_world = place @ Matrix.Translation((0, 0, -DISTANCE))
    elif found.space != "world":
        surface.matrix_world = place
    surface.data.materials.clear()
    surface.data.materials.append(_material(found))
    if camera:
        context.scene.camera = _camera(found, made, place)
        _set_picture(context.scene.render, found, (width, height))
    if lights:
        for light in found.lights:
            _sun(light, found, made, place)
    if timing:
        _set_timing(context.scene, found)
    return made


def _set_picture(render, found: Results, size: tuple[int, int]) -> None:
    """Render as the shot's camera took its picture: Blender's pixels are at least as wide, and as high, as 1."""
    render.resolution_x, render.resolution_y = size
    render.pixel_aspect_x, render.pixel_aspect_y = max(1 / found.pixel_height, 1.0), max(found.pixel_height, 1.0)


def _size(found: Results) -> tuple[int, int]:
    file = _there(found, "normals")
    image = bpy.data.images.load(str(file))  # one of a sequence says 0 until it is drawn
    width, height = image.size
    bpy.data.images.remove(image)
    if not width:
        raise NotResultsError(f"{file}: Blender cannot read it; write the results again")
    return width, height


def _camera_place(found: Results) -> Matrix:
    """Where the camera stands: at the origin, looking along -z, or as the shot's own file says."""
    if found.space != "world" or found.camera_to_world is None:
        return Matrix.Identity(4)
    return Matrix([found.camera_to_world[row * 4 : row * 4 + 4] for row in range(4)])


def _view_width(found: Results) -> float:
    """How wide the picture is at the card's distance; without a focal length it is the unit of depth and meshes."""
    return 1.0 if found.focal is None else DISTANCE / found.focal


def _card(found: Results, made, shape: float):
    wide = _view_width(found)
    high = wide * shape
    right, up = (-found.middle[0] * wide, -found.middle[1] * wide) if found.focal else (0.0, 0.0)
    corners = [(x * wide / 2 + right, y * high / 2 + up, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh = bpy.data.meshes.new(f"{found.clip} card")
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="picture")
    for loop, uv in zip(layer.data, ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
        loop.uv = uv
    return _linked(bpy.data.objects.new(f"{found.clip} card", mesh), made)


def _mesh(context, found: Results, made, shape: float):
    """The first mesh of the results, with the picture's place of every vertex as UV."""
    folder = found.folder / "mesh"
    files = sorted(folder.glob("*.ply")) if folder.is_dir() else []
    if not files:
        raise NotResultsError(f"{folder}: holds no mesh (.ply); solve with --mesh ply, or choose Card")
    before = set(bpy.data.objects)
    bpy.ops.wm.ply_import(filepath=str(files[0]), forward_axis="Y", up_axis="Z", global_scale=1.0)
    (surface,) = set(bpy.data.objects) - before
    for other in surface.users_collection:
        other.objects.unlink(surface)
    surface.matrix_world = Matrix.Identity(4)
    inverse = _camera_place(found).inverted() if found.space == "world" else Matrix.Identity(4)
    points = [inverse @ vertex.co for vertex in surface.data.vertices]
    layer = surface.data.uv_layers.new(name="picture")
    uv = [_seen_at(found, point, shape) for point in points]
    for loop, data in zip(surface.data.loops, layer.data, strict=True):
        data.uv = uv[loop.vertex_index]
    return _linked(surface, made)


def _seen_at(found: Results, point: Vector, shape: float) -> tuple[float, float]:
    """Return the picture's place of a point of the camera's frame, 0 to 1 from the lower left."""
    across, up = point.x, point.y
    if found.focal is not None:
        across = found.focal * point.x / -point.z + found.middle[0]
        up = found.focal * point.y / -point.z + found.middle[1]
    return across + 0.5, up / shape + 0.5


def _linked(thing, made):
    made.objects.link(thing)
    return thing


def _there(found: Results, quantity: str):
    file = found.file(quantity)
    if not file.is_file():
        raise NotResultsError(f"{file}: is not there; choose the whole folder of results")
    return file


def _image(found: Results, quantity: str, colour_space: str):
    image = bpy.data.images.load(str(_there(found, quantity)), check_existing=True)
    image.source = "SEQUENCE" if found.count > 1 else "FILE"
    image.colorspace_settings.name = colour_space
    image.alpha_mode = "NONE"
    return image


def _texture(tree, found: Results, quantity: str, colour_space: str):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.name = node.label = quantity
    node.image, node.interpolation = _image(found, quantity, colour_space), "Closest"
    node.extension = "CLIP"
    user = node.image_user
    user.frame_start, user.frame_duration, user.frame_offset = found.first, found.count, found.first - 1
    user.use_auto_refresh = True
    return node


def _material(found: Results):
    made = bpy.data.materials.new(f"{found.clip} surface")
    made.use_nodes = True
    if hasattr(made.cycles, "use_bump_map_correction"):
        made.cycles.use_bump_map_correction = False  # it would bend these normals towards the card's own
    tree = made.node_tree
    tree.nodes.clear()
    normals = _texture(tree, found, "normals", "Non-Color").outputs["Color"]
    if found.y == "down":
        normals = _scaled(tree, normals, (1, -1, 1))
    if found.space != "world":
        normals = _scaled(tree, normals, (1, 1, -1))  # the next node's camera looks along +z
        turn = tree.nodes.new("ShaderNodeVectorTransform")
        turn.vector_type, turn.convert_from, turn.convert_to = "NORMAL", "CAMERA", "WORLD"
        tree.links.new(normals, turn.inputs[0])
        normals = turn.outputs[0]
    surface = tree.nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Roughness"].default_value = 0.0
    tree.links.new(_texture(tree, found, "albedo", "Linear Rec.709").outputs["Color"], surface.inputs["Color"])
    tree.links.new(normals, surface.inputs["Normal"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(surface.outputs[0], output.inputs["Surface"])
    _spread_out(tree)
    return made


def _scaled(tree, vector, factor: tuple[int, int, int]):
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "MULTIPLY"
    tree.links.new(vector, node.inputs[0])
    node.inputs[1].default_value = factor
    return node.outputs[0]


def _spread_out(tree) -> None:
    for place, node in enumerate(tree.nodes):
        node.location = (260 * (place - len(tree.nodes)), -200 * (node.name == "albedo"))


def _camera(found: Results, made, place: Matrix):
    data = bpy.data.cameras.new(f"{found.clip} camera")
    if found.focal is None:
        data.type, data.ortho_scale = "ORTHO", _view_width(found)
    else:
        data.sensor_width, data.sensor_fit, data.lens = SENSOR_MM, "HORIZONTAL", found.focal * SENSOR_MM
        data.shift_x, data.shift_y = -found.middle[0], -found.middle[1]
    camera = bpy.data.objects.new(data.name, data)
    camera.matrix_world = place
    return _linked(camera, made)


def _sun(light: dict, found: Results, made, place: Matrix) -> None:
    """A sun that gives a white matte surface colour * n . l."""
    direction = Vector(light["direction"])
    if found.y == "down":
        direction.y = -direction.y
    data = bpy.data.lights.new(light["name"], "SUN")
    strongest = max(light["colour"]) or 1.0
    data.energy, data.angle = math.pi * strongest, 0.0
    data.color = [part / strongest for part in light["colour"]]
    sun = bpy.data.objects.new(f"{found.clip} {light['name']}", data)
    turned = direction if found.space == "world" else place.to_3x3() @ direction
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = turned.to_track_quat("Z", "Y")
    sun.location = place.translation + turned.normalized() * DISTANCE
    _linked(sun, made)


def _set_timing(scene, found: Results) -> None:
    first = found.first if found.count > 1 else 1
    # as the files are numbered, and as USD and Nuke do
    scene.frame_start, scene.frame_end = first, first + found.count - 1
    scene.frame_set(first)
    if found.fps is not None:
        rate = found.fps[0] / found.fps[1]
        scene.render.fps = max(round(rate), 1)
        scene.render.fps_base = scene.render.fps / rate
