"""The outline of a sphere in a picture, and how the camera sees it."""
