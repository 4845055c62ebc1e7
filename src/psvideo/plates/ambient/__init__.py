"""Light that is always there, and how it is taken off the plates.

With dark slots: ``ambient_shown`` reads them ahead of the plates, ``ambient_followed`` follows their light through time
(``ambient_change`` and ``ambient_blocks`` say what of it changed, ``ambient_kernel`` holds the loops), ``mains`` finds
the stripes of lamps on alternating current, and ``ambient_off`` takes off what lay between two slots. Without dark
slots ``ambient_regression`` finds ambient light from rows that saw a part of a flash, and ``lee1980`` takes the noise
off it. ``ambient_level`` is its record.
"""
