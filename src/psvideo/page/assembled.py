"""The page's own files, its scripts made into one, which is quicker to fetch and fits into a page of one file."""

import re
from collections.abc import Mapping
from importlib.resources import files

IMPORT = re.compile(r'^import \{[^}]*\} from "\./([a-z]+\.js)";\n', re.MULTILINE)
EXPORT = re.compile(r"^export ", re.MULTILINE)


def assets() -> dict[str, bytes]:
    """Return ``index.html``, ``style.css`` and ``main.js``, which holds all modules."""
    others = {name: content for name, content in _found().items() if not name.endswith(".js")}
    return others | {"main.js": joined(scripts(), "main.js").encode()}


def scripts() -> dict[str, str]:
    """Return the page's modules by name."""
    return {name: content.decode() for name, content in _found().items() if name.endswith(".js")}


def _found() -> dict[str, bytes]:
    return {entry.name: entry.read_bytes() for entry in files("psvideo.page").joinpath("assets").iterdir()}


def joined(scripts: Mapping[str, str], first: str) -> str:
    """Return modules as one script, each after those that it imports.

    Names at the top level of modules must all differ, and imports stand in lines of their own.

    >>> joined({"a.js": 'import { b } from "./b.js";\\nb();\\n', "b.js": "export function b() {}\\n"}, "a.js")
    'function b() {}\\n\\nb();\\n'
    """
    order: dict[str, None] = {}

    def visit(name: str) -> None:
        for found in IMPORT.finditer(scripts[name]):
            if found[1] not in order:
                visit(found[1])
        order.setdefault(name)

    visit(first)
    return "\n".join(EXPORT.sub("", IMPORT.sub("", scripts[name])) for name in order)
