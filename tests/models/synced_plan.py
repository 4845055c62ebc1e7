"""The plan of a small picture and three lights, one flash a frame: for what reads plans and solves nothing."""

SYNCED_PLAN = """
schema = "psvideo-plan/1"
[camera]
name = "small"
width_px = 24
height_px = 16
fps = 100
transfer = "linear"
black_level = 0
white_level = 65535
[strobe]
mode = "synced"
flash = [{ lights = { a = 1.0 } }, { lights = { b = 1.0 } }, { lights = { c = 1.0 } }]
"""
