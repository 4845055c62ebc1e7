"""Plates and a rig in, the surface out: normals, albedo, depth.

``of_take`` solves a take, ``images`` arrays (checked by ``array_checks``), ``instants`` rounds of plates (as a
``given_round``): begin there. ``denoised`` averages surfaces where nothing moves.

- ``normals``: the solvers, and how far their results can be trusted
- ``filling``: estimates where fewer than three lights reach
- ``depth``: from normals to shape
- ``passes``: what else plates show (which lights reach a pixel, highlights, a matte)

Near lights: ``near_surface`` solves normals and depth in turns; ``sweeping`` finds the distance by the lights' falloff
(with ``falloff_costs``, ``sweeping_kernel``, ``swept_odds``, ``swept_outlines``, ``nearest_surfaces`` and
``pixels_of_points``). Over time: ``steady``, with ``steady_kernel`` and ``steady_votes``, keeps the trust in a pixel
from flickering, and ``at_rest`` says which rounds share their doubts.
"""
