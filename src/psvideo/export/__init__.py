"""The only room that knows writers: EXR sequences, 16-bit PNG, and folders that appear whole."""
