"""Where lights are, from their highlights on a mirror sphere.

``sighting`` is a sphere's outline with one highlight per light (``highlights`` chooses them among
``spots``), ``lights`` what several sightings say together, by the ``law`` of mirrors.
"""
