"""How far every normal may be off, and which normals are valid. ``judging`` does it, ``judging_kernel`` is its loop.

Noise is only one source of error (``noise_spread``: how it spreads into normals, and what residuals hold of it; the
loops take that as ``spread_numbers``). The others are looked for on a coarse grid (``thin_surface``): ``signs`` of
surfaces that are not matte and of wrong rigs, as they are typical of a point's ``surroundings``; ``by_length``
(albedo that stands out where residuals do: pixels that are off by themselves); ``torn`` normals, which belong to no
surface; ``indirect`` (light from other surfaces, and how much farther noise spreads where fewer lamps reach, looked
for while the plates are being solved; its loop: ``indirect_kernel``), albedo that goes with the slope (``by_slope``,
and of light that all lamps add ``added_light``; both look at ``slope_pairs``, whose loops are in ``by_slope_kernel``)
or pales where something shines (``by_colour``), shadows that pass for light (``lit_shadows``), ``near_spread`` (near
lights, whose directions depend on the distance), ``moving_doubt`` (plates that do not match after alignment, beside
what more than three lights say of them, ``witness``; ``agreeing`` takes off what these do not bear
out; ``continued``, with ``continued_part`` and ``continued_kernel``, takes normals on across narrow doubt),
``few_checked`` (what is left over may come of, under four to eight lights: a model of the subject, where it leaves
no more than ``by_other_rig``, or such a rig; by how much that turns normals, ``rig_spread``), and ``unchecked`` (what
three lights leave of real surfaces, and show hardly anywhere; and how well few lights check each other;
``hidden_share``: how much of what is not matte lights hide altogether). Loops of the signs are in ``signs_kernel``.
``doubting`` says how much each counts, and makes one doubt of them; its
loop is ``doubting_kernel``. ``doubts`` are those of several looks at what stands still, and ``repeats`` shows by them
how large noise is that detail does not show. ``usual_errors`` are those that are typical of a picture, for what is
said of it as a whole.
"""
