"""Decoders, one module for each kind of file. Only this room and ``clip.transfer`` know decoding libraries.

``decoders`` chooses one by the kind of file. Pictures: ``png``, ``tiff``, ``jpeg``, ``dpx``, ``exr`` with
``exr_channels`` and ``exr_chunks``, ``dng``, ``raw`` (other cameras); ``signatures`` recognises files with a wrong
ending. Mosaics: ``malvar2004`` with ``malvar_kernel``. Movies have a room, ``movies``.
"""
