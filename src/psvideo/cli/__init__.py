"""The command line: every command parses, makes one library call, and prints.

``app`` assembles the ``commands``, which take their ``options`` from a room of their own. ``first_screen``,
``examples`` and ``teaching`` make the help; ``console`` prints, ``live_lines`` what a live run says every second;
``spelling`` turns parameters into options in what the library says, ``ending`` ends commands that are stopped.
"""
