"""What ``psvideo live`` does beside following and showing.

``live_sources`` lists cameras, devices and boards, ``live_rehearsal`` loads and compiles before the source is opened,
``live_strobe`` plays the plan on a board that follows the camera, ``live_viewed`` serves the page, ``live_recorded``
keeps frames and timing.
"""
