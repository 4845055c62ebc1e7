"""The scenes that come with psvideo, found by name: bust, cameras, colour, fan, gloss, sphere, still_life.

Their one home is data_synth/ of the repository; installing copies them into the package (setup.py), to scenes/ beside
this module.
"""

from pathlib import Path

from psvideo.errors import PsvideoError

INSTALLED = Path(__file__).parent / "scenes"
CHECKOUT = Path(__file__).resolve().parents[3] / "data_synth"


def builtin_scenes() -> dict[str, Path]:
    """Return the files of the scenes that come with psvideo, by name, in the order of their names."""
    folder = CHECKOUT if CHECKOUT.is_dir() else INSTALLED
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def builtin_scene(name: str = "bust") -> Path:
    """Return the file of a scene that comes with psvideo. Raises PsvideoError for an unknown name."""
    scenes = builtin_scenes()
    if name not in scenes:
        raise PsvideoError(
            f"{name}: is neither a file nor a scene that comes with psvideo; those are {', '.join(scenes)}."
        )
    return scenes[name]


def scene_file(scene: Path) -> Path:
    """Return the file that a scene's path or name means; a file or folder that is there goes before a name.

    Only a bare name, without folder and suffix, is looked up: a path that leads nowhere stays as it is, for the
    reader's own message. Raises PsvideoError for an unknown name.
    """
    is_name = scene.name == str(scene) and not scene.suffix
    return builtin_scene(scene.name) if is_name and not scene.exists() else scene
