"""Building the controller's real firmware and the board that runs it in emulation, from a checkout's lights/ folder.

Nothing is built where nothing changed: make sees to that. Two builds at once wait for each other.
"""

import contextlib
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from psvideo.errors import PsvideoError

AvrBoard = Literal["atmega328p", "atmega2560"]
StandIn = Literal[AvrBoard, "python"]
"""What answers where no board is: the real firmware on an emulated chip, or a board in plain Python."""
AVR_BOARDS: tuple[AvrBoard, ...] = ("atmega328p", "atmega2560")

PACKAGES = ("gcc-avr", "avr-libc", "libsimavr-dev", "libelf-dev")
"""Debian's names for what is needed beside make and a C compiler."""


@dataclass(frozen=True, kw_only=True)
class Built:
    """The emulator's program and the firmware that it is to run."""

    emulator: Path
    firmware: Path


def lights_folder() -> Path | None:
    """Return the checkout's lights/ folder; None where psvideo is installed without it."""
    folder = Path(__file__).resolve().parents[4] / "lights"
    whole = (folder / "firmware" / "Makefile").is_file() and (folder / "emulator" / "Makefile").is_file()
    return folder if whole else None


def missing_packages() -> tuple[str, ...]:
    """Return the Debian packages that lack here for building firmware and emulator; none where all is there."""
    lacking = [name for name, program in (("make", "make"), ("gcc", "cc"), ("gcc-avr", "avr-gcc")) if not _has(program)]
    headers = (("avr-libc", "avr-gcc", "avr/io.h"), ("libsimavr-dev", "cc", "simavr/sim_avr.h"))
    for name, compiler, header in (*headers, ("libelf-dev", "cc", "libelf.h")):
        if not _has(compiler) or not _finds(compiler, header):
            lacking.append(name)
    return tuple(lacking)


def _has(program: str) -> bool:
    return shutil.which(program) is not None


def _finds(compiler: str, header: str) -> bool:
    """Return whether a compiler finds a header."""
    search = [
        compiler,
        *(["-mmcu=atmega328p"] if compiler == "avr-gcc" else []),
        "-E",
        "-include",
        header,
        "-x",
        "c",
        "-",
    ]
    return subprocess.run(search, input=b"", capture_output=True, check=False).returncode == 0


def missing_tools() -> str | None:
    """Return in one sentence why the real firmware cannot be run here, or None where it can."""
    if lights_folder() is None:
        return (
            "the real firmware is built from its sources in psvideo's repository (lights/firmware), and an installed "
            "package does not hold them"
        )
    lacking = missing_packages()
    return f"building the firmware and its emulator needs the Debian packages {' '.join(lacking)}" if lacking else None


def build(board: AvrBoard) -> Built:
    """Build what changed and return the programs.

    Raises PsvideoError where the checkout or packages are missing (named, with the other way: the Python board), or
    where make fails.
    """
    reason, lights = missing_tools(), lights_folder()
    if reason is not None or lights is None:
        advice = "Install them (lights/emulator/install.sh)" if lights else "Run it from a checkout"
        raise PsvideoError(f'`board={board!r}`: {reason}. {advice}, or take `board="python"`, which needs neither.')
    with _alone(lights / "emulator"):
        for folder in (lights / "firmware", lights / "emulator"):
            _make(folder)
    return Built(
        emulator=lights / "emulator" / "build" / "emulator",
        firmware=lights / "firmware" / "build" / f"{board}.elf",
    )


def _make(folder: Path) -> None:
    run = subprocess.run(["make", "-C", str(folder)], capture_output=True, text=True, check=False)
    if run.returncode:
        last = " / ".join(line.strip() for line in run.stderr.splitlines()[-4:])
        raise PsvideoError(f"{folder}: make failed: {last}. Run make -C {folder} yourself to see all of it.")


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Wait until no other process builds there."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    with (folder / "Makefile").open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
