"""Write the virtual shoot's built-in meshes as PLY files, to look at them or to use them in another program.

The shipped scenes do not need these files: psvideo makes the meshes by the same formulas when a scene names them.
Run it as ``python data_synth/make_meshes.py [-o FOLDER] [NAME ...]``; without names it makes all of them.
"""

import argparse
from pathlib import Path

import numpy as np
import trimesh

from psvideo.synth.camera.curves import CURVES
from psvideo.synth.subject.meshes import builtin_names, builtin_shape


def main() -> None:
    """Make the meshes that the command line names."""
    parser = argparse.ArgumentParser(description="Write the virtual shoot's built-in meshes as PLY files.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"which ones, of: {', '.join(builtin_names())}")
    parser.add_argument("-o", "--out", type=Path, default=Path("meshes"), metavar="FOLDER", help="where to (meshes/)")
    given = parser.parse_args()
    unknown = sorted(set(given.names) - set(builtin_names()))
    if unknown:
        parser.error(f"there is no built-in mesh {unknown[0]!r}; known are: {', '.join(builtin_names())}")
    given.out.mkdir(parents=True, exist_ok=True)
    for name in given.names or builtin_names():
        write_ply(given.out / f"{name}.ply", name)


def write_ply(path: Path, name: str) -> None:
    """Write one built-in mesh with its normals and its colours (as sRGB, which is how programs read vertex colours)."""
    shape = builtin_shape(name)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, vertex_normals=shape.normals, process=False)
    if shape.colours is not None:
        mesh.visual.vertex_colors = np.round(CURVES["srgb"].encode(shape.colours) * 255).astype(np.uint8)
    mesh.export(path)
    print(f"{path}: {len(shape.vertices)} vertices, {len(shape.faces)} triangles")


if __name__ == "__main__":
    main()
