"""What other programs need of a delivery beside its pictures.

``presets`` says what each program's preset sets, ``loading_notes`` how to load the files into it. Both come with one
line per program: a new program begins there. ``delivered`` is what all of them know of a delivery. Files beside the
pictures: ``delivery_json``, ``nuke_script``, ``otio`` (a timeline), ``blender_addon``.
"""
