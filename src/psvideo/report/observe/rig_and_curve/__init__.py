"""Whether the rig and the transfer curve fit what the plates show, measured on some pixels (``rigpoints``).

From plates: ``rigfit`` (what the rig leaves unexplained), ``any_rig`` (what any rig would), ``lamp_strengths`` (how
strong each light truly was), ``exchanged`` (two lights that are taken for each other), ``nearness`` (lights of a
distant rig that stand near), ``other_curves`` (which transfer curve would fit better). From normals: ``slopes``
(whether they can be one surface's), ``edges_of_slopes`` (where only edges show that), ``outward`` (whether they face
outwards where the subject ends), ``yuille1997`` (the one change of all of them that would make them so).
"""
