"""Python, the libraries, and what footage they read."""

import platform
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version

from psvideo.clip.decode import decoders
from psvideo.inspect.findings import Finding
from psvideo.strobe.stand_ins.toolchain import missing_tools

REINSTALL = "Install psvideo again in a fresh environment: pip install ."
LIBRARIES = (
    *("numpy", "scipy", "numba", "opencv-contrib-python-headless", "trimesh", "pyserial", "tifffile", "imagecodecs"),
    *("pillow", "fileseq", "pydantic", "tomlkit", "typer", "rich", "embreex"),
)
EXTRAS = {
    "usd-core": ('meshes and cameras as USD (`mesh=["usd"]`, `camera_to_world`)', "pip install 'psvideo[usd]'"),
    "distributed": ("several processes and machines (`workers`, `scheduler`)", "pip install 'psvideo[dask]'"),
    "websockets": ("the page of psvideo live", "pip install 'psvideo[live]'"),
    "pypylon": ("GenICam cameras (psvideo live genicam)", "pip install 'psvideo[genicam]'"),
}
"""By library: what it is for, and how to install it; the extras of pyproject.toml that users want."""
LEAST_PYTHON = (3, 11)


def software() -> Iterator[Finding]:
    """Give a finding for Python and each library."""
    yield Finding(name="psvideo", level="ok", text=version("psvideo"))
    yield _python()
    yield from (_library(name) for name in LIBRARIES)
    yield _compiler()
    yield from (
        _loaded("OpenEXR", decoders.exr_library, "EXR"),
        _loaded("LibRaw (rawpy)", decoders.raw_library, "DNG"),
        _loaded("OpenColorIO", decoders.curve_library, "log curves"),
    )
    yield from _movies()
    yield from (_extra(name, *words) for name, words in EXTRAS.items())
    reason = missing_tools()
    yield Finding(
        name="emulated board",
        level="ok" if reason is None else "note",
        text="the strobe's real firmware can be emulated" if reason is None else reason,
        next_step="" if reason is None else 'Only strobe emulate needs it; `board="python"` does without.',
    )


def _python() -> Finding:
    good = sys.version_info >= LEAST_PYTHON
    step = "" if good else f"psvideo needs Python {'.'.join(map(str, LEAST_PYTHON))} or newer."
    text = f"{platform.python_version()}, {platform.python_implementation()}, {platform.machine()}"
    return Finding(name="Python", level="ok" if good else "missing", text=text, next_step=step)


def _library(name: str) -> Finding:
    try:
        return Finding(name=name, level="ok", text=version(name))
    except PackageNotFoundError:
        return Finding(name=name, level="missing", text="not installed", next_step=REINSTALL)


def _compiler() -> Finding:
    """Say how loops are compiled: each by itself in psvideo's own threads, never in numba's."""
    try:
        config = import_module("numba").config
    except ImportError as fault:
        return Finding(name="numba's compiler", level="missing", text=str(fault), next_step=REINSTALL)
    if config.DISABLE_JIT:
        step = "Unset NUMBA_DISABLE_JIT: without compiling everything is a hundred times slower."
        return Finding(name="numba's compiler", level="missing", text="switched off", next_step=step)
    from psvideo.compute.compiled import folder_kept_in  # which needs numba

    if folder_kept_in() is None:
        text = "compiles for this processor, and can keep nothing: what installing did not compile, every run does"
        step = "Set NUMBA_CACHE_DIR to a folder that can be written; psvideo's own and your home cannot."
        return Finding(name="numba's compiler", level="note", text=text, next_step=step)
    text = "compiles for this processor; rows are shared out over psvideo's own threads, not numba's"
    return Finding(name="numba's compiler", level="ok", text=text)


def _loaded(name: str, ask: Callable[[], str], reads: str) -> Finding:
    try:
        return Finding(name=name, level="ok", text=f"{ask()}: {reads}")
    except (ImportError, AttributeError, OSError) as fault:
        return Finding(name=name, level="missing", text=f"{reads} cannot be read ({fault})", next_step=REINSTALL)


def _movies() -> Iterator[Finding]:
    try:
        found = decoders.movie_decoders()
    except ImportError as fault:
        yield Finding(name="movies (PyAV)", level="missing", text=str(fault), next_step=REINSTALL)
        return
    for name, there in found.items():
        step = "" if there else "Install PyAV from its wheel (pip uninstall av, then pip install av), or shoot frames."
        text = "decoded" if there else "no decoder"
        yield Finding(name=f"movies: {name}", level="ok" if there else "missing", text=text, next_step=step)


def _extra(name: str, what: str, how: str) -> Finding:
    try:
        return Finding(name=name, level="ok", text=f"{version(name)}: {what}")
    except PackageNotFoundError:
        return Finding(name=name, level="note", text=f"not installed; only for {what}", next_step=f"{how}.")
