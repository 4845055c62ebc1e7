"""The strobe controller seen from the host: what it can play, how to talk to it, and a copy of it in Python.

Read in this order: ``lines`` (checksums, and lines out of bytes), ``messages`` (the
records) and ``protocol`` (records from and to lines), ``limits`` (what a
controller refuses), ``boards`` (the boards that are known), ``bursts`` and ``program`` (a plan in ticks), ``emulated``
(a controller without hardware), ``clock`` (its clock against ours), ``flicker`` (what eyes make of a plan), ``runlog``
(what was played, as a file), ``ports`` and ``controller`` (the real thing at a serial port).
"""
