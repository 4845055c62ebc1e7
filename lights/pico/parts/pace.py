"""How long the steps of a run last: a word for each of them in a ring of memory that the DMA reads, one in every step.

Both groups read the same ring, so they stay in step whatever stands there, as long as no word changes between the two
readings of one step. Therefore words are written at least a step ahead, and looked after once they are written.
"""

from link import MAX_TRIM_PPM, TICKS_PER_MS
from table import SHORTEST, SPARE_DARK, TURNS

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
