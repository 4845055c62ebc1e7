"""Where lights are, from their highlights on a mirror sphere."""
