"""The strobe held to the camera: trims asked of a board, as the followed clock says, and released where it is lost."""

from collections.abc import Callable
from dataclasses import dataclass, field

from psvideo.live.chain import Chain
from psvideo.live.following.genlock import EVERY_S, DarkRow, WantedRow, dark_row, next_trim_ppm, rows_around
from psvideo.strobe.link.exchange import RefusedError
from psvideo.strobe.link.lines import Error
from psvideo.strobe.link.requests import Trim


def counts_after_s(step_s: float, lead_s: float) -> float:
    """Return how long after it was asked for a trim counts, on average.

    It counts from the first step that begins ``lead_s`` later or more, behind the next one.
    """
    return max(step_s, lead_s) + 0.5 * step_s


def trim_by(ppm: int) -> Trim:
    """Return the request that makes steps longer (or shorter, below 0) by this many ppm."""
    return Trim(way="sooner" if ppm < 0 else "later", ppm=abs(ppm))


@dataclass(kw_only=True)
class Holding:
    """Holds the dark row of a chain's strobe at a target. ``ask`` sends a trim to the board.

    ``lead_s`` is the board's: a trim counts no sooner than this after it was asked for.
    ``ppm`` is the trim that the board has, ``most_ppm`` the largest that it may ever have had, either way;
    ``short_rows`` by how much the dark row was off its target when it was last looked at, None while nothing is
    followed; ``note`` says why the board refused, where it did, ``ended`` that it plays no more.
    """

    chain: Chain
    target: WantedRow
    ask: Callable[[Trim], object]
    lead_s: float = 0.0
    ppm: int = 0
    most_ppm: int = 0
    short_rows: float | None = None
    note: str = ""
    ended: bool = False
    _asked_s: float = field(default=-EVERY_S)
    _unsure: bool = False

    def beat(self, host_s: float) -> None:
        """Look at the dark row, and trim the strobe where it is due; to be called several times in ``EVERY_S``."""
        if host_s - self._asked_s < EVERY_S:
            return
        self._asked_s = host_s
        with self.chain.at_rest():
            wanted = self._wanted_ppm(host_s)
            step_s = self.chain.plan.cycle_s / len(self.chain.plan.cycle_slots)
            counts_s = self.chain.camera_s(host_s) + counts_after_s(step_s, self.lead_s)
        if (wanted == self.ppm and not self._unsure) or not self._trimmed(
            wanted
        ):  # frames do not wait for the board's answer
            return
        with self.chain.at_rest():
            if self.chain.follower is not None:
                self.chain.follower.trimmed(counts_s, float(wanted))

    def _wanted_ppm(self, host_s: float) -> int:
        """Return the trim that is due now, none where the strobe is lost."""
        follower = self.chain.follower
        if follower is None or follower.state == "lost":
            self.short_rows = None
            return 0
        if follower.state != "locked":
            return self.ppm
        camera = follower.lock.camera
        seen: DarkRow = dark_row(follower, self.chain.camera_s(host_s))
        self.short_rows = seen.short_of(self.target, rows_around(camera))
        return next_trim_ppm(self.ppm, seen, self.target, camera)

    def _trimmed(self, ppm: int) -> bool:
        """Ask for a trim and return whether the board has it now; where it refuses, the one before counts on."""
        try:
            self.ask(trim_by(ppm))
        except RefusedError as refused:
            self._unsure = refused.code == Error.STATE
            if self._unsure:  # one does not count yet: the one before, or this one, whose answer was lost
                self.most_ppm = max(self.most_ppm, abs(ppm))
            else:
                self.note = str(refused)
            return False
        self._unsure = False
        self.ppm, self.most_ppm = ppm, max(self.most_ppm, abs(ppm))
        return True
