"""Whole commands of the strobe: check a plan against boards, play it, make a board dark, emulate a board."""
