"""The controller's real firmware in emulation, as a serial port: started and stopped.

The emulator (lights/emulator) is a process of its own that plays an ATmega328P or ATmega2560 and its pins. Its clock
keeps pace with the wall's, or runs as fast as it goes; its trace counts virtual time only.
"""

import contextlib
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import whole_file
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.stand_ins.toolchain import AvrBoard, Built, build

STOPS_WITHIN_S = 10.0


@dataclass(frozen=True, kw_only=True)
class Emulation:
    """Which board to emulate, how the lights hang on it, and where its edges go (None = nowhere)."""

    board: AvrBoard
    wiring: WiringName = "gated"
    trace: Path | None = None
    fast: bool = False


class EmulatedBoard:
    """A board that is running; ``port`` is the serial port's name."""

    def __init__(self, process: subprocess.Popen[str], port: str) -> None:
        self._process = process
        self.port = port

    @property
    def is_running(self) -> bool:
        """False once the board ended by itself, which it does only where its program breaks."""
        return self._process.poll() is None


@contextlib.contextmanager
def emulated_board(wish: Emulation) -> Iterator[EmulatedBoard]:
    """Run a board until the block ends; the trace is whole then, however the block ended.

    Raises PsvideoError where it cannot be built or started, or where the chip stopped by itself.
    """
    built = build(wish.board)
    with contextlib.ExitStack() as stack:
        trace = None if wish.trace is None else stack.enter_context(whole_file(wish.trace))
        process = _start(built, wish, trace)
        try:
            yield EmulatedBoard(process, _port_of(process))
        finally:
            _stop(process)
        if process.returncode:
            raise PsvideoError(f"The emulated {wish.board} stopped by itself (status {process.returncode}).")


def _start(built: Built, wish: Emulation, trace: Path | None) -> subprocess.Popen[str]:
    words = [str(built.emulator), "--board", wish.board, "--wiring", wish.wiring]
    words += ["--trace", str(trace)] if trace else []
    words += ["--fast"] if wish.fast else []
    return subprocess.Popen(
        [*words, str(built.firmware)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,  # a Ctrl-C is for us, who then stop it
    )


def _port_of(process: subprocess.Popen[str]) -> str:
    port = process.stdout.readline().strip() if process.stdout else ""
    if not port:
        raise PsvideoError("The emulated board did not start; its own message is above.")
    return port


def _stop(process: subprocess.Popen[str]) -> None:
    """End the process by ending its stdin, at which it finishes its trace; by force where it does not listen."""
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()
    try:
        process.wait(STOPS_WITHIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def play_script(script: str, *, board: AvrBoard, wiring: WiringName = "gated", trace: Path | None = None) -> list[str]:
    """Play a script (lights/emulator/script.h) on a fresh board as fast as it goes; return what was printed, by line.

    Raises PsvideoError where the board cannot be built or the script cannot be played.
    """
    built = build(board)
    words = [str(built.emulator), "--board", board, "--wiring", wiring, "--script", "-"]
    words += ["--trace", str(trace)] if trace else []
    run = subprocess.run([*words, str(built.firmware)], input=script, capture_output=True, text=True, check=False)
    if run.returncode:
        raise PsvideoError(f"The script cannot be played: {run.stderr.strip()}")
    return run.stdout.splitlines()
