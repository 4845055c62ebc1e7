"""Parameters in sentences of the library, spelled as the options that they are on the command line."""

import re

PARAMETER = re.compile(r"`([a-z][a-z0-9_]*)(?:=([^`]*))?`")
"""How the library names a parameter: `` `first_light` ``, or with a value, `` `solver="robust"` ``."""
OTHERWISE = {"preset": "for", "float32": "float"}
"""Options that are not called as their parameters are."""


def spelled(text: str) -> str:
    """Return a sentence with its parameters as options.

    >>> spelled('Add `solver="robust"`, or leave `first_light` out.')
    'Add --solver robust, or leave --first-light out.'
    >>> spelled("`multipart=False`, `force=True`, `aov=[\\"depth\\"]`, `preset`")
    '--no-multipart, --force, --aov depth, --for'
    """
    return PARAMETER.sub(_option, text)


def _option(found: re.Match[str]) -> str:
    word = OTHERWISE.get(found[1], found[1]).replace("_", "-")
    if found[2] in (None, "True"):
        return f"--{word}"
    if found[2] == "False":
        return f"--no-{word}"
    return f"--{word} {found[2].strip('[]()').strip(chr(34))}"
