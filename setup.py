"""What building the package does beside pyproject.toml: it copies the scenes of data_synth/ and the add-on for Blender
into it, and a wheel gets loops that are compiled for the processor it is built on (docs/decisions/first-run.md)."""

import os
import subprocess
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithScenes(build_py):
    """Build the package with its scenes and the add-on; for a wheel, with compiled loops."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return  # a checkout reads data_synth/ itself
        for file, copy in self._copies().items():
            self.mkpath(str(Path(copy).parent))
            self.copy_file(file, copy)
        if self.distribution.get_command_obj("bdist_wheel", create=False):
            self._compile_loops()

    def get_outputs(self, include_bytecode: bool = True) -> list[str]:
        return [*super().get_outputs(include_bytecode), *self._copies().values()]

    def _compile_loops(self) -> None:
        """Compile loops beside their modules; where this Python cannot run psvideo, the first run does it."""
        there = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
        before = os.environ.get("PYTHONPATH")  # pip's way to the libraries that it has here for building
        version_in = str(Path("src").resolve())  # the package's own record of itself, which setuptools wrote there
        paths = [str(Path(self.build_lib).resolve()), version_in, *([before] if before else [])]
        command = [sys.executable, "-B", "-m", "psvideo.runs.steps.compiling"]
        if subprocess.run(command, env=there | {"PYTHONPATH": os.pathsep.join(paths)}, check=False).returncode:
            self.warn("loops could not be compiled here, and will be by the first run (psvideo doctor --compile)")

    def _copies(self) -> dict[str, str]:
        """Return the copy of every scene, and of the add-on for Blender, by its file."""
        package = Path(self.build_lib) / "psvideo"
        addons = Path("integrations/blender")
        copies = {scene: package / "synth" / "scenes" / scene.name for scene in Path("data_synth").glob("*.toml")}
        for file in (*addons.glob("*/*.py"), *addons.glob("*/*.toml")):
            copies[file] = package / "export" / "programs" / "blender" / file.relative_to(addons)
        return {str(file): str(copy) for file, copy in sorted(copies.items())}


setup(cmdclass={"build_py": BuildWithScenes})
