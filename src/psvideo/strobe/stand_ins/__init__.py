"""Boards that are not there: the firmware in an emulator, and an imitation of it in Python."""
