"""By how much an aligned plate may be off.

``unsure`` compares the two plates that it was made from, within windows that keep what moves and what rests apart
(``own_means``); beside an edge, on one side of it (``evenly``, loop in ``evenly_kernel``). ``lone_edges`` finds edges
that only one light shows: there motion was followed wrongly. ``turning`` says how far what turns is off a blend.
"""
