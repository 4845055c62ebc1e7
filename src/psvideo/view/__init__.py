"""Looking at results: pictures for eyes, never data for programs."""
