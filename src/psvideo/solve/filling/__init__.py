"""Where fewer than three lights reach: a best estimate of normal and albedo, grown from what is solved around it.

``filled`` does it; ``leaving_out`` says where a solved pixel has light that no lamp sent it. ``tiles`` cuts out what
lies around holes. ``growing`` starts at solved pixels, but not at odd ones at a hole's ``rim``, and goes inwards, the
nearest first (``bucket_queue``). ``neighbours`` suggest a pixel's normal, continued as they bend (``neighbours_bend``),
``looking`` says which lights reach it, ``hernandez2011`` combines both: two lights, or one, and the neighbours.
"""
