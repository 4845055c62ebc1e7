"""The outline of a sphere in a picture, and how the camera sees it.

Begin with ``outline``: ``round_things`` finds candidates; ``rim_model`` (a spoke's brightness), ``rim_spokes`` (where
the rim may be on each spoke) and ``rim_fit`` (what most spokes agree on) place the rim. ``marked`` holds what a person
marked against it. ``sphere_view`` is geometry.
"""
