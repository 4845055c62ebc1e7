"""What a file is, what this machine can do, and whether all of it fits together.

``describe`` chooses for ``psvideo info``: ``about_file``, ``about_plan``, ``about_clip``, ``about_movie``,
``about_photographs``, ``about_output``. For ``psvideo doctor``: ``software``, ``machine``, ``speed``. ``findings`` are
the records of both.
"""
