"""What else may be free besides the times, where the data call for it.

- of the plan: ``freed`` (exposure, readout and tails that it has wrong), where that is ``likelier``; ``far_exposure``
  (one that no small step finds), ``slow_leds`` with ``softness`` (tails, or rows that compression blurs) and
  ``untold_tails`` (those that rows hardly show, or not at all),
  ``plan_errors`` (what stays in doubt of values that are not free)
- of the footage: ``curve`` (its transfer curve is a little off, by what ``small_steps`` would explain), ``misread``
  (it has another curve altogether)
- of the clocks: ``bend`` (they drift), ``jitter`` (flashes come early or late one by one, as ``edge_pulls`` say),
  ``unsteady`` (they jump by little)
- of the scene: ``mains_swing`` (room light on the mains), ``restless`` with ``whitening`` (subjects that move)

``plateau``: times that no row shows.
"""
