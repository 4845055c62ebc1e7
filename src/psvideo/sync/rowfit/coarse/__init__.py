"""Where the strobe may be, searched from nothing: a ``seed`` is a stretch of the clip that the plan's strobe fits.

``search`` tries every place in the cycle, ``rounds_first`` does so where a code says which rounds are dark. ``retime``
finds frames that were left out or repeated in a regular pattern, ``search_kernel`` is the search's compiled loop,
and ``readout_kernel`` that of a search in which the readout is unknown.
"""
