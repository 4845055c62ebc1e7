"""One ``course`` of the strobe through the whole take.

``track`` follows it block by block; ``steps_ahead`` says how many frames are missing or repeated in the next one,
``missing_instead`` where one that seems repeated shows that others are missing, ``losses`` how badly frames fit, and
``misfires`` how badly where flashes may not have fired. Once all are followed, ``false_holes`` takes back holes that
only a subject that moves speaks for, ``holes`` looks at missing and repeated frames again, ``instead`` at those that a
flash that never fired explains as well, and ``ends`` settles what the first and last frames show.
"""
