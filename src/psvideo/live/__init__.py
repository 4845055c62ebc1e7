"""Live on the set: frames as they come in, the strobe's clock followed, the newest picture out, for as long as it runs.

``chain`` is what happens to a frame, without threads or clocks: begin there. ``running`` runs it beside a camera, and
``standing`` asks all who work how things stand. While there is nothing to show: ``preparing``, ``waiting``. When a
result is begun: ``rhythm``; how fast results come and how old they are: ``result_times``; whether that is enough:
``keeping_up``. Beside it: ``watching`` (verdicts), ``ball_lights`` (a chrome ball in the picture), ``status`` (what is
said of the run, once a second), ``followed_timing`` (the timing of all of it, at the end).

Rooms, in the order in which a frame goes through them:

- ``incoming``: frames from a camera, kept, recorded or left out
- ``following``: the strobe's clock, found and kept
- ``showing``: the newest round solved and shown, as fast as the machine allows
"""
