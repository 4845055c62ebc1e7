"""Frames from a camera, as they come: opened by ``sources``, each a ``source`` that gives one ``live_frame`` after the
other. The newest ones are kept in a ``ring``; ``frame_count`` counts them.

``recording`` writes them to disk; ``behind`` notices when they wait to be fetched.
"""
