"""What a shoot is: camera, plan, timing, rig, surface, as frozen records and pure functions. No files, no pixels.

- the shoot: ``camera``, ``plan``, ``marker`` (how a cycle's flashes differ in time), ``maximal_length`` (codes of dark
  slots), ``timing`` (when every flash fired), ``camera_clocks`` (several cameras)
- what a plan costs: ``shoot_figures``, ``motion_cost``, ``in_step`` (what it misses)
- from frames to plates: ``shutter`` (which rows see how much of a flash), ``recipe`` (how rows add up to a plate),
  ``row_profiles``, ``coded`` (pictures in the codes of their files), ``clipping``, ``ripple`` (lamps on the mains),
  ``turn`` (which way is up)
- the lights: ``rig``, ``intensity``, ``falloff``, ``ground`` and ``near_light`` (lights at a distance), ``light_field``
  (what they send to points of the picture), ``colours`` (LEDs of several colours)
- the result: ``surface``, ``quantities`` (the table of all that is written and shown)
- words: ``choices``, ``units``
"""
