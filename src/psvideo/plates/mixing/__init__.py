"""A plate is a ``mixture``: a weighted sum of rows of frames. Its pixels are computed only where they are read.

``ready_mixture`` brings weights and codes into the form that the loops take (``mixture_arrays``); ``mixing_kernel``
computes every pixel, ``thinning_kernel`` every n-th, and ``adding_kernel`` is what both do with a frame's row.
``several_pictures`` adds mixtures up, and makes rows of several in one loop.
"""
