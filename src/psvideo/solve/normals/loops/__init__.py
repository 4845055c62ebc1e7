"""Compiled loops that all solvers use. A picture is solved block by block: some hundred pixels of one row at a time.

``blocks`` says how a block lies in memory. ``measuring`` reads samples and makes measurements of them, ``near_kernel``
says what every light sends to every pixel, ``storing`` turns a solution into normals and albedo. ``colour_kernel``
is the short way for the common case: three channels, distant lights, every measurement usable.
"""
