"""What this machine has of what psvideo needs, and how fast it is: one finding per thing, with what to do next."""
