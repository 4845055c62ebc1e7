"""Run by a Python that has Blender's bpy: install the add-on, bring results in as an artist would, render.

The argument is a JSON file: "addon" (the archive), and "jobs": "results" (a file of the folder), "shape", "frame" and
"out" (EXRs, one per sun). Prints as JSON what came into the scene.
"""

import json
import sys
import zipfile
from pathlib import Path
from typing import Any

import bpy


def brought_in(job: dict[str, Any]) -> dict[str, Any]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    here = bpy.context.scene
    here.world = bpy.data.worlds.new("dark")
    here.world.use_nodes = True
    here.world.node_tree.nodes.clear()
    bpy.ops.import_scene.psvideo(filepath=job["results"], shape=job["shape"])
    here.render.engine = "CYCLES"
    here.cycles.device, here.cycles.samples, here.cycles.use_denoising = "CPU", 1, False
    here.cycles.pixel_filter_type, here.cycles.filter_width, here.cycles.max_bounces = "BOX", 0.01, 0
    here.render.threads_mode, here.render.threads = "FIXED", 1
    here.view_settings.view_transform = "Raw"
    here.render.image_settings.file_format, here.render.image_settings.color_depth = "OPEN_EXR", "32"
    here.frame_set(job["frame"])
    suns = [one for one in bpy.data.objects if one.type == "LIGHT"]
    for place, sun in enumerate(suns):  # one at a time: of several, a sample is sent to one by chance
        for other in suns:
            other.hide_render = other is not sun
        here.render.filepath = f"{job['out']}.{place}.exr"
        bpy.ops.render.render(write_still=True)
    rate = here.render.fps / here.render.fps_base
    return {
        "suns": [sun.name for sun in suns],
        "fps": rate,
        "frames": [here.frame_start, here.frame_end],
        "lens": here.camera.data.type,
        "pixel_height": here.render.pixel_aspect_y / here.render.pixel_aspect_x,
    }


def refused(path: str) -> str:
    try:
        bpy.ops.import_scene.psvideo(filepath=path)
    except RuntimeError as fault:
        return str(fault)
    return ""


if __name__ == "__main__":
    asked = json.loads(Path(sys.argv[-1]).read_text(encoding="utf-8"))
    installed = Path(asked["addon"]).with_suffix("") / "psvideo_import"
    zipfile.ZipFile(asked["addon"]).extractall(installed)
    sys.path.insert(0, str(installed.parent))
    import psvideo_import  # type: ignore[import-not-found]

    psvideo_import.register()
    seen = [brought_in(job) for job in asked["jobs"]]
    said = refused(asked["nothing"])
    psvideo_import.unregister()
    print(json.dumps({"seen": seen, "refused": said}))
