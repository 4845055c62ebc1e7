"""The newest round solved and shown. ``newest_round`` makes plates of the latest frames, ``newest_result`` a surface.

``smaller`` (``smaller_kernel``) and ``quality`` keep up with the camera: smaller pictures, or fewer of them.
``newest_pictures`` holds what is shown, ``page_server`` sends it to the page.
"""
