"""The strobe played and held to the camera while the live view runs: what ``lock`` does."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.plan_toml import read_plan
from psvideo.live.chain import Chain
from psvideo.live.following.genlock import EVERY_S, check_holds, target_of
from psvideo.live.following.holding import Holding
from psvideo.runs.steps.caller import Caller
from psvideo.runs.strobe.port import opened_port
from psvideo.runs.strobe.run import warn_of_flashing
from psvideo.strobe.link.boards import BOARDS, FIRMWARE_WITHOUT_TRIMS
from psvideo.strobe.link.exchange import Link
from psvideo.strobe.link.ports import EMULATED
from psvideo.strobe.link.replies import Trimmed
from psvideo.strobe.program import Program, make_program
from psvideo.strobe.runlog import RunLog, run_log
from psvideo.strobe.session import Outcome, prepare, run_program


@dataclass(frozen=True, kw_only=True)
class AskedLock:
    """``where`` the dark row is to stand ("edge", a row, or rows to keep free), by the board at a ``port``. ``warned``:
    everybody in the room has been warned of the flashing."""

    where: str
    port: str
    warned: bool


@contextmanager
def held_strobe(
    chain: Chain,
    plan_path: Path | None,
    lock: AskedLock,
    *,
    noted: Callable[[str], None],
    caller: Caller,
    logged: Callable[[RunLog], None] = lambda log: None,
) -> Iterator[Holding]:
    """Play the plan on a board while the block runs, its dark row held where ``lock`` says.

    In every case the lights are dark afterwards, and ``logged`` gets the log of what was played. A board that is lost
    in the middle is a sentence for ``noted``, and the block goes on. Raises UsageError where the plan's dark row cannot
    be held or nobody confirmed that people are warned, PsvideoError where the board cannot play the plan or does not
    answer.
    """
    if plan_path is None:
        raise UsageError("`lock` plays the plan on the board, and this source has no plan.toml beside it: name `plan`.")
    plan = read_plan(plan_path)
    check_holds(plan)
    target = target_of(plan.camera, lock.where)
    if lock.port != EMULATED:
        warn_of_flashing(plan, plan_path, warned=lock.warned, confirm=None, caller=caller)
    with opened_port(lock.port) as opened:
        link = Link(opened)
        ready = prepare(link)
        _check_trims(ready.identity.firmware, opened.name)
        program = make_program(plan, ready.caps, source=str(plan_path))
        lead_s = 1e-3 * BOARDS[ready.identity.board].trim_lead_ms if ready.identity.board in BOARDS else 0.0
        holding = Holding(chain=chain, target=target, ask=lambda trim: link.ask(trim, Trimmed), lead_s=lead_s)
        over = threading.Event()

        def ended(outcome: Outcome) -> None:
            logged(run_log(plan_path, ready, program, outcome, most_trim_ppm=holding.most_ppm))

        player = threading.Thread(target=_play, args=(link, program, holding, over, noted, ended), daemon=True)
        player.start()
        try:
            yield holding
        finally:
            over.set()
            player.join()


def _check_trims(firmware: str, port: str) -> None:
    """Raise UsageError where a board's program takes no trims, before it flashes."""
    if firmware in FIRMWARE_WITHOUT_TRIMS:
        raise UsageError(
            f"{port}: `lock` trims the strobe's period while it runs, and the board's program, {firmware}, takes no "
            "trims yet. Copy the newer lights/pico/main.py onto the Pico (lights/pico/README.md), or leave `lock` out "
            "and play the plan by psvideo strobe run."
        )


def _play(
    link: Link,
    program: Program,
    holding: Holding,
    over: threading.Event,
    noted: Callable[[str], None],
    ended: Callable[[Outcome], None],
) -> None:
    """Play until it is over, and trim on the way; what runs in a thread."""
    try:
        outcome: Outcome = run_program(
            link,
            program,
            cycles=None,
            seconds=None,
            watch=lambda progress: holding.beat(time.monotonic()),
            every_s=EVERY_S / 3,
            stopped=over.is_set,
        )
        ended(outcome)
        if outcome.message is not None:
            noted(outcome.message)
    except PsvideoError as fault:
        noted(str(fault))
    finally:
        holding.ended = True  # whatever ended it: nobody is there to be trimmed
