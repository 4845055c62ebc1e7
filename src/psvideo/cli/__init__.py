"""The command line: every command parses, makes one library call, and prints."""
