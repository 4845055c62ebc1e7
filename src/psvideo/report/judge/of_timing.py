"""Judgements on the flashes: how certain their times are, which light is which, and whether their light adds up."""

from collections.abc import Iterator

from psvideo.model.half_flash import HalfFlash
from psvideo.model.marker import HIDDEN_MARKER
from psvideo.model.timing import Timing
from psvideo.report.judgement import Judgement

SURE_ROWS, LOST_ROWS = 0.3, 2.0
"""Standard errors of the flashes' times beyond which a take is doubtful, and bad."""

CHECK_PLAN = (
    "Check that plan.toml is what the strobe played, and its transfer how the files code light: a wrong curve looks "
    "like another exposure. Fix the exposure, and switch stabilisation off."
)
GAIN_FIRST = "Fix the camera's exposure and gain first (see the line on gain): that frames change costs most of this."
MARK_IT = "Shoot with a dark slot as marker, or name the first light with `first_light`."
DARK_HIDDEN = f"{HIDDEN_MARKER} Or name the first light with `first_light`."


def timing_and_order(timing: Timing, mode: str) -> Iterator[Judgement]:
    """Judge how certain the flashes' times and names are."""
    rows = timing.phase_error_rows
    if mode == "synced":
        yield Judgement(
            subject="timing", grade="good", found="One flash a frame, as the plan says: no time had to be found."
        )
    elif rows <= SURE_ROWS:
        yield Judgement(
            subject="timing",
            grade="good",
            found=f"Phase locked. {timing.how_sure} The clocks differ by {timing.clock_offset_ppm:+.1f} ppm.",
        )
    else:
        yield Judgement(
            subject="timing",
            grade="bad" if rows > LOST_ROWS else "doubtful",
            found=f"Flash times are known to {rows:.2f} row only: plates may be torn near the dark row."
            if timing.row_time_s
            else f"{timing.how_sure} Frames that hold two flashes may be taken for one.",
            advice=GAIN_FIRST if timing.swing is not None and timing.swing.cause == "camera" else CHECK_PLAN,
        )
    if timing.order == "guess":
        yield Judgement(
            subject="order",
            grade="doubtful",
            found="Which light is which is a guess, so normals may be wrong everywhere."
            + (f" {timing.order_note}" if timing.order_note else ""),
            advice=DARK_HIDDEN if any(flash.is_dark for flash in timing.flashes) else MARK_IT,
        )
    else:
        yield Judgement(subject="order", grade="good", found=ORDER[timing.order])


def read_otherwise(half: HalfFlash) -> Judgement:
    """Judge that light was read by another curve than it was coded with: halves of flashes do not look half as bright,
    and every normal is made of parts of its light."""
    return Judgement(subject="curve", grade="bad", found=half.found, advice=half.advice)


ORDER = {
    "marker": "Which light is which is known from the cycle's marker.",
    "rig": "Which light is which is known from the rig's directions.",
    "given": "Which light is which was given.",
}
