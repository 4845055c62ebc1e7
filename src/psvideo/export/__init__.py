"""The only room that writes files in formats of other programs.

``asked`` makes one delivery of all options, with a program's preset; ``space`` turns normals and positions into the
frame that was asked for (camera, world, tangent).

- ``sequences``: pictures, one file per instant: EXR, 16-bit PNG, TIFF
- ``usd``: a USD stage with camera, card, material and lights
- ``programs``: what Nuke, Blender, Unreal and Houdini need: presets, notes on loading, scripts, timelines

Single files: ``mesh_files`` (PLY), ``preview_movie``, ``ptm_file`` (a relightable picture), ``farm_job`` (a job for
render farms).
"""
