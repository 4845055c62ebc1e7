"""What else may be free besides the times, where the data call for it.

Of the plan: ``freed`` (durations, dark times and a readout that it has wrong), ``softness`` (tails of the LEDs),
``curve`` (footage whose transfer curve is a little off), ``misread`` (another curve altogether). Of the clocks:
``bend`` (they drift), ``jitter``, ``unsteady`` (they jump by little). Of the scene: ``mains_swing`` (room light on the
mains), ``restless`` with ``whitening`` (subjects that move). ``plateau``: times that no row shows.
"""
