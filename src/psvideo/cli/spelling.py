"""Rewrites parameters in the library's sentences as command-line options: `dark_s` becomes --dark."""

import re
from collections.abc import Mapping

PARAMETER = re.compile(r"`([a-z][a-z0-9_]*)(?:=([^`]*))?`")
"""How the library names a parameter: `` `first_light` ``, or with a value, `` `solver='robust'` ``."""
OTHERWISE = {
    "preset": "for",
    "float32": "float",
    "size_px": "size",
    "readout_s": "readout",
    "shutter_deg": "shutter",
    "exposure_s": "exposure",
    "flash_s": "flash",
    "max_blur_px": "max-blur",
    "speed_px_s": "speed",
    "max_pulse_s": "max-pulse",
    "dark_s": "dark",
    "near_s": "near",
    "starts_s": "starts",
}
"""Options that are not called as their parameters are: most of these take their unit along."""


def spelled(text: str) -> str:
    """Return a sentence with its parameters as options.

    >>> spelled('Add `solver="robust"`, or leave `first_light` out.')
    'Add --solver robust, or leave --first-light out.'
    >>> spelled("`multipart=False`, `force=True`, `aov=[\\"depth\\"]`, `preset`")
    '--no-multipart, --force, --aov depth, --for'
    """
    return PARAMETER.sub(_option, text)


def spelled_within(data: object) -> object:
    """Return a record as JSON takes it, its sentences with parameters as options."""
    if isinstance(data, str):
        return spelled(data)
    if isinstance(data, Mapping):
        return {key: spelled_within(value) for key, value in data.items()}
    return [spelled_within(value) for value in data] if isinstance(data, list | tuple) else data


def _option(found: re.Match[str]) -> str:
    word = OTHERWISE.get(found[1], found[1]).replace("_", "-")
    if found[2] in (None, "True"):
        return f"--{word}"
    if found[2] == "False":
        return f"--no-{word}"
    value = found[2].strip("[]()'\"")
    return f"--{word} {value}"
