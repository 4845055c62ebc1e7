"""Planning a shoot: from a camera, its lights and what the user cares about to a plan, its figures and its picture.

Read in this order: ``quantities`` (times and speeds as people write them), ``cameras`` (the table of camera modes),
``request`` (what the user wants) and ``wish`` (how long a flash may be), ``planning`` (the plan), ``figures`` (what
decides the shoot), ``cautions`` (what to think about before it), ``timeline`` and the three ``draw_`` modules (the
timing diagram as shapes, and as SVG, PNG and terminal text).
"""
