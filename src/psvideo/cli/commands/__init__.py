"""The commands, found by name: each parses its options, calls one function of the library and prints its result."""
