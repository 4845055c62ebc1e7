"""From one plate per light to normals and albedo, and how far to trust them.

``solving`` chooses the solver and calls it: begin there. It is given ``lit_plates``: plates, and the light that each
shows (``illumination``); ``asked_surface`` is what is wanted of it. ``evidence`` is lit plates with what the solver saw
of them, for what looks at them again.

All solvers take plates and lights as plain arrays (``task``), fill plain arrays (``result``), and share the rows
between threads (``bands``); ``surface_bits`` are those arrays of a surface. How noisy plates are is ``plate_noise``,
found by what neighbours and samples farther apart show (``noise_samples``), and ``light_sigmas`` says how lights of
unlike strength are weighed for it.

Rooms, from the bottom up:

- ``loops``: compiled loops that all solvers use, from samples to measurements and from a solution to what is stored
- ``least_squares``: the classic solver, for matte surfaces without cast shadows
- ``robust``: the default, which leaves out shadows and highlights
- ``metal``: plates of bare metal, made as a matte surface would show them, for those above to solve
- ``trust``: how far normals may be off, and which are valid
"""
