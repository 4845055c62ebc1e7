"""What commands are made of.

All of them: ``caller`` (who hears of a run), ``output`` (where it writes), ``lighting`` (what it solves with).

Single ones: ``checked`` (what a check found), ``checked_frames`` and ``where_to_look`` (which frames it looks at),
``saturation`` (clipping that no plan names), ``levels`` (files that hold few), ``compiling`` with its
``small_pictures`` (loops compiled ahead of first use).
"""
