"""The RP2040 as far as lights/pico uses it: timer, DMA channels, FIFOs, and two PIO state machines, in clock cycles.

Follows the chip's data sheet: chapters 2.5 (DMA), 3 (PIO), 4.6 (timer). The state machines do here what the PIO program
does there; that it does is another test's. Data arrive in a FIFO as soon as it has room, and as early as can be: the
register behind it counts as a ninth word of it.
"""

import importlib.util
import sys
from array import array
from collections import deque
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest import mock

TIMER_HIGH, TIMER_LOW = 0x40054024, 0x40054028
PIO, PIO_FDEBUG, PIO_FIFO = 0x50200000, 0x50200008, 0x50200010
INSTRUCTIONS = (0x502000D8, 0x502000F0)
DMA, DMA_ABORT = 0x50000000, 0x50000444
READ, WRITE, COUNT, CONTROL_TRIGGER, CONTROL, READ_TRIGGER = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x3C
UNPACED = 0x3F
FIFO_WORDS = 8 + 1
MOV_PINS_NULL = 0xA003
CYCLES_PER_US = 125


class Channel:
    """A DMA channel's registers; ``left`` words are still to move."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.read = self.write = self.count = self.control = self.left = 0

    def bits(self, low: int, count: int) -> int:
        """Return a field of CTRL."""
        return self.control >> low & ((1 << count) - 1)

    def step(self) -> None:
        """Move both addresses on by a word, in their ring where there is one."""
        ring, ring_is_write = self.bits(6, 4), self.bits(10, 1)
        if self.bits(4, 1):
            self.read = _next(self.read, 0 if ring_is_write else ring)
        if self.bits(5, 1):
            self.write = _next(self.write, ring if ring_is_write else 0)


def _next(address: int, ring: int) -> int:
    mask = (1 << ring) - 1 if ring else 0xFFFFFFFF
    return address & ~mask | address + 4 & mask


class StateMachine:
    """A FIFO and four pins; takes an entry (eight states and a wait) after the other."""

    def __init__(self) -> None:
        self.fifo: deque[int] = deque()
        self.enabled = self.stalled = False
        self.at = self.pins = 0
        self.coming: deque[tuple[int, int]] = deque()


class Chip:
    """Registers (``chip[address]``), memory, time in clock cycles, and every edge that its pins made."""

    def __init__(self) -> None:
        self.cycle = 0
        self.edges: list[tuple[int, int, int]] = []
        self.machines = [StateMachine(), StateMachine()]
        self.channels = [Channel(number) for number in range(12)]
        self.claimed = 0
        self.interlock_open = False
        self.moved = [0, 0]
        self._memory: dict[int, tuple[array[int], int]] = {}
        self._other: dict[int, int] = {}
        self._next_place = 0x20010044

    # memory ----------------------------------------------------------------

    def place(self, buffer: "array[int]") -> int:
        """Return a buffer's address, as uctypes.addressof does."""
        address = self._next_place
        self._next_place += 4 * len(buffer) + 12
        for place in range(len(buffer)):
            self._memory[address + 4 * place] = (buffer, place)
        return address

    def __getitem__(self, address: int) -> int:
        if address in self._memory:
            buffer, place = self._memory[address]
            return buffer[place]
        if DMA <= address < DMA + 64 * len(self.channels):
            assert (address - DMA) % 64 == READ
            return self.channels[(address - DMA) // 64].read
        time_us = self.cycle // CYCLES_PER_US
        if address in (TIMER_HIGH, TIMER_LOW):
            return time_us >> 32 if address == TIMER_HIGH else time_us & 0xFFFFFFFF
        if address == PIO_FDEBUG:
            return sum(machine.stalled << 24 + place for place, machine in enumerate(self.machines))
        return 0 if address == DMA_ABORT else self._other.get(address, 0)

    def __setitem__(self, address: int, word: int) -> None:
        if address in self._memory:
            buffer, place = self._memory[address]
            buffer[place] = word
        elif PIO_FIFO <= address < PIO_FIFO + 8:
            fifo = self.machines[(address - PIO_FIFO) // 4].fifo
            assert len(fifo) < FIFO_WORDS
            fifo.append(word)
        elif DMA <= address < DMA + 64 * len(self.channels):
            self._set_channel(self.channels[(address - DMA) // 64], (address - DMA) % 64, word)
        elif address == DMA_ABORT:
            for channel in self.channels:
                if word >> channel.number & 1:
                    channel.left = 0
        else:
            self._set_pio(address, word)

    # PIO -------------------------------------------------------------------

    def _set_pio(self, address: int, word: int) -> None:
        if address == PIO:
            for place, machine in enumerate(self.machines):
                machine.enabled = bool(word >> place & 1)
                machine.at = self.cycle
                machine.coming.clear()
        elif address in INSTRUCTIONS:
            assert word == MOV_PINS_NULL
            self._show(INSTRUCTIONS.index(address), self.cycle, 0)
        elif address == PIO_FDEBUG:
            for place, machine in enumerate(self.machines):
                machine.stalled = machine.stalled and not word >> 24 + place & 1
        else:
            self._other[address] = word

    def empty(self, number: int) -> None:
        """Initialise a state machine."""
        self.machines[number] = StateMachine()

    def _show(self, group: int, cycle: int, pins: int) -> None:
        machine = self.machines[group]
        for line in range(4):
            if (machine.pins ^ pins) >> line & 1:
                self.edges.append((cycle, 4 * group + line, pins >> line & 1))
        machine.pins = pins

    @property
    def lit(self) -> set[int]:
        """The lines that are high."""
        return {4 * group + line for group in (0, 1) for line in range(4) if self.machines[group].pins >> line & 1}

    def advance(self, cycle: int) -> None:
        """Let time pass."""
        for group, machine in enumerate(self.machines):
            while machine.enabled and not machine.stalled and machine.at <= cycle:
                self._take_entry(group, machine)
            while machine.coming and machine.coming[0][0] <= cycle:
                self._show(group, *machine.coming.popleft())
        self.cycle = cycle

    def _take_entry(self, group: int, machine: StateMachine) -> None:
        words = [self.take_word(group), self.take_word(group)]
        if words[0] is None or words[1] is None:
            machine.stalled = True
            return
        states = words[0]
        if states not in (0, 0x1111_1111 * (states & 15)) or machine.coming or machine.pins != states & 15:
            machine.coming.extend((machine.at + tick, states >> 4 * tick & 15) for tick in range(8))
        machine.at += 8 + 1 + words[1] + 1

    def take_word(self, group: int) -> int | None:
        """Pull a word out of a FIFO, as a state machine does; None where there is none."""
        self._pump(group)
        fifo = self.machines[group].fifo
        word = fifo.popleft() if fifo else None
        self._pump(group)
        return word

    # DMA -------------------------------------------------------------------

    def _set_channel(self, channel: Channel, register: int, word: int) -> None:
        if register in (READ, READ_TRIGGER):
            channel.read = word
        elif register == WRITE:
            channel.write = word
        elif register == COUNT:
            channel.count = word
        else:
            assert register in (CONTROL, CONTROL_TRIGGER), hex(register)
            channel.control = word
        if register in (READ_TRIGGER, CONTROL_TRIGGER) and word:  # a zero triggers nothing
            self._trigger(channel)

    def _trigger(self, channel: Channel) -> None:
        if not channel.bits(0, 1):
            return
        assert channel.bits(2, 2) == 2, "words"
        assert channel.left == 0, "triggered while it is busy"
        channel.left = channel.count
        if channel.bits(15, 6) == UNPACED:
            while channel.left:
                self._move(channel)
        else:
            self._pump(channel.bits(15, 6))

    def _move(self, channel: Channel) -> None:
        read, write = channel.read, channel.write
        channel.step()
        channel.left -= 1
        self[write] = self[read]
        if not channel.left and channel.bits(11, 4) != channel.number:
            self._trigger(self.channels[channel.bits(11, 4)])

    def _pump(self, group: int) -> None:
        fifo = self.machines[group].fifo
        for channel in self.channels:
            while channel.left and channel.bits(15, 6) == group and len(fifo) < FIFO_WORDS:
                self.moved[group] += 1
                self._move(channel)


def modules(chip: Chip) -> dict[str, Any]:
    """Return what MicroPython's modules are for this chip."""

    class Pin:
        OUT, IN, PULL_UP = 1, 0, 2

        def __init__(self, number: int, mode: int | None = None, pull: int | None = None, value: int = 0) -> None:
            self.number = number
            assert value == 0
            assert number != 10 or (mode, pull) == (Pin.IN, Pin.PULL_UP)

        def value(self) -> int:
            assert self.number == 10
            return int(chip.interlock_open)

    class Machine:
        def __init__(self, number: int) -> None:
            self.number = number

        def init(self, program: Any, *, freq: int, out_base: Pin) -> None:
            assert (freq, out_base.number) == (125_000_000, 2 + 4 * self.number)
            assert program["pull_thresh"] == 32
            chip.empty(self.number)

    class Dma:
        def __init__(self) -> None:
            self.channel = chip.claimed + 1  # not from 0
            chip.claimed += 1

    pio = SimpleNamespace(OUT_LOW=2, SHIFT_RIGHT=1, JOIN_TX=1)
    rp2 = SimpleNamespace(asm_pio=lambda **words: lambda _: words, PIO=pio, StateMachine=Machine, DMA=Dma)
    machine = SimpleNamespace(
        freq=lambda hz: None, mem32=chip, Pin=Pin, disable_irq=lambda: 0, enable_irq=lambda _: None
    )
    time = SimpleNamespace(sleep_us=lambda us: None)
    return {"machine": machine, "rp2": rp2, "uctypes": SimpleNamespace(addressof=chip.place), "time": time}


BOARD_MODULES = ("machine", "micropython", "rp2", "uctypes")


def load_program(main: Path) -> ModuleType:
    """Import main.py as a Python without a board can: with stand-ins for a board's modules."""
    spec = importlib.util.spec_from_file_location("pico_main", main)
    assert spec is not None
    assert spec.loader is not None
    program = importlib.util.module_from_spec(spec)
    with mock.patch.dict(sys.modules, {name: ModuleType(name) for name in BOARD_MODULES}):
        spec.loader.exec_module(program)
    return program


def board_of(program: ModuleType, chip: Chip) -> Any:
    """Return the program's board with this chip under it."""
    for name, module in modules(chip).items():
        setattr(program, name, module)
    return program.Pico()
