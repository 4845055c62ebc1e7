"""What a delivery holds besides normals and albedo.

``beforehand`` checks whether a take can give what was asked for, and says what it cannot. ``delivering`` adds to every
instant its camera, its plates, their sum. ``relit`` makes the pictures of the relit movie while surfaces are in memory.
Once all instants are written, ``handover`` writes the timeline and has ``previews`` make the movies for eyes,
``for_programs`` the stage and the note for a program. ``look`` is one picture of one instant.
"""
