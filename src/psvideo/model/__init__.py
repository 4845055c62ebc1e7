"""What a shoot is: camera, plan, timing, rig, surface, as frozen records and pure functions. No files, no pixels.

The shoot: ``camera``, ``plan``, ``marker`` (how the flashes of a cycle differ in time), ``maximal_length`` (codes of
dark slots), ``timing`` (when every flash fired), ``camera_clocks`` (several cameras), ``shoot_figures``,
``motion_cost`` and ``in_step`` (what a plan costs, and misses). From frames to plates: ``shutter`` (which rows saw how
much of a flash), ``recipe`` (how rows add up to a plate), ``row_profiles``, ``coded`` (pictures in the codes of their
files), ``ripple`` (lamps on the mains), ``clipping``, ``turn`` (which way is up). The lights: ``rig``, ``intensity``,
``falloff``, ``ground`` and ``near_light`` (lights at a distance), ``light_field`` (what they send to points of the
picture), ``colours`` (several LEDs at once). The result: ``surface``, ``quantities`` (the table of all that is written
and shown). For words: ``choices``, ``units``.
"""
