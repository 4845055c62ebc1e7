"""Options that commands share, the panels of help they stand in, and what becomes of the words that people type.

By what they belong to: ``clip_and_run``, ``solving``, ``delivery``, ``stills``, ``live``, ``calibrate``, ``capture``,
``strobe``. ``panels`` groups them in the help, ``records`` makes one parameter of those that come together,
``completing`` offers values to the shell, ``typed``, ``per_light`` and ``shoot_words`` read what was typed.
"""
