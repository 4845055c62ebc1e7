"""The line to a controller: bytes, messages, ports, boards."""
