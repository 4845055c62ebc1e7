"""The only room that knows writers: EXR sequences, PNG, movies, meshes, USD, and what other programs want beside them.

``asked`` makes one delivery of what was asked for, ``programs`` holds the presets, ``space`` the frames of normals.
Sequences: ``planes``, ``result_files``, ``plate_files``, ``png_maps``, ``code_files``, ``tags`` (headers). Shape:
``mesh_files``, ``usd``. Beside them: ``preview_movie``, ``delivery_json``, ``nuke_script``, ``otio``,
``blender_addon``, ``ptm_file`` (relightable pictures), ``farm_job``.
"""
