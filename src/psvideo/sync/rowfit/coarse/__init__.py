"""Where the strobe may be, searched from nothing: a ``seed`` is a stretch of the clip that the plan's strobe fits, and
``seed_choice`` finds the one to begin with.

``search`` tries every place in the cycle, ``rounds_first`` does so where a code says which rounds are dark. ``retime``
finds frames that were left out or repeated in a regular pattern. ``search_kernel`` is the search's compiled loop,
``seen_shares`` what it sums, and ``readout_kernel`` sums its losses where the readout is unknown.
"""
