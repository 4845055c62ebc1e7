"""Virtual takes that several tests look at, each filmed when it is first asked for."""

from collections.abc import Callable, Mapping
from pathlib import Path

from coarse_ball import write_coarse_ball

from psvideo.cli.app import main


def filmed(folder: Path, scenes: Mapping[str, str]) -> Callable[[str], Path]:
    """Return what gives the clip of a scene by name, filmed into the folder once; ``scenes`` holds scene.toml texts."""
    write_coarse_ball(folder)

    def film(name: str) -> Path:
        clip = folder / name
        if not clip.is_dir():
            scene = folder / f"{name}.toml"
            scene.write_text(scenes[name])
            assert main(["synth", str(scene), "-o", str(clip), "-q"]) == 0
        return clip

    return film
