"""Animated meshes and cameras as USD."""
