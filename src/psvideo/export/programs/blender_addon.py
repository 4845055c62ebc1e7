"""The add-on for Blender, packed as Blender installs it.

Its one home is integrations/blender/ of the repository; installing copies it into the package (setup.py), beside this
module.
"""

import io
import zipfile
from pathlib import Path

NAME = "psvideo_import"
ADDON_FILE = f"{NAME}.zip"
INSTALLED = Path(__file__).parent / "blender"
CHECKOUT = Path(__file__).resolve().parents[4] / "integrations" / "blender"
EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time that every file of the archive bears, so that the same add-on gives the same bytes."""


def addon_folder() -> Path:
    """Return where the add-on's files are."""
    return (CHECKOUT if CHECKOUT.is_dir() else INSTALLED) / NAME


def addon_zip() -> bytes:
    """Return the add-on as one file, for Edit > Preferences > Add-ons > Install from Disk."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(path for path in addon_folder().iterdir() if path.suffix in (".py", ".toml")):
            archive.writestr(zipfile.ZipInfo(file.name, EPOCH), file.read_bytes())
    return packed.getvalue()
