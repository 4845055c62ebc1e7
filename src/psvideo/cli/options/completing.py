"""What a shell may offer for an option's value: names of lights out of the clip's plan, cameras, boards.

Only the standard library reads the plan here, so that a key press is answered at once; what cannot be read offers
nothing.
"""

import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

import typer


def lights_of(path: Path) -> Iterator[str]:
    """Give the names of the lights of a plan or of a clip's plan, in the order in which they flash."""
    beside = path if path.suffix == ".toml" else (path.parent if path.is_file() else path) / "plan.toml"
    try:
        strobe = tomllib.loads(beside.read_text(encoding="utf-8")).get("strobe", {})
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return
    flashes = strobe.get("flash", []) if isinstance(strobe, dict) else []
    names = (name for flash in flashes if isinstance(flash, dict) for name in flash.get("lights", {}))
    yield from dict.fromkeys(names)


def _plan_typed(context: typer.Context) -> Path | None:
    """Return the plan that the words before name: an option's, else the clip or the plan itself."""
    option = context.params.get("plan")
    if isinstance(option, str | Path):
        return Path(option)
    words = [
        *context.args,
        *(context.params.get("clips") or ()),
        *(context.params.get(n) for n in ("clip", "pictures")),
    ]
    # before the option's value is typed, the parser leaves the arguments among the words
    return next((Path(word) for word in words if isinstance(word, str | Path)), None)


def offer_lights(ctx: typer.Context, incomplete: str) -> list[str]:
    """Offer the lights of the plan that has been named."""
    plan = _plan_typed(ctx)
    return [] if plan is None else _starting(lights_of(plan), incomplete)


def offer_lines(ctx: typer.Context, incomplete: str) -> list[str]:
    """Offer ``light=`` for the lights of the plan that has been named."""
    plan = _plan_typed(ctx)
    return [] if plan is None else _starting((f"{name}=" for name in lights_of(plan)), incomplete)


def offer_cameras(incomplete: str) -> list[str]:
    """Offer the cameras of the table."""
    from psvideo.capture.cameras import camera_modes

    return _starting(dict.fromkeys(mode.name for mode in camera_modes()), incomplete)


def offer_transfers(incomplete: str) -> list[str]:
    """Offer the short names of transfer curves."""
    from psvideo.clip.transfer import CURVES

    return _starting((curve.name for curve in CURVES), incomplete)


def offer_boards(incomplete: str) -> list[str]:
    """Offer the boards of the table."""
    from psvideo.strobe.link.boards import BOARDS

    return _starting(BOARDS, incomplete)


def offer_ports(incomplete: str) -> list[str]:
    """Offer what stands for a port, and the ports at which a board may be."""
    from psvideo.strobe.link.controller import serial_ports

    return _starting(["auto", "emulated", *(port.device for port in serial_ports() if port.is_candidate)], incomplete)


def _starting(words: Iterable[str], start: str) -> list[str]:
    return [word for word in words if word.lower().startswith(start.lower())]
