"""Boards that are not there: an emulated one, which runs the real firmware, and one in plain Python."""
