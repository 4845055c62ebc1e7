"""Row profiles in, Timing out: when every flash fired, and which light it was.

``open_take`` opens a clip with its plan, ``take_timing`` decodes it, ``find`` finds its times: begin there. ``rowfit``
fits them, ``verdict`` decides whether the fit is believed, ``turns`` and ``order_by_rig`` say which flash is which
light, ``flashes_seen`` lists them, ``flash_levels`` measures what each gives, ``unfired`` finds those that never fired
and ``unfired_words`` says so, ``silent`` where the strobe may have paused for that, ``black_frames`` those whose frames
were lost, and ``beside_breaks`` those in frames that nothing is sure of; ``marks`` puts these together.
``named_strobe`` is a fit whose flashes have names, ``frames_taken`` gives the timing of the frames that it was found
in. Where the strobe began again, ``restarted`` finds each part of the clip by itself, ``unbroken`` says whether they
are one strobe after all, ``clip_parts`` decides, ``joined`` makes one timing. ``shared_flashes`` compares the clocks of
several cameras, whose plans ``same_strobe`` compares first. ``sideways`` knows footage that was turned by 90 degrees.
"""
