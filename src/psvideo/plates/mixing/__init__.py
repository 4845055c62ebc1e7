"""A plate is a ``mixture``: a weighted sum of rows of frames. Its pixels are computed only where they are read.

``ready_mixture`` brings weights and codes into the form that the loops take; ``mixing_kernel`` computes every pixel,
``thinning_kernel`` every n-th.
"""
