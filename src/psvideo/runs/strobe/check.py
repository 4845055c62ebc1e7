"""The whole of ``psvideo strobe check``: whether a plan can be played, and how."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.plan_toml import read_plan
from psvideo.model.plan import Plan
from psvideo.runs.strobe.port import opened_port
from psvideo.strobe.link.boards import BOARDS, Board, board_called, capabilities
from psvideo.strobe.link.exchange import Link
from psvideo.strobe.link.replies import Capabilities
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import Program, make_program
from psvideo.strobe.program_words import program_cautions
from psvideo.strobe.seizures import seizure_warning
from psvideo.strobe.session import prepare
from psvideo.strobe.wiring import refuse_unknown_lights


@dataclass(frozen=True, kw_only=True)
class PlanCheck:
    """A plan as a board plays it, what the board can do, and whole sentences on what to beware of."""

    program: Program
    caps: Capabilities
    warnings: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class BoardCheck:
    """Whether a board of the table plays a plan: its ``program`` there, or None and ``why`` not."""

    board: str
    caps: Capabilities
    program: Program | None
    why: str = ""


def check(
    plan: Path | str,
    *,
    port: str = "",
    board: str | None = None,
    line: Mapping[str, int] | None = None,
    wiring: WiringName | None = None,
) -> PlanCheck:
    """Return a plan as the board at ``port`` plays it, or the ``board`` of the table where no port is named.

    ``line`` wires lights to lines by name; ``wiring`` is left out for the board's own. Nothing flashes. Raises
    PsvideoError where the board cannot play the plan, with every number that is over a limit.
    """
    path = Path(plan)
    planned, known = read_plan(path), board_called(board)
    caps = _caps_at(port, known, wiring) if port else _caps_of(known, wiring)
    program = make_program(planned, caps, lines=line, source=str(path))
    seizures = seizure_warning(program.played)
    warnings = (*program_cautions(planned, program, caps), *([seizures] if seizures else []))
    return PlanCheck(program=program, caps=caps, warnings=warnings)


def check_boards(
    plan: Path | str, *, line: Mapping[str, int] | None = None, wiring: WiringName | None = None
) -> tuple[BoardCheck, ...]:
    """Check a plan against every board of the table and each of its wirings, or the one ``wiring`` alone.

    Raises UsageError where ``line`` names a light that the plan has not.
    """
    path = Path(plan)
    planned = read_plan(path)
    refuse_unknown_lights(planned, line or {})
    return tuple(
        _check_board(planned, path, board, capabilities(board, name), line)
        for board in BOARDS.values()
        for name in board.lines
        if wiring in (None, name)
    )


def _check_board(
    plan: Plan, path: Path, board: Board, caps: Capabilities, line: Mapping[str, int] | None
) -> BoardCheck:
    try:
        program = make_program(plan, caps, lines=line, source=str(path))
    except PsvideoError as fault:
        return BoardCheck(board=board.name, caps=caps, program=None, why=str(fault))
    return BoardCheck(board=board.name, caps=caps, program=program)


def _caps_at(port: str, board: Board | None, wiring: WiringName | None) -> Capabilities:
    with opened_port(port, board=board) as opened:
        return prepare(Link(opened), wiring=wiring).caps


def _caps_of(board: Board | None, wiring: WiringName | None) -> Capabilities:
    if board is None:
        raise UsageError(f"Name the `port` of a board, or a `board` of the table: {', '.join(BOARDS)}.")
    if wiring is not None and wiring not in board.lines:
        raise UsageError(f"`wiring` {wiring}: the {board.name} has {' and '.join(board.lines)} wiring only.")
    return capabilities(board, wiring or board.first_wiring)
