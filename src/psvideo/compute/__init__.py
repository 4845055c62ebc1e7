"""How hot loops are compiled, kept on disk and shared between threads; and the memory that they work on.

``compiled`` and ``parts`` compile, ``loaded`` loads what is kept, ``compilers_code`` lets the compiler's memory go
then, ``compile_count`` counts how much is compiled; ``heap`` sets up memory and libraries before they load, ``memory``
and ``spilled`` hold arrays (in files, where they are large), ``half_bits`` stands in where the processor knows no half
floats, ``whole_stores`` keeps LLVM from storing parts of vectors, ``halves`` and ``symmetric`` are small loops that
many rooms use, ``ranks`` finds medians and quantiles. ``cubic`` interpolates, ``cubic_eight`` at eight places beside
each other, and ``linear_eight`` 8-bit codes (``eight_lanes`` is what both write vectors with). ``threads`` shares work,
``side_threads`` starts threads that the end of the process waits for, ``progress`` shows how far work is.
"""
