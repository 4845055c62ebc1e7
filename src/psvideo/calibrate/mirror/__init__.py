"""Where lights are, from their highlights on a mirror sphere.

Begin with ``lights``: what several sightings say together, by the ``law`` of mirrors; ``measured`` is its result, and
``mirror_doubts`` what speaks against it. ``sighting`` is a sphere's outline with one highlight per light, which
``highlights`` chooses among ``spots``.
"""
