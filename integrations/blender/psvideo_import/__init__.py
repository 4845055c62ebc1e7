"""psvideo results in Blender: a folder of normals and albedo becomes a card that lights shine on.

File > Import > psvideo results. Card, material, lights and camera come into a collection of their own.
"""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from . import building, reading

bl_info = {
    "name": "psvideo results",
    "author": "psvideo",
    "version": (0, 2, 0),
    "blender": (4, 2, 0),
    "location": "File > Import > psvideo results",
    "description": "Bring normals and albedo of a strobed take in as a card that can be relit",
    "category": "Import-Export",
}


class ImportResults(bpy.types.Operator, ImportHelper):
    """Bring a folder of psvideo results in as a card that can be relit"""

    bl_idname = "import_scene.psvideo"
    bl_label = "psvideo results"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012  (as Blender reads it)

    filter_glob: StringProperty(default="*.exr;*.json", options={"HIDDEN"})
    shape: EnumProperty(
        name="Shape",
        items=[
            ("CARD", "Card", "A plane that fills the camera's view"),
            ("MESH", "Mesh", "The first mesh that the results hold, under the same material"),
        ],
        default="CARD",
    )
    lights: BoolProperty(name="Lights", description="A sun for every light of the shoot", default=True)
    camera: BoolProperty(name="Camera", description="The camera of the shoot", default=True)
    timing: BoolProperty(name="Frame rate and range", description="Set the scene's to the results'", default=True)

    def execute(self, context):
        try:
            found = reading.read_results(Path(self.filepath))
            building.build(
                context,
                found,
                shape=self.shape,
                lights=self.lights,
                camera=self.camera,
                timing=self.timing,
            )
        except reading.NotResultsError as fault:
            self.report({"ERROR"}, str(fault))
            return {"CANCELLED"}
        return {"FINISHED"}


def _entry(self, _context):
    self.layout.operator(ImportResults.bl_idname, text="psvideo results")


def register():
    """Put the importer into File > Import."""
    bpy.utils.register_class(ImportResults)
    bpy.types.TOPBAR_MT_file_import.append(_entry)


def unregister():
    """Take the importer out again."""
    bpy.types.TOPBAR_MT_file_import.remove(_entry)
    bpy.utils.unregister_class(ImportResults)
