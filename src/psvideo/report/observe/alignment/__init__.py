"""Whether photographs of one scene, each under a light of its own, lie one over the other.

``astray`` begins: it asks parts of the picture, finely and then coarsely, where every picture lies in them
(``part_places``), and puts what they say together as a ``similarity`` for each picture: a shift, a turn and another
scale.
"""
