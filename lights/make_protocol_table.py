"""Write lights/firmware/protocol_table.h from lights/protocol.toml: ``python lights/make_protocol_table.py``.

The header is checked in, so that the Arduino IDE needs no Python; a test holds it equal to what this writes.
"""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PROTOCOL = HERE / "protocol.toml"
HEADER = HERE / "firmware" / "protocol_table.h"
MANY_WORDS = 255
AVR_BOARDS = {"atmega328p": "__AVR_ATmega328P__", "atmega2560": "__AVR_ATmega2560__"}


def header(table: dict[str, Any]) -> str:
    """Return the C header that says what the table says."""
    parts = [_opening(table), _words(table), _commands(table["command"]), _limits(table["limits"]), _boards(table)]
    return "\n".join(line for part in parts for line in [*part, ""]) + "#endif\n"


def _opening(table: dict[str, Any]) -> Iterator[str]:
    yield "/* Generated from lights/protocol.toml by lights/make_protocol_table.py; change those. */"
    yield "#ifndef PROTOCOL_TABLE_H"
    yield "#define PROTOCOL_TABLE_H"
    yield ""
    yield f"#define PROTOCOL {table['protocol']}"
    yield from (f"#define {name.upper()} {value}" for name, value in table["line"].items())
    yield f"#define CHECKSUM_POLYNOMIAL 0x{table['checksum']['polynomial']:04X}"
    yield f"#define CHECKSUM_START 0x{table['checksum']['start']:04X}"


def _words(table: dict[str, Any]) -> Iterator[str]:
    yield from (f"#define ERROR_{name.upper()} {code}" for name, code in table["error"].items())
    for kind, one in (
        ("states", "state"),
        ("faults", "fault"),
        ("resets", "reset"),
        ("wirings", "wiring"),
        ("ways", "way"),
    ):
        names = table[kind]["names"]
        yield ""
        yield from (f"#define {one.upper()}_{name.upper()} {place}" for place, name in enumerate(names))
        yield f'#define {one.upper()}_NAMES "{" ".join(names)}"'


def _commands(commands: list[dict[str, Any]]) -> Iterator[str]:
    yield f"#define MANY_WORDS {MANY_WORDS}"
    yield "/* X(name, fewest words, most words, states in which it is taken, keys of the reply) */"
    yield "#define COMMANDS(X) \\"
    yield " \\\n".join(f"    {_command(command)}" for command in commands)


def _command(command: dict[str, Any]) -> str:
    plain = [word for word in command["words"] if word[0] not in "*+"]
    many = len(plain) < len(command["words"])
    fewest = len(plain) + any(word[0] == "+" for word in command["words"])
    states = " | ".join(f"1 << STATE_{state.upper()}" for state in command["states"])
    most = "MANY_WORDS" if many else len(plain)
    return f'X({command["name"]}, {fewest}, {most}, {states}, "{" ".join(command["reply"])}")'


def _limits(limits: dict[str, Any]) -> Iterator[str]:
    for name, value in limits.items():
        if name == "keep_ms":
            yield f"#define LEAST_KEEP_MS {value[0]}"
            yield f"#define MOST_KEEP_MS {value[1]}"
        else:
            yield f"#define {name.upper()} {value}UL"


def _boards(table: dict[str, Any]) -> Iterator[str]:
    for name, chip in AVR_BOARDS.items():
        board = table["board"][name]
        yield f"#ifdef {chip}"
        yield f'#define BOARD_NAME "{name}"'
        for key, value in board.items():
            if isinstance(value, dict):
                yield from (f"#define {key.upper()}_{wiring.upper()} {count}" for wiring, count in value.items())
            else:
                yield f"#define {key.upper()} {int(value)}UL"
        yield "#endif"


if __name__ == "__main__":
    HEADER.write_text(header(tomllib.loads(PROTOCOL.read_text(encoding="utf-8"))), encoding="utf-8")
