"""Pictures as sequences of files.

``result_files`` writes the quantities of an instant (normals, albedo ...): ``planes`` gives the picture of each,
``tags`` the header of its EXR file, ``png_maps`` writes the same as 16-bit PNG. ``plate_files`` writes plates,
``code_files`` frames as the camera delivered them.
"""
