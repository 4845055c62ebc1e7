"""The strobe link: the code says what the table says, and no damaged line is ever taken for a whole one."""

import tomllib
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from psvideo.strobe import limits
from psvideo.strobe.link import boards, lines, words
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.link.lines import (
    LONGEST_REPLY,
    LONGEST_REQUEST,
    Error,
    LineError,
    LineReader,
    TextLine,
    crc16,
    seal,
    unseal,
)
from psvideo.strobe.link.protocol import find_command, format_reply, format_request, parse_reply, parse_words
from psvideo.strobe.link.replies import (
    Armed,
    Capabilities,
    ClockReading,
    Identity,
    Refusal,
    Renewed,
    Reply,
    Started,
    Status,
    Trimmed,
)
from psvideo.strobe.link.requests import (
    REQUESTS,
    Clk,
    Id,
    Keep,
    Lit,
    New,
    Request,
    Run,
    Slot,
    Steps,
    Stop,
    Trim,
    Wiring,
)
from psvideo.strobe.link.words import Nonce

TABLE: dict[str, Any] = tomllib.loads(
    (Path(__file__).resolve().parents[1] / "lights" / "protocol.toml").read_text(encoding="utf-8")
)

BUSY = [HealthCheck.too_slow]
"""A machine that is busy is no reason to fail."""
REPLIES: list[Reply] = [
    Identity(proto=1, board="atmega328p", firmware="psvideo-1", unit="a3"),
    boards.capabilities(BOARDS["rp2040"], "direct"),
    Renewed(),
    Armed(check=65535, cycle=120_000_000),
    Started(start=2**40),
    Trimmed(way="sooner", ppm=20_000),
    Status(state="fault", fault="silent", reset="brownout", interlock="open", cycle=7, step=3, cycles=7),
    ClockReading(nonce=Nonce("a1Z"), cycle=0, ticks=2**63),
]
SMALL = st.integers(0, 4_294_967_295)
REQUEST = st.one_of(
    st.builds(Id),
    st.builds(New),
    st.builds(Stop),
    st.builds(Keep, ms=SMALL),
    st.builds(Run, cycles=SMALL),
    st.builds(Trim, way=st.sampled_from(words.WAYS), ppm=SMALL),
    st.builds(Wiring, wiring=st.sampled_from(words.WIRINGS)),
    st.builds(Clk, nonce=st.from_regex(r"[A-Za-z0-9]{1,8}", fullmatch=True)),
    st.builds(Steps, first=SMALL, slots=st.lists(SMALL, min_size=1, max_size=6).map(tuple)),
    st.builds(
        Slot,
        slot=SMALL,
        duration=SMALL,
        dark=SMALL,
        period=SMALL,
        lit=st.lists(st.builds(Lit, line=st.integers(0, 9), on=SMALL), max_size=3).map(tuple),
    ),
)


def test_every_command_of_the_table_has_its_record_and_no_other() -> None:
    assert [command["name"] for command in TABLE["command"]] == list(REQUESTS)
    for command in TABLE["command"]:
        kind = REQUESTS[command["name"]]
        assert list(kind.states) == command["states"], kind
        assert [field.name for field in fields(kind.reply)] == command["reply"], kind
        assert len(fields(kind)) == len(command["words"]), kind


def test_words_numbers_and_names_are_those_of_the_table() -> None:
    assert TABLE["protocol"] == words.PROTOCOL
    assert (TABLE["line"]["longest_request"], TABLE["line"]["longest_reply"]) == (LONGEST_REQUEST, LONGEST_REPLY)
    assert {error.name.lower(): error.value for error in Error} == TABLE["error"]
    text, crc = TABLE["checksum"]["example"]
    assert crc16(text.encode()) == crc
    assert (TABLE["checksum"]["polynomial"], TABLE["checksum"]["start"]) == (0x1021, lines.CRC_START)
    for kind, names in ((words.State, "states"), (words.Fault, "faults"), (words.Reset, "resets")):
        assert list(get_args(kind)) == TABLE[names]["names"]
    assert list(words.WIRINGS) == TABLE["wirings"]["names"]
    assert list(words.WAYS) == TABLE["ways"]["names"]


def test_boards_and_limits_are_those_of_the_table() -> None:
    table = TABLE["limits"]
    assert (table["max_flash_us"], table["min_dark_us"]) == (boards.MAX_FLASH_US, boards.MIN_DARK_US)
    assert (table["max_line_ppm"], table["max_total_ppm"]) == (boards.MAX_LINE_PPM, boards.MAX_TOTAL_PPM)
    assert list(boards.KEEP_MS) == table["keep_ms"]
    assert table["max_trim_ppm"] == boards.MAX_TRIM_PPM
    assert table["max_cycle_s"] == limits.LONGEST_CYCLE_S
    assert list(BOARDS) == list(TABLE["board"])
    for name, board in BOARDS.items():
        assert {key: getattr(board, key) for key in TABLE["board"][name]} == TABLE["board"][name]


@settings(deadline=None, suppress_health_check=BUSY)
@given(request=REQUEST, sealed=st.booleans())
def test_a_request_survives_the_way_there(request: Request, sealed: bool) -> None:
    (line,) = LineReader(1000).feed(format_request(request, sealed=sealed))
    body, was_sealed = unseal(line.text)
    assert was_sealed == sealed
    assert parse_words(*find_command(body)) == request


@pytest.mark.parametrize("reply", REPLIES, ids=lambda reply: type(reply).__name__)
@pytest.mark.parametrize("sealed", [True, False])
def test_a_reply_survives_the_way_back(reply: Reply, sealed: bool) -> None:
    data = format_reply(reply, sealed=sealed)
    assert len(data) <= LONGEST_REPLY + 1
    (line,) = LineReader(LONGEST_REPLY).feed(data)
    assert parse_reply(line.text, type(reply)) == (reply, sealed)


def test_a_refusal_survives_the_way_back() -> None:
    refusal = Refusal(code=9, text="duration 1 > max_flash 0")
    (line,) = LineReader(LONGEST_REPLY).feed(format_reply(refusal, sealed=True))
    assert parse_reply(line.text, Identity) == (refusal, True)


@pytest.mark.parametrize("reply", REPLIES, ids=lambda reply: type(reply).__name__)
def test_a_reply_cut_anywhere_comes_out_whole_once_the_rest_is_there(reply: Reply) -> None:
    data = format_reply(reply, sealed=True)
    for cut in range(len(data)):
        reader = LineReader(LONGEST_REPLY)
        assert list(reader.feed(data[:cut])) == []
        (line,) = reader.feed(data[cut:])
        assert parse_reply(line.text, type(reply)) == (reply, True)


@pytest.mark.parametrize("reply", REPLIES, ids=lambda reply: type(reply).__name__)
def test_a_reply_whose_middle_or_end_is_lost_is_no_reply(reply: Reply) -> None:
    data = format_reply(reply, sealed=True)
    for cut in range(len(data) - 1):
        for rest in (b"\n", data[cut + 1 :]):
            for line in LineReader(LONGEST_REPLY).feed(data[:cut] + rest):
                assert not _taken(line, type(reply)), data[:cut] + rest


@pytest.mark.parametrize("reply", REPLIES, ids=lambda reply: type(reply).__name__)
def test_every_single_flipped_bit_of_a_reply_is_noticed(reply: Reply) -> None:
    data = format_reply(reply, sealed=True)
    for bit in range(8 * (len(data) - 1)):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        for line in LineReader(LONGEST_REPLY).feed(bytes(flipped)):
            assert not _taken(line, type(reply)), bytes(flipped)


def _taken(line: TextLine, kind: type[Reply]) -> bool:
    """True where the host would take a line for the answer to a request that had a checksum."""
    if line.fault is not None:
        return False
    try:
        return parse_reply(line.text, kind)[1]
    except LineError:
        return False


@settings(deadline=None, suppress_health_check=BUSY)
@given(data=st.binary(max_size=400), cuts=st.lists(st.integers(0, 400), max_size=6))
def test_the_reader_gives_the_same_lines_however_the_bytes_are_cut(data: bytes, cuts: list[int]) -> None:
    whole = list(LineReader(40).feed(data))
    reader = LineReader(40)
    edges = [0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]
    pieces = [line for a, b in pairwise(edges) for line in reader.feed(data[a:b])]
    assert pieces == whole
    assert all(line.fault or (0 < len(line.text) <= 40 and line.text.isprintable()) for line in whole)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"ID\r\n", TextLine(text="ID")),
        (b"I\rD\n", TextLine(text="", fault=Error.BYTES)),
        (b"ID\x00\n", TextLine(text="", fault=Error.BYTES)),
        (b"\xff\n", TextLine(text="", fault=Error.BYTES)),
        (b"x" * 96 + b"\r\n", TextLine(text="x" * 96)),
        (b"x" * 97 + b"\n", TextLine(text="", fault=Error.LONG)),
        (b"x" * 5000 + b"\n", TextLine(text="", fault=Error.LONG)),
    ],
)
def test_lines_are_read_as_the_page_has_them(data: bytes, expected: TextLine) -> None:
    assert list(LineReader(LONGEST_REQUEST).feed(b"\n\r\n" + data)) == [expected]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("id", Error.COMMAND),
        ("", Error.COMMAND),
        (" ID", Error.COMMAND),
        ("ID ", Error.WORDS),
        ("RUN", Error.WORDS),
        ("RUN 1 2", Error.WORDS),
        ("RUN  1", Error.WORDS),
        ("STEPS 0", Error.WORDS),
        ("SLOT 0 1 2", Error.WORDS),
        ("RUN -1", Error.NUMBER),
        ("RUN +1", Error.NUMBER),
        ("RUN 0x1", Error.NUMBER),
        ("RUN 4294967296", Error.NUMBER),
        ("RUN " + "9" * 60, Error.NUMBER),
        ("SLOT 0 1 2 3 4", Error.NUMBER),
        ("SLOT 0 1 2 3 4:5:6", Error.NUMBER),
        ("SLOT 0 1 2 3 :5", Error.NUMBER),
        ("CLK abcdefghi", Error.NUMBER),
        ("CLK a-b", Error.NUMBER),
        ("WIRING blue", Error.NUMBER),
    ],
)
def test_what_is_no_request_is_refused_with_its_reason(text: str, code: Error) -> None:
    with pytest.raises(LineError) as caught:
        parse_words(*find_command(text))
    assert caught.value.code == code


def test_leading_zeros_are_allowed() -> None:
    assert parse_words(*find_command("RUN " + "0" * 40 + "7")) == Run(cycles=7)


@pytest.mark.parametrize(
    "text", ["ID*", "ID*A21", "ID*a21b", "ID*A21B ", "ID*A21B*A21B", seal("ID*A21B"), "*A21B", "I*D", "ID*0000"]
)
def test_a_star_is_nothing_but_a_checksum(text: str) -> None:
    with pytest.raises(LineError) as caught:
        unseal(text)
    assert caught.value.code == Error.CRC


def test_a_reply_of_another_kind_or_order_is_no_reply() -> None:
    for text in (
        "OK",
        "OK proto=1",
        "OK board=a proto=1 firmware=b unit=c",
        "OK proto=x board=a firmware=b unit=c",
        "",
    ):
        with pytest.raises(LineError):
            parse_reply(text, Identity)
    with pytest.raises(LineError):
        parse_reply(seal("OK state=asleep cycles=0"), REQUESTS["STOP"].reply)
    assert isinstance(parse_reply("E 3", Capabilities)[0], Refusal)
