"""What a file is, what this machine can do, and whether all of it fits together: ``info`` and ``doctor``."""
