"""What a take is worth: how it is exposed, what spoils it, and what to change on set."""
