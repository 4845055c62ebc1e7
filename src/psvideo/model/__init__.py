"""What a shoot is: camera, plan, timing, rig, surface, as frozen records and pure functions. No files, no pixels."""
