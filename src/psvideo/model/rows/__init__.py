"""Which rows of a frame see how much of which flash, and how rows add up to one clean picture per light.

``shutter`` gives the share of a flash that each row sees, ``recipe`` the weights with which rows of several frames
make a plate. ``ripple`` is room light that swings with the mains. ``row_profiles`` are the levels of rows that times
are found from, ``clipping`` says from which level on a sample is saturated.
"""
