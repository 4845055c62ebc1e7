"""From one plate per light to the surface. Every method is one module named by its paper: ``solve(...) -> Surface``."""
