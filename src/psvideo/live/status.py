"""How things stand: one record a second for machines, one line for people, and what it came to at the end."""

from dataclasses import asdict, dataclass
from typing import Literal

from psvideo.live.following.follow import State
from psvideo.model.timing import Order
from psvideo.model.units import counted

LiveState = Literal["preparing"] | State
"""Before the source is opened, live is preparing: it loads, and compiles where nothing is kept yet."""
SAID: dict[LiveState, str] = {
    "preparing": "getting ready",
    "seeking": "looking for the strobe",
    "locked": "locked",
    "unsure": "not sure of the strobe",
    "lost": "STROBE LOST, looking for it",
}


@dataclass(frozen=True, kw_only=True)
class LiveStatus:
    """The last second. ``age_s`` is from the coming of a result's last frame until pages had drawn it (where none is
    open, until it was made), the median, ``oldest_s`` the largest, None where there was none.

    ``phase_error_rows``, ``clock_offset_ppm`` and ``order``, how the lights' names are known, are None while nothing is
    followed; ``why`` says then why not.
    ``recorded`` counts the frames that are, None where none is to be; ``record_ended``: it ended before the run did.
    ``compiling`` says how far that is, "" where nothing is compiled. ``waits_for`` says what is missing and what to do
    where nothing can be shown for long.
    ``width_px`` and ``height_px`` are the live picture's; ``off_rows`` is how far the dark row
    is from where the strobe is to hold it, and ``trim_ppm`` by how much the board's steps are longer; None without.
    """

    at_s: float
    state: LiveState
    fps: float
    frames: int
    lost: int
    results: int
    results_per_s: float
    age_s: float | None
    oldest_s: float | None
    phase_error_rows: float | None
    clock_offset_ppm: float | None
    order: Order | None
    width_px: int
    height_px: int
    why: str = ""
    compiling: str = ""
    waits_for: str = ""
    recorded: int | None = None
    record_ended: bool = False
    off_rows: float | None = None
    trim_ppm: int | None = None
    notes: tuple[str, ...] = ()

    @property
    def silent(self) -> bool:
        """Whether frames came, and none in the last second."""
        return self.state != "preparing" and self.frames > 0 and not self.fps

    @property
    def all_words(self) -> tuple[str, ...]:
        """What is missing, and what else there is to say of the run."""
        return (*filter(None, [self.waits_for]), *self.notes)

    @property
    def line(self) -> str:
        """One line for a terminal."""
        if self.state == "preparing":
            return self.compiling or SAID[self.state]
        comes = "NO FRAMES COME" if self.silent else f"{self.fps:.1f} fps"
        guessed = "NAMES OF LIGHTS ARE A GUESS" if self.order == "guess" else ""
        parts = [SAID[self.state], *filter(None, (guessed, self.compiling)), comes]
        if self.phase_error_rows is not None and self.clock_offset_ppm is not None:
            parts.append(f"+-{self.phase_error_rows:.2g} row, {self.clock_offset_ppm:+.1f} ppm")
        parts.append(f"{self.frames} frames, {self.lost} lost")
        parts.append(f"{self.results_per_s:.1f} results/s at {self.width_px} x {self.height_px}")
        if self.age_s is not None:
            parts.append(f"{1e3 * self.age_s:.0f} ms old")
        if self.trim_ppm is not None:
            off = "dark row not held" if self.off_rows is None else f"dark row {-self.off_rows:+.1f} rows off"
            parts.append(f"{off}, trim {self.trim_ppm:+d} ppm")
        if self.recorded is not None:
            parts.append(f"{'RECORDING ENDED, ' if self.record_ended else ''}{self.recorded} recorded")
        return " | ".join(parts)

    @property
    def record(self) -> dict[str, object]:
        """The same for machines."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True)
class LiveSummary:
    """What a live run came to. ``locks`` is how often the strobe was found, ``first_lock_s`` in how much footage.

    ``results`` were made; ``ages_s`` are the median and the largest age of a picture, None where nothing was made.
    """

    seconds: float
    frames: int
    lost: int
    locks: int
    first_lock_s: float | None
    results: int
    ages_s: tuple[float, float] | None
    phase_error_rows: float | None
    clock_offset_ppm: float | None
    recorded: int | None = None
    notes: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The summary in two or three sentences."""
        text = f"{self.frames} frames in {self.seconds:.1f} s, {self.lost} lost; {counted(self.results, 'result')}."
        if self.phase_error_rows is not None and self.clock_offset_ppm is not None:
            after = "" if self.first_lock_s is None else f" after {self.first_lock_s:.1f} s of footage"
            again = "" if self.locks == 1 else f", and found again {_times(self.locks - 1)}"
            text += (
                f" The strobe was found{after}{again}; it runs "
                f"{self.clock_offset_ppm:+.1f} ppm against the camera, its flashes known to "
                f"{self.phase_error_rows:.2g} row."
            )
        if self.recorded is not None:
            text += f" {self.recorded} frames were recorded."
        if self.ages_s is not None:
            text += f" Pictures were {1e3 * self.ages_s[0]:.0f} ms old (at most {1e3 * self.ages_s[1]:.0f} ms)."
        return text

    @property
    def record(self) -> dict[str, object]:
        """The same for machines."""
        return {"done": True, **asdict(self)}


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
