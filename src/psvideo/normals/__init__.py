"""From plates, one per light, to the surface: every method is one module named by its paper, ``solve(...) -> Surface``."""
