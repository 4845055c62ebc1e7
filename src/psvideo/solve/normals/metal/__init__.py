"""Bare metal and metallic paint: highlights are most of what they show, and leave a matte surface's normals 10 to 20
degrees off, robustly solved or not.

``metal_fit`` finds from a subject's points whether it is such, and its lobes, by ``lobe_fit``. ``matte_plates`` then
finds every pixel's normal under them, and makes the plates that a matte surface with that normal would show, so that
all that comes after (robust solving, trust, filling, depth) is as for any subject. Compiled loops: ``lobe_kernel``
(what lobes show), ``metal_normals`` (the normal that explains a point best), ``matte_kernel`` (what it would show if
it were matte).
"""
