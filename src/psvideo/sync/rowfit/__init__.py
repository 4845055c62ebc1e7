"""The strobe's times from row profiles: one model of what rows see, searched coarsely, tracked, and sharpened.

``fit`` does it: begin there; ``best_fit`` is its middle, where some rows are fitted as well as they can be. ``beat``
holds the times that are looked for, ``profiles`` the data, ``row_model``, ``kernel`` and ``projection`` the compiled
model and its fit, which ``compiled_profiles`` hands them to. ``unlit`` leaves out frames in the dark beforehand.
``refine`` sharpens by steps of ``normal_equations``, with ``standard_error`` for how certain times are. ``long_takes``:
what holds throughout is fitted to some stretches of a long take, the clock to all of it. ``restarts`` says where a clip
is to be cut because the strobe started again or stopped, by ``leaps`` in its cycle, ``moved_at_breaks`` where missing
frames stand for that, and ``strobed`` whether frames show one at all.

Rooms, in the order in which a fit goes through them:

- ``coarse``: where the strobe may be, searched from nothing
- ``tracking``: one course of the strobe through the whole take
- ``unknowns``: what else may be free besides the times, where the data call for it

Beside them, ``whatever_moves`` finds the strobe where a subject is too fast for a fit: it asks no brightness to stay.
"""
