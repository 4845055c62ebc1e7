"""Whole commands as functions: a clip in, a folder of files out, with the same checks as on the command line."""
