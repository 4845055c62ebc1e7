"""What is measured on plates and surfaces while a run goes on, for its report.

``observed`` gathers all of it, round by round; a round's own numbers are its ``facts``, and those of all rounds
``kept_facts``; ``close_looks`` are what is looked at in rounds 1, 2, 4, 8 and so on. Each has a module: ``levels``
(exposure), ``against_noise`` (light and noise), ``code_steps`` (between a file's levels), ``hidden_level`` (of a sensor
that saturates below the largest code), ``motion`` (``watched_motion``: of one light, as plates pass; in the rows
``shown_alike``), ``focus``,
``shadow`` (what is left where no light reaches), ``steadiness``, ``worst`` (instants to look at), over ``thinned``
pixels. Whether rig and curve are right, and whether photographs are aligned, are rooms of their own:
``rig_and_curve``, ``alignment``.

What 1.0 means, of light:

- In plates' pictures, ``Seen.bright``, ``PointLight.light`` and what the rig sends (``RigPoints.vectors``): that a full
  flash (power 1, the longest that the plan has of the light) would just saturate. Weaker flashes reach above it.
- A plate's saturation, or white, is the light at which it is clipped, in that unit.
- In ``levels`` and in frames of the dark slot: saturation. A plate's light over its white is so as well.
- A plate's brightest share times its light is what the sensor saw under the light's brightest flash, as a share of
  saturation. Ambient light is compared with this.
"""
