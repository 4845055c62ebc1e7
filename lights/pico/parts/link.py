"""What lights/protocol.toml says of the link and of this board; times in ticks of 8 ns."""

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
