"""Planning a shoot: from a camera, its lights and what the user cares about to a plan, its figures and its picture.

Read in this order: ``cameras`` (the table of camera modes), ``request`` (what the user wants) and ``wish`` (how long a
flash may be), ``planning`` (the plan), ``cautions`` (what to think about before the shoot; ``caution`` is the record,
``cautions_on_time`` and ``cautions_on_lamps`` are parts of it), ``tables`` (its figures for people), ``drawing`` (the
timing diagram as SVG, PNG and terminal text).
"""
