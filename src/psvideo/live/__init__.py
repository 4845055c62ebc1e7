"""Live on the set: frames as they come in, the strobe's clock followed, the newest picture out, for as long as it runs.

``lock`` finds the strobe from nothing, ``follow`` keeps it frame by frame; ``newest_round`` makes plates of the latest
frames, ``chain`` puts these together without a thread or a clock, and ``running`` gives it both.
"""
