"""Row profiles in, Timing out: when every flash fired, and which light it was.

``open_take`` opens a clip with its plan and ``take_timing`` decodes it; ``find`` is the whole of finding: ``rowfit``
fits times, ``verdict`` judges the fit, ``turns`` and ``order_by_rig`` say which flash is which light.
``shared_flashes`` compares the clocks of several cameras.
"""
