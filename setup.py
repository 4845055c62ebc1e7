"""Copies the scenes of data_synth/ into the package when it is built; everything else stands in pyproject.toml."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithScenes(build_py):
    """Build the package, with data_synth/*.toml as psvideo/synth/scenes/*.toml."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return  # a checkout reads data_synth/ itself
        for scene, copy in self._scenes().items():
            self.mkpath(str(Path(copy).parent))
            self.copy_file(scene, copy)

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        return [*super().get_outputs(include_bytecode), *self._scenes().values()]

    def _scenes(self) -> dict[str, str]:
        """Return the copy of every scene by its file."""
        folder = Path(self.build_lib) / "psvideo" / "synth" / "scenes"
        return {str(scene): str(folder / scene.name) for scene in sorted(Path("data_synth").glob("*.toml"))}


setup(cmdclass={"build_py": BuildWithScenes})
