"""Answers lines, and watches what is played."""

from flashes import check_cycle, check_of, check_slot, check_trim
from lines import LineReader, lit_word, number, seal, unseal
from link import (
    COMMANDS,
    ERRORS,
    KEEP_MS,
    LINES,
    LONGEST_NONCE,
    MAX_FLASH,
    MAX_LINE_PPM,
    MAX_TOTAL_PPM,
    MAX_TRIM_PPM,
    MIN_DARK,
    MIN_OFF,
    MIN_ON,
    SLOTS,
    STEPS,
    TICKS_PER_MS,
    RefusedError,
)
from pace import Pace
from table import TURNS, Table


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
