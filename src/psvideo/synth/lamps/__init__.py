"""The virtual lights: what they emit, when, and edges traced from real firmware."""
