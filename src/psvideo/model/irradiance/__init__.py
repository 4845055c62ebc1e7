"""How much light of a rig's lamps arrives at the surface, and from where.

``intensity`` brings all lights to one scale, ``colours`` describes LEDs of several colours, and ``led_lamps`` which of
them stand in one place. Lights at a distance that counts: ``near_light``, with ``falloff``, over a ``ground`` (a first
guess of where the surface is). ``light_field`` gives directions and strengths of all lights at points of the picture:
begin there.
"""
