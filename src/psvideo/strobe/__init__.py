"""The strobe controller seen from the host: what it can play, how to talk to it, and a copy of it in Python.

Read in this order: ``lines`` (checksums, and lines out of bytes), ``messages`` (what is said, as records) and
``protocol`` (records from and to lines); ``limits`` (what a controller refuses) and ``boards`` (those that are known);
``bursts`` and ``program`` (a plan in ticks), ``flicker`` and ``describe`` (what to know of it before it is played);
``playing``, ``rules`` and ``emulated`` (a controller without hardware); ``link``, ``greeting``, ``session`` and
``clock`` (a run from the first word to the last); ``ports``, ``controller`` and ``emulated_port`` (what carries it);
``runlog`` (what was played, as a file) and ``confirmed`` (who was warned).
"""
