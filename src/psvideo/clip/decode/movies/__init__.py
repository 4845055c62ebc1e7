"""Movies, by FFmpeg. Begin with ``movie``: what one holds; ``movie_frames`` opens it and gives its frames.

What the file says of itself: ``movie_edits`` (cuts that hide frames), ``movie_tags`` (colour and camera),
``movie_times`` (how many frames, and when each was taken), ``movie_ends`` (whether it breaks off). From planes to
codes: ``movie_codes``, with ``ffmpeg_planes`` and ``yuv``. ``ffv1_slices``: frames whose damage FFmpeg keeps to itself.
"""
