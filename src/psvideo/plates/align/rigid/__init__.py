"""Bodies that turn: six numbers move every point of one, along ways that are curved.

``rigid_motion`` is how a body moves at an instant, and how that moves its picture; ``seen_depth`` is how near the
camera its points are, from its normals; ``moving_parts`` are what belongs together of what was found to move.
``flow_fit`` fits a motion to velocities that were found, ``surface_fit`` to what one surface explains; ``with_bodies``
takes it where it explains the plates of all lights.
"""
