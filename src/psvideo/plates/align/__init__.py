"""Plates of one round, which show different instants, brought to one instant; and what moves left out or averaged.

``rounds`` is the whole: ``comb`` says which instants, ``held`` keeps the plates around them (``packed``), ``moving``
finds one velocity for every pixel (proposed by ``flow``, made on sketches by ``sketch_kernel``, and by
``correlation``; loops in ``moving_kernel``), ``taken`` says which of two plates a pixel comes from, ``between`` makes
the plates of the instant, ``brightness`` evens light that changes as a whole. What is doubtful: ``evenly`` with
``evenly_kernel`` (how two plates differ on either side of an edge), ``unsure``, ``lone_edges``, ``own_means``. What is
made of it: ``opened`` (motion blur), ``denoise``, ``vectors``.
"""
