"""Decoders, one module for each kind of file. Only this room and ``clip.transfer`` know decoding libraries."""
