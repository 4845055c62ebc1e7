"""Measuring cameras and lights beforehand: what a shoot's plan and rig file are to say.

Where lights are: ``sphere`` (the outline of a ball), ``mirror`` (highlights on a chrome one), ``matte`` (a matte one,
by its shading under one lamp, ``matte_shading``), ``guess`` (from pictures alone). How strong: ``flat_field``,
``cho2020``, ``led_colours``, from a ``white_target``. Which pictures: ``light_pictures``, ``picture_sets``,
``light_folder``, ``light_files``, ``still_names``, ``listed_names``, ``still_pairs``, ``still_places``. How long a
camera reads: ``stripes`` (from a blinking LED), ``strobed_readout`` (from a strobed clip).
"""
