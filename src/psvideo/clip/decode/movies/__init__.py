"""Movies, by FFmpeg: ``movie`` opens one and gives its frames: begin there.

What the file says of itself: ``movie_edits`` (cuts that hide frames), ``movie_tags`` (colour and camera),
``movie_times`` (how many frames, and when each was taken). From planes to codes: ``movie_codes``, with
``ffmpeg_planes`` and ``yuv``.
"""
