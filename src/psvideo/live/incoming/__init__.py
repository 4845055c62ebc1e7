"""Frames from a camera, as they come: opened by ``sources``, each a ``source``; the newest ones are kept in a ``ring``.

``recording`` writes them to disk; ``behind`` notices when they wait to be fetched.
"""
