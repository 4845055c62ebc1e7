"""Plates and a rig in, the surface out: normals, albedo, depth.

``of_take`` solves a take, ``images`` arrays (``given`` checks them), ``instants`` rounds of plates. ``normals`` holds
the solvers and what is thought of their results, ``filling`` what fewer than three lights reach, ``depth`` the shape,
``passes`` what else plates say. Near lights: ``near_surface`` solves in turns with the depth, ``sweeping`` finds the
distance by falloff (``falloff_costs``, ``sweeping_kernel``, ``swept_outlines``). Over time: ``steady`` with
``steady_kernel``.
"""
