"""What PIO and DMA play: a cycle as entries in memory, and the control blocks by which the DMA walks through them.

Two state machines run in step, four lines each. An entry is two words: eight states of four lines, a tick each, and
how much longer the last one lasts. So it lasts ten ticks or more (eight states, the delay's fetch, a pass of its loop),
but edges of different lines may be a single tick apart: entries are laid such that every edge falls into the eight.
"""

from link import START_DELAY

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
