"""How hot loops are compiled, kept on disk and shared between threads."""
