"""The panels that group options in the help of commands with many of them."""

STILLS = (
    "lights",
    "sphere",
    "spheres",
    "dark",
    "transfer",
    "white_level",
    "focal_px",
    "focal_mm",
    "sensor_mm",
    "radius_mm",
    "circle",
)
"""What photographs are read with."""

CLIP = "The clip and its timing"

PANELS = {
    CLIP: ("plan", "timing", "frames", "first_light", "rig", "mask", "start_number", *STILLS),
    "How normals are solved": ("solver", "fill", "near_iterations", "flat", "depth", "depth_scale"),
    "Motion and time": ("align", "fps", "shutter", "resync", "denoise"),
    "What is written, and in which convention": (
        *("space", "camera_to_world", "camera", "camera_time", "y", "float32", "aov", "mesh", "encode", "compression"),
        *("separate", "multipart", "preset", "plates", "with_ambient", "weight", "beauty", "rti"),
        *("preview", "no_preview", "preview_codec"),
    ),
    "How the command runs": ("force", "resume", "piece", "workers", "scheduler", "json", "verbose", "quiet", "help"),
}
"""Parameters by panel, in the order in which panels stand."""
MANY = 12
"""Commands with fewer options show them in one panel."""


def panel_of(parameter: str) -> str | None:
    """Return the panel in which an option stands that names none itself, or nothing for the common one."""
    return next((panel for panel, names in PANELS.items() if parameter in names), None)
