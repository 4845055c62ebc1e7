"""Run by a Python that has Blender's bpy: import USD stages, render them under their own lights, one at a time.

The argument is a JSON file: "jobs": "stage" and "out" (EXRs, one per light), and "ids": names of MaterialX nodes with
their inputs. Prints as JSON what came into the scene, and which nodes and inputs MaterialX has not.
"""

import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import bpy


def brought_in(job: dict[str, Any]) -> dict[str, Any]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=job["stage"])
    here = bpy.context.scene
    here.world = bpy.data.worlds.new("dark")
    here.world.use_nodes = True
    here.world.node_tree.nodes.clear()
    here.camera = next(one for one in bpy.data.objects if one.type == "CAMERA")
    here.render.resolution_x, here.render.resolution_y = job["size"]
    here.render.engine = "CYCLES"
    here.cycles.device, here.cycles.samples, here.cycles.use_denoising = "CPU", 1, False
    here.cycles.pixel_filter_type, here.cycles.filter_width, here.cycles.max_bounces = "BOX", 0.01, 0
    here.render.threads_mode, here.render.threads = "FIXED", 1
    here.view_settings.view_transform = "Raw"
    here.render.image_settings.file_format, here.render.image_settings.color_depth = "OPEN_EXR", "32"
    here.frame_set(here.frame_start)
    for material in bpy.data.materials:
        if hasattr(material.cycles, "use_bump_map_correction"):
            material.cycles.use_bump_map_correction = False
    suns = [one for one in bpy.data.objects if one.type == "LIGHT"]
    for sun in suns:
        for other in suns:
            other.hide_render = other is not sun
        here.render.filepath = f"{job['out']}.{sun.name}.exr"
        bpy.ops.render.render(write_still=True)
    (surface,) = [one for one in bpy.data.objects if one.type == "MESH"]
    images = {node.image.name for node in surface.data.materials[0].node_tree.nodes if node.type == "TEX_IMAGE"}
    return {
        "suns": {sun.name: sun.data.energy for sun in suns},
        "uv": [layer.name for layer in surface.data.uv_layers],
        "images": sorted(images),
        "frames": [here.frame_start, here.frame_end],
        "lens": here.camera.data.type,
    }


def unknown(ids: dict[str, list[str]]) -> list[str]:
    known: dict[str, set[str]] = {}
    heirs: dict[str, str] = {}
    files = Path(bpy.utils.resource_path("LOCAL"))
    for file in (*files.rglob("*_defs.mtlx"), *files.rglob("bxdf/standard_surface.mtlx")):
        for node in ElementTree.parse(file).getroot().iter("nodedef"):
            known[node.get("name", "")] = {one.get("name", "") for one in node.iter("input")}
            heirs[node.get("name", "")] = node.get("inherit", "")
    for name, before in heirs.items():
        known[name] |= known.get(before, set())
    lacking = [f"{name}.{one}" for name, inputs in ids.items() for one in inputs if one not in known.get(name, ())]
    return [name for name in ids if name not in known] + lacking


if __name__ == "__main__":
    asked = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    print(json.dumps({"seen": [brought_in(job) for job in asked["jobs"]], "unknown": unknown(asked["ids"])}))
