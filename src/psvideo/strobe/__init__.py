"""The strobe controller seen from the host: what it can play, how to talk to it, and a copy of it in Python.

Read in this order: ``link.lines`` (checksums, and lines out of bytes), ``link.requests`` and ``link.replies`` (what is
said, as records, in ``link.words``) and ``link.protocol`` (records from and to lines); ``limits`` (what a controller
refuses) and ``link.boards`` (those that are known); ``bursts``, ``wiring`` and ``program`` (a plan in ticks),
``seizures`` and ``program_words`` (what to know of it before it is played); ``link.exchange``, ``link.greeting``,
``session`` and ``clock`` (a run from the first word to the last); ``link.ports`` and ``link.controller`` (what carries
it); ``runlog`` (what was played, as a file), ``as_played`` (a plan with what its log knows better) and ``confirmed``
(who was warned). ``stand_ins`` are boards that are not there, of two kinds: *emulated* is the real firmware on a
simulated chip (``emulated``, ``toolchain``); the *Python board* answers and switches as the firmware does and runs on
every system (``python_board`` with ``rules`` and ``playing``; ``python_board_port`` inside this program, opened as the
port named ``emulated``, and ``python_board_server`` for other programs).
"""
