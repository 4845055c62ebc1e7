"""A Nuke script beside a delivery: its sequences read as they must be, and a group per light that relights them.

Stock nodes only (Read, Group, Expression, Multiply, Merge2, Copy). A script is a program for a stack: every node takes
as many inputs from it as it says, the first from the top, and puts itself there; ``push $name`` puts a node there that
``set name [stack 0]`` gave a name.
"""

import re

from psvideo.export.programs.delivered import Delivered, SeenLight
from psvideo.export.sequences.result_files import result_name

FOLDER = r"\[file dirname \[value root.name]]"
"""Where the script lies, in Nuke's own words: the delivery may be moved as a whole. The brackets are for Nuke, which
evaluates them whenever it reads a file, and not for the script, which would while it is opened."""
GROUP = """Group {{
 inputs 2
 name {name}
 help "Light of one lamp on a matte surface: albedo * colour * max(0, n . direction). Inputs: normals, albedo."
 addUserKnob {{20 relight l Relight}}
 addUserKnob {{13 direction l "towards the light"}}
 direction {{{direction}}}
 addUserKnob {{18 colour}}
 colour {{{colour}}}
}}
 Input {{
  inputs 0
  name albedo
  number 1
 }}
 Input {{
  inputs 0
  name normals
 }}
 Expression {{
  temp_name0 long
  temp_expr0 "max(sqrt(parent.direction.x*parent.direction.x+parent.direction.y*parent.direction.y\
+parent.direction.z*parent.direction.z), 1e-6)"
  temp_name1 lit
  temp_expr1 "max((r*parent.direction.x+g*parent.direction.y+b*parent.direction.z)/long, 0)"
  expr0 lit
  expr1 lit
  expr2 lit
  name shade
 }}
 Multiply {{
  channels rgb
  value {{{{parent.colour.r}} {{parent.colour.g}} {{parent.colour.b}} 1}}
  name tint
 }}
 Merge2 {{
  inputs 2
  operation multiply
  name paint
 }}
 Output {{
  name Output1
 }}
end_group
"""


ANY_LIGHT = SeenLight(name="key", direction=(0.4, 0.5, 0.768))
"""The lamp of a script where the lights of the shoot cannot be said in the normals' frame."""


def script_name(clip: str) -> str:
    """Return the script's name in the output folder."""
    return f"{clip}.nk"


def nuke_script(made: Delivered) -> str:
    """Return the script: normals, albedo and valid read raw, one relighting group per light, and their sum.

    The sum's alpha is where normals are to be trusted. Directions are in the frame of the delivered normals.
    """
    width, height = made.width_px, made.height_px
    size = f"{width} {height} 0 0 {width} {height} 1 psvideo"
    parts = [_root(made, size)]
    for quantity in ("normals", "albedo", "valid"):
        parts.append(_read(made, quantity, size))
        parts.append(f"set {quantity} [stack 0]\n")
    parts.append("push $valid\n")
    for place, light in enumerate(made.lights or [ANY_LIGHT]):
        parts.append(f"push $albedo\npush $normals\n{_group(light)}")
        if place:
            parts.append(f"Merge2 {{\n inputs 2\n operation plus\n name sum{place}\n}}\n")
    parts.append("Copy {\n inputs 2\n from0 rgba.red\n to0 rgba.alpha\n name trusted\n}\n")
    parts.append("Viewer {\n name Viewer1\n}\n")
    return "".join(parts)


def _root(made: Delivered, size: str) -> str:
    return (
        f"version 13.0 v1\nRoot {{\n inputs 0\n frame {made.first}\n first_frame {made.first}\n last_frame "
        f'{made.last}\n lock_range true\n format "{size}"\n fps {float(made.fps):.9g}\n}}\n'
    )


def _read(made: Delivered, quantity: str, size: str) -> str:
    name = result_name(made.clip, quantity, made.first).removesuffix(f".{made.first:04d}.exr")
    file = _literal(name) + ".%04d.exr"
    return (
        f'Read {{\n inputs 0\n file_type exr\n file "{FOLDER}/{file}"\n format "{size}"\n first {made.first}\n '
        f"last {made.last}\n origfirst {made.first}\n origlast {made.last}\n origset true\n raw true\n "
        f"name {quantity}\n}}\n"
    )


def _literal(name: str) -> str:
    r"""Return a file's name as a script holds it in quotes, so that nothing in it is evaluated.

    Scripts are Tcl, which reads brackets, dollars, quotes and backslashes first. What is left is a knob's text, in
    which Nuke evaluates what stands in brackets, unless they follow a backslash.

    >>> print(_literal("take [3]"), _literal('5$ "a"'))
    take \\\[3\\\] 5\$ \"a\"
    """
    knob = re.sub(r"([\[\]\\])", r"\\\1", name)
    return re.sub(r'([\[\]\\$"])', r"\\\1", knob)


def _group(light: SeenLight) -> str:
    return GROUP.format(
        name=f"light_{re.sub(r'[^A-Za-z0-9_]', '_', light.name)}",
        direction=" ".join(f"{part:.7g}" for part in light.direction),
        colour=" ".join(f"{part:.7g}" for part in light.colour),
    )
