"""A camera that shakes shifts the whole picture, by another amount at every flash.

``camera_path`` finds where the picture was at every flash around an instant: ``shifting_picture`` says whether it
shifts as a whole, ``by_paint`` what plates of two lights show of that, from what ``registered`` says of two pictures,
and ``one_surface`` where one explains those of all lights. ``steadied`` shifts sketches, and what plates are taken
from, by that.
"""
