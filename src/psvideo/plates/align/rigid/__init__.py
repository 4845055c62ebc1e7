"""Bodies that turn: six numbers move every point of one, along ways that are curved.

``rigid_motion`` is how a body moves at an instant, and how that moves its picture; ``seen_depth`` is how near the
camera its points are, from its normals; ``moving_parts`` are what belongs together of what was found to move.
``flow_fit`` fits a motion to velocities that were found. ``plates_seen`` are the plates of all lights and how they
light what turns, ``near_plates`` where near lights stand beside it, ``along_motion`` what one surface leaves of them
along a motion (its loop is in ``along_kernel``), and ``left_along`` that along every pixel's way, over windows.
``surface_fit`` fits a motion to it, and ``joint_fit`` motion and depth together, on ``depth_blocks``; ``bodies`` are
fitted so, and ``with_bodies`` takes them where they explain the plates of all lights.
"""
