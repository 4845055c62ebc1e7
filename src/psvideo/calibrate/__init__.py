"""Measuring cameras and lights beforehand: what a shoot's plan and rig file are to say.

- where lights are: ``sphere`` (the outline of a ball), ``mirror`` (highlights on a chrome one), ``matte`` (a matte one,
  by its shading under one lamp, ``matte_shading``), ``guess`` (from pictures alone)
- how strong: ``flat_field``, ``cho2020``, ``led_colours``, from a ``white_target``
- which pictures: ``light_pictures``, ``picture_sets``, ``light_folder``, ``light_files``, ``still_names``,
  ``listed_names``, ``still_pairs`` (with ``unpaired_stills``: why none can be made), ``still_places``
- how long a camera reads: ``stripes`` (from a blinking LED), ``strobed_readout`` (from a strobed clip)
"""
