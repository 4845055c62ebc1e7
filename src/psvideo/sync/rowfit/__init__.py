"""The strobe's times from row profiles: one model of what rows see, searched coarsely, tracked, and sharpened.

``fit`` does it: begin there; ``best_fit`` is its middle, where some rows are fitted as well as they can be. ``beat``
holds the times that are looked for, ``profiles`` the data. ``unlit`` leaves out frames in the dark beforehand, and
``quiet`` finds those that change by noise alone.

- the model, compiled: ``given_off`` (a flash's light over time), ``row_model`` (what rows see of it), ``row_slopes``
  (how that changes with the times); and its fit, ``kernel`` and ``projection``; ``compiled_profiles`` calls them
- ``refine`` sharpens by steps of ``normal_equations``; ``standard_error`` says how certain times are, ``score_test``
  which others may be off
- ``long_takes``: what holds throughout is fitted to some stretches of a long take, the clock to all of it
- ``restarts``: where a clip is to be cut because the strobe started again or stopped, by ``leaps`` in its cycle;
  ``moved_at_breaks`` where missing frames stand for that, and ``strobed`` whether frames show one at all

Rooms, in the order in which a fit goes through them:

- ``coarse``: where the strobe may be, searched from nothing
- ``tracking``: one course of the strobe through the whole take
- ``unknowns``: what else may be free besides the times, where the data call for it

Beside them, ``whatever_moves`` finds the strobe where a subject is too fast for a fit: it asks no brightness to stay,
but what frames that share a flash say (``shared_light``).
"""
