"""Rows that other flashes lend below 360 degrees, brought to the instant of the plate that lacks them.

``bringing`` does it, round by round: begin there. ``row_sightings`` says of every row when flashes around an instant
showed it, so that motion is found between things whose times are known; ``brought`` moves rows along that motion.
"""
