"""What fewer than three lights reach: a best estimate of normal and albedo, grown from what is solved around it.

``filled`` is the whole; ``tiles`` cuts out what lies around holes, ``growing`` goes there from solved pixels outwards,
with ``looking`` (which lights reach a pixel) and ``hernandez2011`` (its normal from two lights or one).
"""
