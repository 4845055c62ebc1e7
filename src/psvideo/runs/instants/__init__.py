"""The instants of a clip, solved and written one after the other.

``job`` is what a run is asked for. ``results`` is a whole run of normals and ``plates`` a whole split; both read
instants by ``solving``, which asks ``depths`` for depth. ``pieces`` cuts a run into ranges that are solved apart,
``piece_frames`` says what a range needs beside its own frames, by ``succession``, the order of instants, rounds and
frames, and ``piece_notes`` keeps on disk what a piece found. ``reporting`` writes the report once all instants are
there, with what ``shot_and_settings`` says of the shot; ``checked_rounds`` is what a check makes of a few rounds.
"""
