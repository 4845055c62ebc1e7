"""The panels that group options in the help of commands with many of them."""

STILLS = ("lights", "sphere", "spheres", "dark", "transfer", "focal_px", "focal_mm", "sensor_mm", "radius_mm", "circle")
"""What photographs are read with."""

PANELS = {
    "The clip and its timing": ("plan", "timing", "frames", "first_light", "rig", "mask", "start_number", *STILLS),
    "How normals are solved": ("solver", "near_iterations", "max_gap"),
    "Motion and time": ("align", "rate", "denoise"),
    "What is written, and in which convention": (
        *("space", "camera_to_world", "camera", "camera_time", "y", "float32", "aov", "mesh", "encode", "compression"),
        *("separate", "multipart", "preset", "plates", "with_ambient", "weight", "beauty", "rti"),
        *("preview", "no_preview", "preview_codec"),
    ),
    "How the command runs": ("force", "resume", "json", "verbose", "quiet", "help"),
}
"""Parameters by panel, in the order in which panels stand."""
MANY = 12
"""Commands with fewer options show them in one panel."""


def panel_of(parameter: str) -> str | None:
    """Return the panel in which an option stands, or nothing for the common one."""
    return next((panel for panel, names in PANELS.items() if parameter in names), None)
