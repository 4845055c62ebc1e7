"""Frames that come while they are recorded: a ``growing_folder``, a ``stream`` (a camera, an address, standard input;
``stream_rate`` judges its rate), a machine vision camera (``genicam``, whose driver runs in a process of its own:
``genicam_camera``).
"""
