"""What fewer than three lights reach: a best estimate of normal and albedo, grown from what is solved around it.

``filled`` is the whole; ``tiles`` cuts out what lies around holes. ``growing`` goes there from solved pixels outwards,
the nearest first (``bucket_queue``). ``neighbours`` suggest a pixel's normal, ``looking`` says which lights reach it,
and ``hernandez2011`` puts both together where two lights do, or one.
"""
