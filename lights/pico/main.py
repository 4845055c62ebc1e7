"""Strobe controller for a Raspberry Pi Pico (RP2040) in MicroPython: copy this file onto the board.

Made by make_main.py from the files in parts/: change those. README.md beside this file says how it works.
"""

import machine
import micropython
import rp2
import select
import struct
import sys
import time
import uctypes
from array import array


# link -----------------------------------------------------------------------------------------------------------------
# What lights/protocol.toml says of the link and of this board; times in ticks of 8 ns.


ERRORS = {
    "bytes": 1,
    "long": 2,
    "crc": 3,
    "command": 4,
    "words": 5,
    "number": 6,
    "range": 7,
    "state": 8,
    "limit": 9,
    "incomplete": 10,
    "check": 11,
    "fault": 12,
    "interlock": 13,
    "powers": 14,
}
EVERY = ("idle", "armed", "running", "fault")
ANY = 99
COMMANDS = {  # fewest and most words, states, the reply's keys
    "ID": (0, 0, EVERY, "proto board firmware unit"),
    "CAPS": (
        0,
        0,
        EVERY,
        "tick_ps wiring lines powers slots steps min_on min_off min_dark max_flash max_period max_line_ppm "
        "max_total_ppm tolerance_ppm keep_ms",
    ),
    "WIRING": (1, 1, ("idle",), "wiring"),
    "KEEP": (1, 1, ("idle", "armed", "running"), "keep_ms"),
    "NEW": (0, 0, ("idle", "armed"), ""),
    "SLOT": (4, ANY, ("idle",), "slot"),
    "STEPS": (2, ANY, ("idle",), "steps"),
    "ARM": (1, 1, ("idle",), "check cycle"),
    "RUN": (1, 1, ("armed",), "start"),
    "TRIM": (2, 2, ("running",), "way ppm"),
    "STOP": (0, 0, EVERY, "state cycles"),
    "STAT": (0, 0, EVERY, "state fault reset interlock cycle step cycles"),
    "CLK": (1, 1, EVERY, "nonce cycle ticks"),
    "CLEAR": (0, 0, ("idle", "fault"), "state"),
}
LONGEST_REQUEST = 96
LONGEST_NONCE = 8
LARGEST_NUMBER = 4294967295
LONGEST_DARK = 2147483647
KEEP_MS = (100, 2000)
TICKS_PER_US = 125
TICKS_PER_MS = 1000 * TICKS_PER_US
LINES, SLOTS, STEPS = 8, 32, 240
MIN_ON = MIN_OFF = TICKS_PER_US
MIN_DARK = 100 * TICKS_PER_US
MAX_FLASH = 50 * TICKS_PER_MS
MAX_LINE_PPM, MAX_TOTAL_PPM = 500000, 2000000
MAX_CYCLE = 60000 * TICKS_PER_MS
MAX_TRIM_PPM = 20000
START_DELAY = 10 * TICKS_PER_MS


class RefusedError(Exception):
    """Why a line is refused: a name of ERRORS, and words for people."""

    def __init__(self, error, text):
        super().__init__(text)
        self.error = error
        self.text = text


# lines ----------------------------------------------------------------------------------------------------------------
# Bytes into lines, checksums, words.


def _crc_of_byte(byte):
    crc = byte << 8
    for _ in range(8):
        crc = crc << 1 ^ (0x1021 if crc & 0x8000 else 0)
    return crc & 0xFFFF


CRC_TABLE = array("H", [_crc_of_byte(byte) for byte in range(256)])


def crc16(data, crc=0xFFFF):
    """CRC-16/CCITT-FALSE, going on from ``crc``."""
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ CRC_TABLE[crc >> 8 ^ byte]
    return crc


def seal(text):
    return f"{text}*{crc16(text.encode()):04X}"


def unseal(text):
    """The line without its checksum, which must be right where there is a ``*``."""
    if "*" in text and ("*" in text[:-5] or text != seal(text[:-5])):
        raise RefusedError("crc", "checksum")
    return text[:-5] if "*" in text else text


def number(word):
    if not word.isdigit() or int(word) > LARGEST_NUMBER:
        raise RefusedError("number", f"number {word[:20]}")
    return int(word)


def lit_word(word):
    line, _, on = word.partition(":")
    return number(line), number(on)


class LineReader:
    """Bytes into lines, one byte at a time; never holds more than a line that is just too long."""

    def __init__(self):
        self._forget()

    def _forget(self):
        self.held = bytearray()
        self.bad = self.long = False

    def take(self, byte):
        """Take a byte. Returns None, or where a line ends (error or None, text)."""
        if byte == 10:
            return self._end()
        self.bad = self.bad or not (32 <= byte <= 126 or byte == 13)
        if len(self.held) > LONGEST_REQUEST:
            self.long = True
        else:
            self.held.append(byte)
        return None

    def _end(self):
        held, bad, long = bytes(self.held), self.bad, self.long
        self._forget()
        if held.endswith(b"\r"):
            held = held[:-1]
        if bad or b"\r" in held:
            return "bytes", ""
        if long or len(held) > LONGEST_REQUEST:
            return "long", ""
        return (None, held.decode()) if held else None


# flashes --------------------------------------------------------------------------------------------------------------
# What may be played. A slot is (duration, dark, period, [(line, on), ...]), as lights/protocol.md says.


def check_slot(duration, dark, period, lit):
    """Refuse what the board does not play, in the order of lights/protocol.md."""
    if duration > MAX_FLASH:
        raise RefusedError("limit", f"duration {duration} > max_flash {MAX_FLASH}")
    if duration == 0:
        raise RefusedError("range", "duration 0")
    if dark < MIN_DARK:
        raise RefusedError("limit", f"dark {dark} < min_dark {MIN_DARK}")
    if dark > LONGEST_DARK:
        raise RefusedError("range", f"dark {dark} > {LONGEST_DARK}")
    if not 0 < period <= duration:
        raise RefusedError("range", f"period {period}, duration {duration}")
    _check_lit(period, lit)
    rest = duration % period
    for _, on in lit:
        shortest = min(on, rest) if rest else on
        if shortest < MIN_ON:
            raise RefusedError("limit", f"on {shortest} < min_on {MIN_ON}")
        if 0 < period - on < MIN_OFF:
            raise RefusedError("limit", f"off {period - on} < min_off {MIN_OFF}")


def _check_lit(period, lit):
    seen = []
    for line, on in lit:
        if not 0 < on <= period:
            raise RefusedError("range", f"on {on}, period {period}")
        if line in seen or line >= LINES:
            raise RefusedError("range", f"line {line} twice, or this board has not")
        seen.append(line)


def lit_ticks(slot):
    """For how many ticks of one flash each line is on."""
    duration, _, period, lit = slot
    ticks = [0] * LINES
    for line, on in lit:
        ticks[line] = duration // period * on + min(on, duration % period)
    return ticks


def check_cycle(slots):
    """Refuse a cycle that is lit too much or lasts too long; returns its length, and for how long lines are on."""
    cycle = sum([slot[0] + slot[1] for slot in slots])
    each = [lit_ticks(slot) for slot in slots]
    lit = [sum([ticks[line] for ticks in each]) for line in range(LINES)]
    _check_shares(cycle, lit)
    return cycle, lit


def _check_shares(cycle, lit):
    for line, ticks in enumerate(lit):
        if ticks * 1000000 // cycle > MAX_LINE_PPM:
            raise RefusedError("limit", f"line {line} {ticks * 1000000 // cycle} ppm > max_line_ppm {MAX_LINE_PPM}")
    if sum(lit) * 1000000 // cycle > MAX_TOTAL_PPM:
        raise RefusedError("limit", f"total {sum(lit) * 1000000 // cycle} ppm > max_total_ppm {MAX_TOTAL_PPM}")
    if cycle > MAX_CYCLE:
        raise RefusedError("limit", f"cycle {cycle} > {MAX_CYCLE}")


def check_trim(ppm, cycle, lit, steps, shortest_dark):
    """Refuse to have a cycle's steps last longer by so many ppm, or shorter below 0; ``lit`` is check_cycle's."""
    if shortest_dark + cycle * ppm // (1000000 * steps) < 2 * MIN_DARK:
        raise RefusedError("limit", f"dark < 2 min_dark {2 * MIN_DARK}")
    ticks = cycle * abs(ppm) // 1000000 + 1
    _check_shares(cycle - ticks if ppm < 0 else cycle + ticks, lit)


def check_of(slots):
    """The checksum by which host and board know that they mean the same cycle."""
    crc = 0xFFFF
    for duration, dark, period, lit in slots:
        on = [0] * LINES
        for line, ticks in lit:
            on[line] = ticks
        crc = crc16(struct.pack("<11I", duration, dark, period, *on), crc)
    return crc


# table ----------------------------------------------------------------------------------------------------------------
# What PIO and DMA play: a cycle as entries in memory, and the control blocks by which the DMA walks through them.
#
# Two state machines run in step, four lines each. An entry is two words: eight states of four lines, a tick each, and
# how much longer the last one lasts. So it lasts ten ticks or more (eight states, the delay's fetch, a pass of its loop),
# but edges of different lines may be a single tick apart: entries are laid such that every edge falls into the eight.


GROUPS, GROUP_LINES = 2, 4  # two state machines in step, four lines each
STATES = 8  # an entry is a word of eight states, a tick each, and a word that says how much longer the last one lasts
SHORTEST = 10  # ticks of an entry: eight states, the delay's fetch, one pass of its loop
STEADY = 0x11111111  # times a state: that state eight times
SPARE_DARK = 20 * SHORTEST  # ticks of a dark time that stay on either side of where it is parted
TAIL_ENTRIES = 5  # or more: a FIFO and the register behind it hold nine words, so no tail is read ahead as a whole
TABLE_WORDS = 4000  # the longest table: 32 slots of bursts and 240 steps
TURNS = 1024  # whole cycles that the DMA counts by itself


def window_starts(ticks):
    """When entries start so that every one of at most four (rising) ticks lies in the eight states of one.

    Ticks that are near each other share a row of entries back to back. In its ten ticks an entry cannot switch in two,
    so each tick rules out two of the row's phases, and at most six of eight are ruled out.
    """
    starts = []
    while ticks:
        near = [ticks[0]]
        for tick in ticks[1:]:
            if tick - near[-1] > 2 * SHORTEST:
                break
            near.append(tick)
        ticks = ticks[len(near) :]
        fits = [lead for lead in range(STATES) if max([(tick - near[0] + lead) % SHORTEST for tick in near]) < STATES]
        first = near[0] - fits[0]
        for tick in near:
            start = tick - (tick - first) % SHORTEST
            if start not in starts:
                starts.append(start)
    return starts


def entries(on, length):
    """``length`` ticks in which each (bit, ticks) of ``on`` is high from the start, as [(states, wait), ...]."""
    starts = [0] + window_starts(sorted({ticks for _, ticks in on if ticks < length}))
    made = []
    for place, start in enumerate(starts):
        end = starts[place + 1] if place + 1 < len(starts) else length
        word = 0
        for tick in range(STATES):
            state = sum([bit for bit, ticks in on if start + tick < ticks])
            word |= state << GROUP_LINES * tick
        made.append((word, end - start - SHORTEST))
    return made


def padded(made):
    """The same with a power of two of entries, by parting the last wait."""
    made = list(made)
    while len(made) & (len(made) - 1):
        word, wait = made.pop()
        first = (wait + SHORTEST) // 2
        made.append((word, first - SHORTEST))
        made.append(((word >> 28) * STEADY, wait - first))
    return made


def long_enough(made):
    """The same with TAIL_ENTRIES or more, by parting the last wait, in which it is dark."""
    word, wait = made[-1]
    more = max(TAIL_ENTRIES - len(made), 0)
    return made[:-1] + [(word, wait - SHORTEST * more)] + [(0, 0)] * more


def parts(slot, group, ending):
    """What a group of lines does in a flash: how many bursts, one burst, and its tail.

    That is the last burst with the dark time, but for its last ticks (``ending``).
    """
    duration, dark, period, lit = slot
    on = [(1 << line % GROUP_LINES, ticks) for line, ticks in lit if line // GROUP_LINES == group]
    if not [ticks for _, ticks in on if ticks < period]:
        on = [(bit, duration) for bit, _ in on]
        period = duration
    bursts = (duration - 1) // period
    last = duration - bursts * period
    burst = padded(entries(on, period)) if bursts else []
    tail = entries([(bit, min(ticks, last)) for bit, ticks in on], last + dark - ending)
    return bursts, burst, long_enough(tail)


def control_word(treq, chain_to, inc_write=0, ring_bits=0, ring_write=0):
    """A DMA channel's CTRL: enabled, high priority, words, the read address rising, quiet."""
    rings = ring_bits << 6 | ring_write << 10
    return 1 << 21 | treq << 15 | chain_to << 11 | rings | inc_write << 5 | 1 << 4 | 2 << 2 | 2 | 1


class Table:
    """One group's cycle in memory: entries, and the control blocks by which the DMA walks through them for ever.

    ``turns`` are what the DMA reads behind every cycle: the address of the next one's blocks, or 0 to stop. The table's
    first entry is the dark time's ending of every step: the DMA puts its wait there, a step's word of the ring (pace).
    """

    def __init__(self, group, link):
        """``link`` has fifo, treq (of the state machine), control, turn, pace (channels), memory, turns (aligned)."""
        self.group = group
        self.link = link
        self.used = 0
        self.cycle_address = self.lead_address = 0

    def _put(self, *words):
        words_of, first, address = self.link.memory
        place = address + 4 * self.used
        for word in words:
            words_of[first + self.used] = word
            self.used += 1
        return place

    def _put_entries(self, made, align_words=1):
        while self.used % align_words:
            self.used += 1
        return self._put(*[word for entry in made for word in entry]), 2 * len(made)

    def _put_block(self, address, count, chain_to, ring_bits=0):
        return self._put(address, self.link.fifo, count, control_word(self.link.treq, chain_to, 0, ring_bits))

    def lay_out(self, slots, steps, ending):
        """Write the cycle; slots' entries are there once, however often the steps name them.

        ``ending`` is how many ticks of every dark time are not the tail's.
        """
        self.used = 0
        dark, _ = self._put_entries([(0, 0)])
        lead = self._put_entries([(0, START_DELAY - SHORTEST)])
        placed = {}
        for step in steps:
            if step not in placed:
                bursts, burst, tail = parts(slots[step], self.group, ending)
                ring = self._put_entries(burst, 2 * len(burst)) if bursts else (0, 0)
                placed[step] = (bursts, ring, self._put_entries(tail))
        self.lead_address = self._put_block(lead[0], lead[1], self.link.control)
        self.cycle_address = self.lead_address + 16
        for place, step in enumerate(steps):
            bursts, ring, tail = placed[step]
            if bursts:
                bits = [1 << bit for bit in range(8)].index(4 * ring[1])
                self._put_block(ring[0], bursts * ring[1], self.link.control, bits)
            self._put_block(tail[0], tail[1], self.link.pace)
            self._put_block(dark, 2, self.link.turn if place + 1 == len(steps) else self.link.control)

    def wind(self, cycles):
        """Have it play for ever, or that many cycles if they are not more than TURNS."""
        words, first, _ = self.link.turns
        for turn in range(TURNS):
            words[first + turn] = self.cycle_address
        if 0 < cycles <= TURNS:
            self.end_after(cycles)

    def end_after(self, cycles):
        """Have it stop behind the cycle of that number, which must be one of the next TURNS."""
        words, first, _ = self.link.turns
        words[first + (cycles - 1) % TURNS] = 0


# pace -----------------------------------------------------------------------------------------------------------------
# How long the steps of a run last: a word for each of them in a ring of memory that the DMA reads, one in every step.
#
# Both groups read the same ring, so they stay in step whatever stands there, as long as no word changes between the two
# readings of one step. Therefore words are written at least a step ahead, and looked after once they are written.


RING = TURNS  # steps that have a word of their own; trimmed steps last 0.2 ms or more, so these last 200 ms or more
AHEAD = RING - 8  # words that are written ahead of the step that is played
CHUNK = 128  # words that are written at once: more than the steps of LEAD, and as many as last 25 ms or more
LEAD = 20 * TICKS_PER_MS  # a trim counts this much after it was asked for, so that memory may be collected before


class Pace:
    """Where a run is, and how long its steps last: as uploaded, or longer or shorter by a trim, in whole ticks.

    ``step`` is the step that is played, counted from the run's start, and ``at`` the tick in which it begins. A tick is
    cut into ``parts``, of which a trim adds the same number to every step; what is no whole tick is carried on.
    """

    def __init__(self, memory):
        """``memory`` is the ring: words, the place of the first, and its address."""
        self.words, self.first, _ = memory
        self.lengths = [0]

    def lay_out(self, lengths, shortest_dark):
        """Take a cycle's steps. Returns how many ticks at each dark time's end the ring's words stand for."""
        self.lengths = lengths
        self.cycle = sum(lengths)
        self.parts = 1000000 * len(lengths)
        most_shorter = self.cycle * MAX_TRIM_PPM // self.parts + 1
        self.ending = min(most_shorter + SPARE_DARK, shortest_dark - SPARE_DARK)
        return self.ending

    def wind(self, cycles):
        """Be ahead of a run of that many cycles (0: without end), all as uploaded."""
        for place in range(RING):
            self.words[self.first + place] = self.ending - SHORTEST
        self.last = cycles * len(self.lengths) or None
        self.step = self.carried = self.since = 0
        self.share = (0, 0)
        self.written = None  # steps that have their words; None: all, as they are as uploaded

    def begin(self, tick):
        """The run's first flash starts in that tick."""
        self.at = tick

    def is_over(self):
        return self.step == self.last

    def position(self):
        """The cycle and the step in it."""
        return divmod(self.step, len(self.lengths))

    def advance(self, now):
        """Go on to the step that is played now, or to the run's end."""
        self.step, self.at = self.walk(now)

    def walk(self, now):
        """The step that is played now and the tick in which it began, as far as steps have their words."""
        step, at = self.step, self.at
        if self.written is None and now - at >= self.cycle:
            cycles = (now - at) // self.cycle
            if self.last is not None:
                cycles = min(cycles, (self.last - step) // len(self.lengths))
            step += cycles * len(self.lengths)
            at += cycles * self.cycle
        while step not in (self.last, self.written):
            end = at + self._length(step)
            if end > now:
                break
            step, at = step + 1, end
        return step, at

    def _length(self, step):
        word = self.words[self.first + step % RING]
        return self.lengths[step % len(self.lengths)] + word + SHORTEST - self.ending

    def counts_from(self, now):
        """From which step on a trim counts that is asked for now: behind the next one, and LEAD later or more."""
        step, at = self.step, self.at
        while step < self.step + 2 or at < now + LEAD:
            at += self._length(step)
            step += 1
        return step

    def trim(self, ppm, since):
        """Have the steps from ``since`` on last by so many ppm of a mean step longer, or shorter below 0.

        Their words are to be written again. ``share`` is what each of them is longer by: whole ticks, and parts of one.
        """
        if self.written is not None:
            self._forget_words(since)
        self.share = divmod(self.cycle * ppm, self.parts)
        self.since = self.written = since

    def _forget_words(self, since):
        """Take back what the words from ``since`` on carried: the parts of a tick that were over before that step."""
        _, rest = self.share
        self.carried = (self.carried - (self.written - since) * rest) % self.parts

    def write(self):
        """Give the next steps their words. Returns the first of them."""
        whole, rest = self.share
        begin, carried = self.written, self.carried
        end = min(begin + CHUNK, self.step + AHEAD)
        for step in range(begin, end):
            carried += rest
            word = self.ending + whole - SHORTEST
            if carried >= self.parts:
                carried -= self.parts
                word += 1
            self.words[self.first + step % RING] = word
        self.written, self.carried = max(begin, end), carried
        return begin

    def is_late(self):
        """Is the next step without a word too near, or played already?"""
        return self.written < self.step + 2

    def is_unread(self, first, read, now):
        """Was a step's word not read yet, and are the groups in step with each other and with the clock?

        ``read`` are the places in the ring that they read next. A step's word is read while it is played. The clock is
        right within a step, and ``now`` may be later than the reading, because memory was collected in between.
        """
        played, _ = self.walk(now)
        for place in read:
            step = self.step + (place - self.step) % RING
            if step > min(first, played + 2):
                return False
        return played < first


# controller -----------------------------------------------------------------------------------------------------------
# Answers lines, and watches what is played.


class Controller:
    """Answers lines, and watches what is played. ``hardware`` is a Pico, or a test's stand-in."""

    def __init__(self, hardware, unit, reset):
        self.hardware = hardware
        self.unit = unit
        self.reset = reset
        self.pace = Pace(hardware.pace)
        self.tables = [Table(group, link) for group, link in enumerate(hardware.links)]
        self.reader = LineReader()
        self.keep_ms = 1000
        self.state, self.fault = ("fault", "watchdog") if reset == "watchdog" else ("idle", "none")
        self.cycle = self.step = 0
        self.heard = self.now = hardware.ticks()
        self._forget()

    def _forget(self):
        self.slots = [None] * SLOTS
        self.steps = []

    def feed(self, data):
        """Take bytes and return what is to be answered."""
        answers = b""
        for byte in data:
            line = self.reader.take(byte)
            if line:
                answers += self._answer(*line)
        return answers

    def poll(self):
        """Let happen what is due."""
        starved = self.hardware.starved()  # ahead of the clock: the run may end while memory is collected in between
        self.now = self.hardware.ticks()
        silent = self.heard + self.keep_ms * TICKS_PER_MS
        if self.state == "running":
            self._watch_run(silent, starved)
        if self.state in ("armed", "running"):
            if self.hardware.interlock_open():
                self._fail("interlock")
            elif self.now >= silent:
                self._fail("silent")

    def _watch_run(self, silent, starved):
        pace = self.pace
        pace.advance(min(self.now, silent))
        if pace.is_over():
            self._darken("idle")
            self.cycle, self.step = self.cycles, 0
        elif starved and pace.walk(self.now + MIN_DARK)[0] != pace.last:
            self._fail("late")
        elif self.cycles > TURNS and not self.end_is_set:
            self._set_end(pace.position()[0])
        if self.state == "running" and pace.written is not None:
            self._keep_pace()

    def _keep_pace(self):
        """Give the steps of a trimmed run their words, in time, and see that the groups read them in step."""
        pace = self.pace
        if pace.is_late():
            self._fail("late")
            return
        first = pace.write()
        read = self.hardware.read_places()
        if not pace.is_unread(first, read, self.hardware.ticks()):
            self._fail("late")

    def _set_end(self, played):
        """Tell the tables where the run ends, once the DMA has passed that place for the last time but one."""
        if played <= self.cycles - TURNS:
            return
        for table in self.tables:
            table.end_after(self.cycles)
        self.end_is_set = True
        if played > self.cycles - TURNS // 8:
            self._fail("late")

    def _find_position(self):
        """Where the run is: by time, which has the same crystal as the state machines."""
        if self.state != "running" or self.now < self.start:
            return
        self.pace.advance(self.now)
        self.cycle, self.step = self.pace.position()

    def _darken(self, state):
        self.hardware.darken()
        self._find_position()
        self.state = state

    def _fail(self, fault):
        self._darken("fault")
        self.fault = fault

    def _answer(self, error, text):
        try:
            if error:
                raise RefusedError(error, error)
            said = self._act(*unseal(text).split(" "))
            self.heard = self.hardware.ticks()  # ARM takes its time
        except RefusedError as refused:
            said = f"E {ERRORS[refused.error]} {refused.text}"
        return ((seal(said) if "*" in text else said) + "\n").encode()

    def _act(self, name, *words):
        self.poll()
        if name not in COMMANDS:
            raise RefusedError("command", f"command {name[:20]}")
        fewest, most, states, keys = COMMANDS[name]
        if self.state not in states:
            raise RefusedError("fault", self.fault) if self.state == "fault" else RefusedError("state", self.state)
        if name == "TRIM" and self.pace.step < self.pace.since:
            raise RefusedError("state", "the trim before does not count yet")
        if "" in words or not fewest <= len(words) <= most:
            raise RefusedError("words", f"words: {len(words)}")
        values = getattr(self, "_answer_" + name.lower())(*words)
        return " ".join(["OK"] + [f"{key}={values[place]}" for place, key in enumerate(keys.split())])

    def _answer_id(self):
        return 1, "rp2040", "pico-1.1", self.unit

    def _answer_caps(self):
        limits = (MIN_ON, MIN_OFF, MIN_DARK, MAX_FLASH, MAX_FLASH, MAX_LINE_PPM, MAX_TOTAL_PPM)
        return (8000, "direct", LINES, LINES, SLOTS, STEPS) + limits + (100, self.keep_ms)

    def _answer_wiring(self, wiring):
        if wiring not in ("gated", "direct"):
            raise RefusedError("number", f"wiring {wiring[:20]}")
        if wiring == "gated":
            raise RefusedError("range", "wiring gated, this board has direct")
        self._forget()
        return (wiring,)

    def _answer_keep(self, word):
        ms = number(word)
        if not KEEP_MS[0] <= ms <= KEEP_MS[1]:
            raise RefusedError("range", f"ms {ms}, from {KEEP_MS[0]} to {KEEP_MS[1]}")
        self.keep_ms = ms
        return (ms,)

    def _answer_new(self):
        self._forget()
        self.state = "idle"
        return ()

    def _answer_slot(self, *words):
        place, duration, dark, period = [number(word) for word in words[:4]]
        lit = [lit_word(word) for word in words[4:]]
        if place >= SLOTS:
            raise RefusedError("range", f"slot {place}, this board has {SLOTS}")
        check_slot(duration, dark, period, lit)
        self.slots[place] = (duration, dark, period, lit)
        return (place,)

    def _answer_steps(self, *words):
        first, *slots = [number(word) for word in words]
        if first > len(self.steps) or first + len(slots) > STEPS:
            raise RefusedError("range", f"first {first}, {len(self.steps)} steps of at most {STEPS}")
        if max(slots) >= SLOTS:
            raise RefusedError("range", f"slot {max(slots)}, this board has {SLOTS}")
        self.steps = self.steps[:first] + slots
        return (len(self.steps),)

    def _answer_arm(self, word):
        claimed = number(word)
        cycle = [self.slots[step] for step in self.steps]
        if not cycle or None in cycle:
            raise RefusedError("incomplete", f"{len(cycle)} steps, or one names an empty slot")
        check = check_of(cycle)
        if check != claimed:
            raise RefusedError("check", f"check {claimed}, expected {check}")
        self.cycle_ticks, self.lit = check_cycle(cycle)
        if self.hardware.interlock_open():
            raise RefusedError("interlock", "interlock open")
        self.shortest_dark = min([dark for _, dark, _, _ in cycle])
        ending = self.pace.lay_out([duration + dark for duration, dark, _, _ in cycle], self.shortest_dark)
        for table in self.tables:
            table.lay_out(self.slots, self.steps, ending)
        self.state = "armed"
        return check, self.cycle_ticks

    def _answer_run(self, word):
        self.cycles = number(word)
        self.cycle = self.step = 0
        self.end_is_set = False
        for table in self.tables:
            table.wind(self.cycles)
        self.pace.wind(self.cycles)
        self.start = self.hardware.start([table.lead_address for table in self.tables])
        self.pace.begin(self.start)
        self.state = "running"
        return (self.start,)

    def _answer_trim(self, way, word):
        if way not in ("later", "sooner"):
            raise RefusedError("number", f"way {way[:20]}")
        ppm = number(word)
        if ppm > MAX_TRIM_PPM:
            raise RefusedError("range", f"ppm {ppm} > max_trim_ppm {MAX_TRIM_PPM}")
        self._trim(ppm if way == "later" else -ppm)
        return way, ppm

    def _trim(self, ppm):
        pace = self.pace
        check_trim(ppm, self.cycle_ticks, self.lit, len(self.steps), self.shortest_dark)
        since = pace.counts_from(self.now)
        if since < pace.walk(self.hardware.ticks())[0] + 2:
            raise RefusedError("state", "too busy to trim in time, ask again")
        pace.trim(ppm, since)
        self._keep_pace()
        if self.state == "fault":
            raise RefusedError("fault", self.fault)

    def _answer_stop(self):
        self._darken("fault" if self.state == "fault" else "idle")
        return self.state, self.cycle

    def _answer_stat(self):
        self._find_position()
        interlock = "open" if self.hardware.interlock_open() else "closed"
        return self.state, self.fault, self.reset, interlock, self.cycle, self.step, self.cycle

    def _answer_clk(self, nonce):
        if len(nonce) > LONGEST_NONCE or [c for c in nonce if not ("0" <= c <= "9" or "a" <= c.lower() <= "z")]:
            raise RefusedError("number", f"nonce {nonce[:20]}")
        self._find_position()
        return nonce, self.cycle, self.now

    def _answer_clear(self):
        if self.hardware.interlock_open():
            raise RefusedError("interlock", "interlock open")
        self.state, self.fault = "idle", "none"
        return (self.state,)


# board ----------------------------------------------------------------------------------------------------------------
# The only part that touches hardware: pins, timer, watchdog, PIO and DMA of the RP2040, and the USB port.
#
# Registers are written through machine.mem32, because the control blocks hold them as words anyway; rp2.DMA is there to
# claim channels, so that nothing else on the board takes them.


FIRST_PIN, INTERLOCK_PIN, SERVICE_PIN = 2, 10, 11
WATCHDOG_MS = 500
TIMER_HIGH, TIMER_LOW = 0x40054024, 0x40054028
CHIP_RESET, WATCHDOG_REASON, WATCHDOG_SCRATCH = 0x40064008, 0x40058008, 0x4005801C
WATCHDOG_ENABLED = 0x6AB73121  # what the SDK leaves in the scratch register where the watchdog was switched on
PIO, PIO_FDEBUG, PIO_FIFO, PIO_INSTRUCTION = 0x50200000, 0x50200008, 0x50200010, 0x502000D8
PIO_NEXT_INSTRUCTION = 0x18
PINS_LOW = 0xA003  # mov pins, null
STALLED = 3 << 24
DMA, DMA_ABORT = 0x50000000, 0x50000444
UNPACED = 0x3F
CHANNELS = 4  # for each group


def reset_cause(chip, reason, scratch):
    """Why the chip started, of the table's names, from three registers."""
    if reason:
        return "watchdog" if reason & 1 and scratch == WATCHDOG_ENABLED else "other"
    return "external" if chip & 1 << 16 else "power" if chip & 1 << 8 else "other"


def play():
    """The PIO program of both state machines."""
    wrap_target()
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(pins, 4)
    out(x, 32)
    label("longer")
    jmp(x_dec, "longer")
    wrap()


class Link:
    """What one group's table has to know of the hardware. Its channels: data, control, turn, pace."""

    def __init__(self, group, channels, memory, turns):
        self.fifo = PIO_FIFO + 4 * group
        self.treq = group
        self.data, self.control, self.turn, self.pace = channels[:CHANNELS]
        self.memory, self.turns = memory, turns
        self.ending = memory[2] + 4  # the wait of the table's first entry


class Pico:
    """The board: time, interlock, and a state machine with four DMA channels for each group of lines."""

    def __init__(self):
        machine.freq(1000000 * TICKS_PER_US)
        for pin in range(FIRST_PIN, FIRST_PIN + LINES):
            machine.Pin(pin, machine.Pin.OUT, value=0)
        self.interlock = machine.Pin(INTERLOCK_PIN, machine.Pin.IN, machine.Pin.PULL_UP)
        self.program = rp2.asm_pio(
            out_init=(rp2.PIO.OUT_LOW,) * GROUP_LINES,
            out_shiftdir=rp2.PIO.SHIFT_RIGHT,
            autopull=True,
            pull_thresh=32,
            fifo_join=rp2.PIO.JOIN_TX,
        )(play)
        self.machines = [rp2.StateMachine(group) for group in range(GROUPS)]
        self.claimed = [rp2.DMA() for _ in range(CHANNELS * GROUPS)]
        numbers = [claim.channel for claim in self.claimed]
        words, first, address = self._memory((GROUPS + 1) * TURNS, 4 * TURNS)  # rings that the DMA reads
        rings = [(words, first + TURNS * place, address + 4 * TURNS * place) for place in range(GROUPS + 1)]
        self.pace = rings[GROUPS]
        self.links = [
            Link(group, numbers[CHANNELS * group :], self._memory(TABLE_WORDS, 64), rings[group])
            for group in range(GROUPS)
        ]
        self._load()
        self.darken()

    def _memory(self, words, align):
        buffer = array("I", bytes(4 * words + align))
        address = uctypes.addressof(buffer)
        skipped = -address % align
        return buffer, skipped // 4, address + skipped

    def _load(self):
        for group, state_machine in enumerate(self.machines):
            pin = machine.Pin(FIRST_PIN + GROUP_LINES * group)
            state_machine.init(self.program, freq=1000000 * TICKS_PER_US, out_base=pin)

    def _now_us(self):
        while True:
            high = machine.mem32[TIMER_HIGH]
            low = machine.mem32[TIMER_LOW]
            if high == machine.mem32[TIMER_HIGH]:
                return (high << 32) + low

    def ticks(self):
        return self._now_us() * TICKS_PER_US

    def interlock_open(self):
        return bool(self.interlock.value())

    def starved(self):
        """Has a state machine run out of words since the start?"""
        return bool(machine.mem32[PIO_FDEBUG] & STALLED)

    def read_places(self):
        """Which place of the pace's ring each group reads next."""
        return [(machine.mem32[DMA + 64 * link.pace] >> 2) % RING for link in self.links]

    def _set_channel(self, channel, read, write, count, control):
        for place, word in ((0, read), (4, write), (8, count), (16, control)):  # 16: CTRL without a trigger
            machine.mem32[DMA + 64 * channel + place] = word

    def start(self, lead_addresses):
        """Begin with the lead and return the tick in which the first flash starts behind it."""
        self._load()
        for group, link in enumerate(self.links):
            lead = lead_addresses[group]
            ring = control_word(UNPACED, link.turn, 0, 12)
            self._set_channel(link.turn, link.turns[2], DMA + 64 * link.control + 0x3C, 1, ring)
            ring = control_word(UNPACED, link.control, 0, 12)
            self._set_channel(link.pace, self.pace[2], link.ending, 1, ring)
            ring = control_word(UNPACED, link.control, 1, 4, 1)
            self._set_channel(link.control, lead, DMA + 64 * link.data, 4, ring)
            machine.mem32[DMA + 64 * link.control + 0x3C] = lead  # and go
        time.sleep_us(100)
        memory = machine.mem32
        interrupts = machine.disable_irq()
        before = memory[TIMER_LOW]
        memory[PIO] = 0x303  # both in the same cycle
        after = memory[TIMER_LOW]
        machine.enable_irq(interrupts)
        memory[PIO_FDEBUG] = STALLED
        now_us = self._now_us()
        since_us = (now_us - before - ((after - before & 0xFFFFFFFF) >> 1)) & 0xFFFFFFFF
        return (now_us - since_us) * TICKS_PER_US + START_DELAY

    def darken(self):
        machine.mem32[PIO] = 0
        for group in range(GROUPS):
            machine.mem32[PIO_INSTRUCTION + PIO_NEXT_INSTRUCTION * group] = PINS_LOW
        channels = [number for link in self.links for number in (link.pace, link.turn, link.control, link.data)]
        for channel in channels:  # a channel that is enabled may be triggered again by one that is aborted
            machine.mem32[DMA + 64 * channel + 16] = 0
        machine.mem32[DMA_ABORT] = sum([1 << channel for channel in channels])
        for _ in range(100):  # a word on its way takes some cycles; the pins are low already
            if not machine.mem32[DMA_ABORT]:
                break


def main():
    """Serve for ever. An error ends in the dark, and in a reset by the watchdog."""
    pico = Pico()
    cause = reset_cause(*[machine.mem32[register] for register in (CHIP_RESET, WATCHDOG_REASON, WATCHDOG_SCRATCH)])
    watchdog = machine.WDT(timeout=WATCHDOG_MS)
    micropython.kbd_intr(-1)  # a byte 3 is garbage like any other
    unit = "".join([f"{byte:02x}" for byte in machine.unique_id()])[-8:]
    controller = Controller(pico, unit, cause)
    ready = select.poll()
    ready.register(sys.stdin, select.POLLIN)
    try:
        while True:
            watchdog.feed()
            controller.poll()
            if ready.poll(0):
                answer = controller.feed(sys.stdin.buffer.read(1))
                if answer:
                    sys.stdout.buffer.write(answer)
    finally:
        pico.darken()


def run():
    """Begin, unless this is another chip, or the service jumper is set."""
    if "RP2040" not in sys.implementation._machine:
        raise RuntimeError("this program is for the RP2040: its registers are elsewhere on other chips")
    if machine.Pin(SERVICE_PIN, machine.Pin.IN, machine.Pin.PULL_UP).value():
        main()


if __name__ == "__main__":
    run()
