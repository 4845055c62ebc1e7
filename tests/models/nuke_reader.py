"""As much of Nuke as the delivered scripts use: its scripts' stack, and the arithmetic of seven nodes.

Read off Foundry's public manual (nodes Read, Expression, Multiply, Merge2, Copy, Group) and the way its scripts are
written: a node takes its inputs from a stack, the first from the top. Anything else in a script is a fault.
"""

import ast
import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from numpy.typing import NDArray

KNOBS = {
    "Root": {"frame", "first_frame", "last_frame", "lock_range", "format", "fps"},
    "Read": {"file_type", "file", "format", "first", "last", "origfirst", "origlast", "origset", "raw"},
    "Expression": {f"{kind}{n}" for kind in ("temp_name", "temp_expr", "expr") for n in range(4)},
    "Multiply": {"channels", "value"},
    "Merge2": {"operation"},
    "Copy": {"from0", "to0"},
    "Group": {"help", "addUserKnob", "direction", "colour"},
    "Input": {"number"},
    "Output": set(),
    "Viewer": set(),
}
ARITHMETIC = (
    *(ast.Expression, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop),
    *(ast.Call, ast.Name, ast.Load, ast.Constant),
)
SOURCES = ("Root", "Read", "Input")
Picture = NDArray[np.float64]


@dataclass
class Node:
    kind: str
    knobs: dict[str, str]
    inputs: list["Node"] = field(default_factory=list)
    inner: list["Node"] = field(default_factory=list)

    @property
    def name(self) -> str:
        return self.knobs["name"]


def read_script(path: Path) -> list[Node]:
    """Return a script's nodes in their order, each with the nodes that it takes its pictures from."""
    nodes: list[Node] = []
    stack: list[Node] = []
    named: dict[str, Node] = {}
    outer: list[tuple[list[Node], list[Node]]] = []
    text = path.read_text(encoding="utf-8")
    for kind, body, line in re.findall(r"^ ?(\w+) \{\n(.*?)^ ?\}$|^(\S[^{\n]*)$", text, flags=re.MULTILINE | re.DOTALL):
        words = line.split()
        if kind:
            node = _node(kind, body, stack)
            (nodes if not outer else outer[-1][0]).append(node)
            stack = [node, *stack[len(node.inputs) :]] if kind not in ("Root", "Output", "Viewer") else stack
            if kind == "Group":
                outer.append((node.inner, stack))
                stack = []
        elif words[0] == "set":
            assert words[2:] == ["[stack", "0]"], line
            named[words[1]] = stack[0]
        elif words[0] == "push":
            stack = [named[words[1].removeprefix("$")], *stack]
        elif words == ["end_group"]:
            stack = outer.pop()[1]
        else:
            assert words[0] == "version", line
    assert not outer
    return nodes


def _node(kind: str, body: str, stack: list[Node]) -> Node:
    knobs: dict[str, str] = {}
    for line in body.splitlines():
        name, _, value = line.strip().partition(" ")
        assert name in KNOBS[kind] | {"inputs", "name"}, f"{kind} has no knob {name!r} here"
        knobs[name] = value.strip()
    count = int(knobs.pop("inputs", "0" if kind in SOURCES else "1"))
    assert len(stack) >= count, f"{kind} finds no input"
    return Node(kind=kind, knobs=knobs, inputs=stack[:count])


def picture_of(node: Node, script: Path, frame: int, *, group: Node | None = None) -> Picture:
    """Return what a node gives: (row, col, 4) as r, g, b, a."""
    if node.kind == "Input":
        assert group is not None
        return picture_of(group.inputs[int(node.knobs.get("number", 0))], script, frame)
    if node.kind == "Read":
        return _read(node, script, frame)
    pictures = [picture_of(one, script, frame, group=group) for one in node.inputs]
    if node.kind == "Expression":
        assert group is not None
        return _expression(node, pictures[0], group)
    if node.kind == "Multiply":
        assert group is not None
        assert node.knobs["channels"] == "rgb"
        return pictures[0] * [_number(word, group) for word in re.findall(r"\{[^{}]*\}|\d+", node.knobs["value"][1:-1])]
    if node.kind == "Merge2":
        below, above = pictures
        return {"multiply": above * below, "plus": above + below}[node.knobs["operation"]]
    if node.kind == "Copy":
        assert (node.knobs["from0"], node.knobs["to0"]) == ("rgba.red", "rgba.alpha")
        return np.concatenate([pictures[0][..., :3], pictures[1][..., :1]], axis=-1)
    if node.kind == "Group":
        (last,) = [one for one in node.inner if one.kind == "Output"]
        return picture_of(last.inputs[0], script, frame, group=node)
    raise AssertionError(node.kind)


def _read(node: Node, script: Path, frame: int) -> Picture:
    assert node.knobs["raw"] == "true", "vectors and linear light are read without a colour space"
    assert int(node.knobs["first"]) <= frame <= int(node.knobs["last"])
    quoted = node.knobs["file"].removeprefix('"').removesuffix('"')
    assert not re.search(r"(?<!\\)(?:\\\\)*[\[$]", quoted), "Tcl would evaluate it while the script is opened"
    knob = re.sub(r"\\(.)", r"\1", quoted)
    knob = knob.replace("[file dirname [value root.name]]", str(script.parent))
    file = re.sub(r"\\(.)", r"\1", knob) % frame
    channels = OpenEXR.File(file, separate_channels=True).channels()
    names = "RGB" if "R" in channels else "YYY"
    rgb = [channels[name].pixels.astype(np.float64) for name in names]
    return np.stack([*rgb, np.zeros_like(rgb[0])], axis=-1)


def _knob(group: Node, words: str) -> float:
    """Return a knob of the group around: ``parent.direction.x``."""
    parent, knob, part = words.split(".")
    assert parent == "parent"
    return float(group.knobs[knob].strip("{}").split()["xyz".find(part) if part in "xyz" else "rgb".find(part)])


def _number(word: str, group: Node) -> float:
    return _knob(group, word.strip("{}")) if word.startswith("{") else float(word)


def _expression(node: Node, picture: Picture, group: Node) -> Picture:
    known: dict[str, Any] = dict(zip("rgba", np.moveaxis(picture, -1, 0), strict=True))
    for place in range(4):
        name = node.knobs.get(f"temp_name{place}")
        if name is not None:
            known[name] = _value(shlex.split(node.knobs[f"temp_expr{place}"])[0], known, group)
    parts = []
    for place, channel in enumerate("rgba"):
        text = node.knobs.get(f"expr{place}")
        value = known[channel] if text is None else _value(shlex.split(text)[0], known, group)
        parts.append(np.broadcast_to(value, picture.shape[:2]))
    return np.stack(parts, axis=-1)


def _value(text: str, known: dict[str, Any], group: Node) -> Any:
    text = re.sub(r"parent\.\w+\.\w", lambda found: repr(_knob(group, found.group())), text)
    for one in ast.walk(ast.parse(text, mode="eval")):
        allowed = (
            ast.Expression | ast.BinOp | ast.operator | ast.Call | ast.Name | ast.Load | ast.Constant | ast.UnaryOp
        )
        assert isinstance(one, allowed | ast.unaryop), ast.dump(one)
    names = {"max": np.maximum, "sqrt": np.sqrt, "long": known.get("long"), **known}
    return eval(text, {"__builtins__": {}}, names)
