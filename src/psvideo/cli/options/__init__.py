"""Options that commands share, the panels of help they stand in, and what becomes of the words that people type."""
