"""Pictures that others made of the footage: a ``mask`` or a ``mask_sequence`` of what to solve, and ``depth_map``."""
