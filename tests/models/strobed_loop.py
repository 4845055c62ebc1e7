"""The whole loop in virtual time: a board that flashes, a camera that films it, and what follows and trims it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from memory_frame import MemoryFrame

from psvideo.live.chain import Chain
from psvideo.live.following.genlock import DarkRow, dark_row
from psvideo.live.following.holding import Holding
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.model.plan import Plan
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.boards import Board as KnownBoard
from psvideo.strobe.link.exchange import RefusedError
from psvideo.strobe.link.protocol import format_request, parse_reply
from psvideo.strobe.link.replies import Refusal
from psvideo.strobe.link.requests import Request, Run, Stat
from psvideo.strobe.program import make_program
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.python_board import PythonBoard
from psvideo.synth.camera.sensor import expose_frames
from psvideo.synth.lamps.true_flashes import TrueFlash

WITHOUT_EDGES_S = 0.002
ALIVE_S = 0.1
"""The host asks the board how it goes so often, as a session does, so that the board knows that there is one."""


class Board(Protocol):
    """What is asked, and flashes: the board in plain Python, or the firmware in emulation."""

    board: KnownBoard

    def feed(self, data: bytes, now: int) -> bytes:
        """Return the answer to a line that comes at a tick."""

    def advance(self, now: int) -> None:
        """Let time pass until a tick."""

    def take_edges(self) -> list[Edge]:
        """Return the edges since this was last called."""


@dataclass(kw_only=True)
class StrobedLoop:
    """A board whose clock is off by ``offset_ppm(camera time)`` against the camera's, and jitters.

    ``starts_s`` are the middles of the latest flashes in camera time; ``board`` left out is the one in plain Python.
    """

    plan: Plan
    offset_ppm: Callable[[float], float]
    jitter_s: float = 0.0
    seed: int = 0
    board: Board = field(default_factory=lambda: PythonBoard(BOARDS["atmega328p"]))
    starts_s: list[float] = field(default_factory=list)
    board_s: float = 0.0
    camera_s: float = 0.0

    def __post_init__(self) -> None:
        self.program = make_program(self.plan, capabilities(self.board.board, self.board.board.first_wiring))
        self.rng = np.random.default_rng(self.seed)
        for request in (*self.program.upload(), Run(cycles=0)):
            self.ask(request)
        self.chain = Chain(plan=self.plan)
        shape = (self.plan.camera.height_px, self.plan.camera.width_px)
        self.plates = {slot: (0.05 + 0.3 * self.rng.random(shape)).astype(np.float32) for slot in self.plan.lit_slots}
        self.images = expose_frames(
            self.plan, self._flashes(), lambda flash: self.plates.get(flash.slot), frames=range(10**9)
        )
        self.frames = 0
        self.blind = False

    @property
    def host_s(self) -> float:
        """The time on the host's clock, which is the camera's here: the end of the newest frame."""
        camera = self.plan.camera
        return (self.frames - 1) * camera.frame_period_s + camera.exposure_s + abs(camera.readout_s or 0.0)

    def ask(self, request: Request) -> object:
        """Send a request to the board now."""
        line = self.board.feed(format_request(request), self._ticks()).decode().strip()
        reply, _ = parse_reply(line, request.reply)
        if isinstance(reply, Refusal):
            raise RefusedError(reply.text, code=reply.code)
        return reply

    def film(self, seconds: float, holding: Holding | None = None) -> Iterator[float]:
        """Film on; yields the time after every frame."""
        until_s = self.host_s + seconds
        while self.host_s < until_s:
            image = next(self.images)
            lit = image * np.float32(not self.blind)
            noisy = lit + self.rng.normal(0, 2e-3, image.shape).astype(np.float32)
            self.frames += 1
            coded = MemoryFrame(self.frames - 1, noisy).coded
            self.chain.take(LiveFrame(index=self.frames - 1, coded=coded, came_s=self.host_s))
            if holding is not None:
                holding.beat(self.host_s)
            yield self.host_s

    def true_row(self) -> DarkRow:
        """Return where the dark row really is, by the newest flash."""
        camera = self.plan.camera
        phase = (self.starts_s[-1] + 0.5 * (camera.frame_period_s - camera.exposure_s)) / camera.frame_period_s % 1.0
        return DarkRow(row=phase * camera.frame_period_s / camera.row_time_s, slip_ppm=0.0)

    def followed_row(self) -> DarkRow:
        """Return where the follower has the dark row."""
        assert self.chain.follower is not None
        return dark_row(self.chain.follower, self.host_s)

    def _ticks(self) -> int:
        return round(self.board_s / (self.board.board.tick_ps * 1e-12))

    def _flashes(self) -> Iterator[TrueFlash]:
        """Let the board's time pass, a little at a time, and yield its flashes in camera time."""
        tick_s, held, index, heard_s = self.board.board.tick_ps * 1e-12, {}, 0, 0.0
        slot_of = {self.program.lines[self.plan.flashes[slot].lit[0]]: slot for slot in self.plan.lit_slots}
        while True:
            self.board_s += WITHOUT_EDGES_S
            before_s, self.camera_s = (
                self.camera_s,
                self.camera_s + WITHOUT_EDGES_S * (1 + 1e-6 * self.offset_ppm(self.camera_s)),
            )
            if self.board_s - heard_s >= ALIVE_S:
                heard_s = self.board_s
                self.ask(Stat())
            self.board.advance(self._ticks())
            for edge in self.board.take_edges():
                share = (edge.tick * tick_s - (self.board_s - WITHOUT_EDGES_S)) / WITHOUT_EDGES_S
                at_s = before_s + share * (self.camera_s - before_s)
                if edge.level:
                    held[edge.line] = at_s + self.jitter_s * float(self.rng.standard_normal())
                    continue
                start_s, slot = held.pop(edge.line), slot_of[edge.line]
                duration_s = self.plan.flashes[slot].duration_s
                self.starts_s = [*self.starts_s[-3:], start_s + 0.5 * duration_s]
                yield TrueFlash(
                    index=index,
                    slot=slot,
                    lights=self.plan.flashes[slot].lights,
                    start_s=start_s,
                    duration_s=duration_s,
                    complete=True,
                )
                index += 1
