"""Row profiles in, Timing out: when every flash fired, and which light it was."""
