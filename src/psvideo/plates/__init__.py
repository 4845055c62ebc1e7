"""Frames and their timing in, one clean picture per light and round out."""
