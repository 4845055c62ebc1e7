"""The rigs of other programs: lists of lights as text.

``light_list_reader`` makes a rig of one, from what ``light_list_lines`` says of each of its lines;
``light_list_writer`` writes one, and says what it cannot hold.
"""
