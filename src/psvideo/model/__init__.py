"""What a shoot is: camera, plan, timing, rig, surface, as frozen records and pure functions. No files, no pixels.

- the shoot: ``camera``, ``plan``, ``marker`` (how a cycle's flashes differ in time), ``maximal_length`` (codes of dark
  slots), ``first_light`` (the one that a user names), ``timing`` (when every flash fired), ``swing`` (light that
  grows and shrinks), ``half_flash`` (how bright half of one looks), ``camera_clocks`` (several
  cameras), ``rig`` (where the lights are)
- pictures: ``arrays`` (short names of array types), ``coded`` (in the codes of their files), ``channels`` (mean,
  brightest), ``turn`` (which way is up), ``srgb`` (its curve)
- the result: ``surface``, ``quantities`` (the table of all that is written and shown)
- words: ``choices``, ``units``

Rooms:

- ``rows``: which rows of a frame see which flash, and how rows add up to a plate
- ``irradiance``: how much light of a rig's lamps arrives, and from where
- ``cost``: what a plan gives and what it costs
"""
