"""Pictures that others made of the footage: a ``mask`` or a ``mask_sequence`` of what to solve, and ``depth_map``.

``painted_alpha`` reads the channel in which masks are cut out.
"""
