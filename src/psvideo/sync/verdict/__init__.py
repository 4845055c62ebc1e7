"""Whether a fit can be believed, and what to say about it."""
