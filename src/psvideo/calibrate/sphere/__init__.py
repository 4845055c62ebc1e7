"""The outline of a sphere in a picture, and how the camera sees it.

``outline`` finds it: ``round_things`` finds candidates, ``rim_model`` and ``rim_fit`` place the rim,
``sphere_view`` is the geometry, and what users say of it.
"""
