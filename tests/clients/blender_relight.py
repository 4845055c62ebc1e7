"""Run by a Python that has Blender's bpy: load normals as an artist would, light a card by them, render.

The argument is a JSON file with a list of jobs: "image" (the sequence's first file), "frame" (the scene's), "offset"
(of file numbers), "kind" ("exr": signed, "png": 0 to 1, "map": 0 to 1 in a Normal Map node), "colour_space" (empty:
what Blender chooses by itself), "flip_y", "bump_correction", "space" ("camera", "world"), "camera" (w, x, y, z of its
rotation), "light" (x, y, z towards the light in the world), "size" and "out" (an EXR to write). Prints as JSON what
Blender made of each.
"""

import json
import sys
from pathlib import Path
from typing import Any

import bpy

Job = dict[str, Any]
Factor = tuple[int, int, int]


def link(tree: Any, source: Any, target: Any) -> None:
    tree.links.new(source, target)


def material(job: Job, image: Any) -> Any:
    """A diffuse card whose normal is what the texture says."""
    made = bpy.data.materials.new("card")
    made.use_nodes = True
    if hasattr(made.cycles, "use_bump_map_correction"):  # from Blender 4 on
        made.cycles.use_bump_map_correction = job["bump_correction"]
    tree = made.node_tree
    tree.nodes.clear()
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    user = texture.image_user
    user.frame_start, user.frame_duration, user.frame_offset = 1, 100_000, job["offset"]
    user.use_auto_refresh = True
    vector = texture.outputs["Color"]
    if job["kind"] == "map":  # the node that takes 0 to 1, in the card's own tangent space
        node = tree.nodes.new("ShaderNodeNormalMap")
        link(tree, vector, node.inputs["Color"])
        return with_normal(made, node.outputs[0])
    steps: list[tuple[str, Factor, Factor | None]] = (
        [("MULTIPLY_ADD", (2, 2, 2), (-1, -1, -1))] if job["kind"] == "png" else []
    )
    if job["flip_y"]:
        steps.append(("MULTIPLY", (1, -1, 1), None))
    if job["space"] == "camera":
        steps.append(("MULTIPLY", (1, 1, -1), None))  # the transform node's camera looks along +z
    for operation, factor, add in steps:
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = operation
        link(tree, vector, node.inputs[0])
        node.inputs[1].default_value = factor
        if add:
            node.inputs[2].default_value = add
        vector = node.outputs[0]
    if job["space"] == "camera":
        turn = tree.nodes.new("ShaderNodeVectorTransform")
        turn.vector_type, turn.convert_from, turn.convert_to = "NORMAL", "CAMERA", "WORLD"
        link(tree, vector, turn.inputs[0])
        vector = turn.outputs[0]
    return with_normal(made, vector)


def with_normal(made: Any, vector: Any) -> Any:
    """Give a material a white diffuse surface with this normal."""
    tree = made.node_tree
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    link(tree, vector, diffuse.inputs["Normal"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    link(tree, diffuse.outputs[0], output.inputs["Surface"])
    return made


def scene(job: Job) -> tuple[Any, Any]:
    """A card that fills an orthographic camera's view, a sun of strength pi, and nothing else."""
    from mathutils import Quaternion, Vector

    bpy.ops.wm.read_factory_settings(use_empty=True)
    image = bpy.data.images.load(job["image"])
    image.source = "SEQUENCE"
    if job["colour_space"]:
        image.colorspace_settings.name = job["colour_space"]
    world = bpy.data.worlds.new("dark")
    world.use_nodes = True
    world.node_tree.nodes.clear()  # an empty world: no light but the sun
    here = bpy.context.scene
    here.world = world
    turn = Quaternion(job["camera"])
    bpy.ops.mesh.primitive_plane_add(size=2)
    card = bpy.context.object
    card.rotation_mode, card.rotation_quaternion = "QUATERNION", turn
    card.data.materials.append(material(job, image))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2.0, turn @ Vector((0, 0, 3))
    camera.rotation_mode, camera.rotation_quaternion = "QUATERNION", turn
    here.collection.objects.link(camera)
    here.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 3.14159265, 0
    sun.rotation_mode = "QUATERNION"
    sun.rotation_quaternion = Vector(job["light"]).to_track_quat("Z", "Y")
    here.collection.objects.link(sun)
    return here, image


def render(job: Job) -> dict[str, str]:
    here, image = scene(job)
    width, height = job["size"]
    here.render.engine = "CYCLES"
    here.cycles.device, here.cycles.samples, here.cycles.use_denoising = "CPU", 1, False
    here.cycles.pixel_filter_type = "BOX"
    here.cycles.filter_width = 0.01
    here.cycles.max_bounces = 0
    here.render.threads_mode, here.render.threads = "FIXED", 1
    here.render.resolution_x, here.render.resolution_y, here.render.resolution_percentage = width, height, 100
    here.view_settings.view_transform = "Raw"
    here.render.image_settings.file_format = "OPEN_EXR"
    here.render.image_settings.color_depth = "32"
    here.render.filepath = job["out"]
    here.frame_set(job["frame"])
    bpy.ops.render.render(write_still=True)
    return {"version": bpy.app.version_string, "colour_space": image.colorspace_settings.name}


if __name__ == "__main__":
    jobs = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    print(json.dumps([render(job) for job in jobs]))
