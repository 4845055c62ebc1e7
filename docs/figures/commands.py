"""Make docs/commands.md from the commands themselves: ``python -m docs.figures.commands``."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from psvideo.cli.app import application
from psvideo.cli.examples import EXAMPLES
from psvideo.cli.first_screen import COMMANDS

PAGE = Path(__file__).resolve().parents[1] / "commands.md"
HEAD = """# Commands

Made from the commands themselves (`python -m docs.figures.commands`); `--help` says the same in a terminal.

Each command reads what the one before wrote, and does by itself what was left out. Outputs appear whole or not at
all, and footage is never touched. `--force` replaces what a command wrote before, `--json` prints one JSON object on
standard output and nothing else, `-v` says more and `-q` nothing but errors. Progress, warnings and errors go to
standard error, in colour only on a terminal and not where `NO_COLOR` is set.

| exit status | meaning |
|---|---|
| 0 | done |
| 1 | a fault of footage or run, a stopped run, or what does not fit, is missing or bad (`check`, `info`, `doctor`) |
| 2 | wrong usage |

**Completion.** `psvideo --install-completion` adds it to the shell you are in (bash, zsh, fish). Where the shell is not
recognised, put one of these lines into its start file:

```
eval "$(_PSVIDEO_COMPLETE=source_bash psvideo)"       # ~/.bashrc
eval "$(_PSVIDEO_COMPLETE=source_zsh psvideo)"        # ~/.zshrc
_PSVIDEO_COMPLETE=source_fish psvideo | source        # ~/.config/fish/config.fish
```

Besides commands and options it knows the lights of the plan that is named before (`--first-light`, `--line`), cameras,
transfer curves, boards and ports.
"""

TASK_HEAD = """## What to type for what

| you want to | type |
|---|---|"""
TASKS = {
    "capture-plan": "plan a shoot: frame rate, lights, flashes",
    "strobe list": "find the light controller",
    "strobe check": "know whether a board can play a plan",
    "strobe run": "flash the lights for a take",
    "strobe stop": "have all lights dark, now",
    "strobe emulate": "try the controller without a board",
    "calibrate mirror-sphere": "know where the lights are, from a chrome ball",
    "calibrate matte-sphere": "the same from a matte ball, with their strengths",
    "calibrate flat-field": "know how strong the lights are, from white paper",
    "calibrate colours": "know what the camera sees of coloured LEDs",
    "calibrate intensities": "correct strengths from the scene itself",
    "calibrate guess": "begin without any calibration",
    "calibrate convert": "hand lights on to another program, or read its list",
    "calibrate readout": "measure how long the camera takes to read a frame",
    "live": "see normals while the camera runs",
    "check": "know on the set whether a take can be used",
    "info": "know what a file or folder is, and whether it fits its plan",
    "sync": "find when every flash fired",
    "split": "get one picture sequence per light",
    "normals": "get normals and albedo from a take",
    "farm": "solve on a render farm",
    "stills": "get normals and albedo from photographs, one per light",
    "view": "look at a result, and relight it",
    "doctor": "know whether all is installed, and how fast this machine is",
    "demo": "see the whole chain without a camera",
    "synth": "film a virtual scene of your own",
}
"""What a user wants, by command; the line to type is the command's first example."""


def commands_page() -> str:
    """Return the page: what to type for what, then every command in the order of the work, with what it takes, defaults
    and examples."""
    tasks, sections, panel = list[str](), list[str](), ""
    for entry in COMMANDS:
        if entry.panel != panel:
            panel = entry.panel
            tasks.append(f"| **{_title(panel)}** | |")
            sections.append(f"## {_title(panel)}\n")
        group: Any = typer.main.get_command(application([entry.name]))
        for path, command in _below(entry.name, group.commands[entry.name]):
            if path in TASKS:
                tasks.append(f"| {TASKS[path]} | [`{_cell(EXAMPLES[path][0][1])}`](#{path.replace(' ', '-')}) |")
            sections.append(_section(path, command))
    return "\n".join([HEAD, TASK_HEAD, *tasks, "", *sections])


def _title(panel: str) -> str:
    return panel.lstrip("0123456789 ")


def _below(path: str, command: Any) -> Iterator[tuple[str, Any]]:
    yield path, command
    for name, one in getattr(command, "commands", {}).items():
        yield from _below(f"{path} {name}", one)


def _section(path: str, command: Any) -> str:
    context = command.make_context(path, [], resilient_parsing=True)
    arguments = [one for one in command.params if one.param_type_name == "argument"]
    options = [one for one in command.get_params(context) if one.param_type_name == "option" and one.name != "help"]
    needed = (_names(one, context).split(", ")[0].strip("`") for one in options if one.required)
    usage = " ".join(["psvideo", path, *(_metavar(one) for one in arguments), *needed])
    lines = [f"### {path}\n", f"{' '.join((command.help or '').split())}\n", f"```\n{usage}\n```\n"]
    if arguments or options:
        lines += ["| | what | default |", "|---|---|---|"]
        lines += [f"| `{_metavar(one)}` | {_cell(one.help)} | |" for one in arguments]
        lines += [f"| {_names(one, context)} | {_cell(one.help)} | {_default(one)} |" for one in options]
        lines.append("")
    examples = [f"# {purpose}\n{line}" for purpose, line in EXAMPLES[path]]
    return "\n".join([*lines, "```\n" + "\n\n".join(examples) + "\n```\n"])


def _metavar(argument: Any) -> str:
    name = str(argument.name).upper()
    return f"{name}…" if argument.nargs == -1 else name


def _names(option: Any, context: Any) -> str:
    kind = "" if option.is_flag else " " + option.display_type(context).strip("<>").replace("|", "\\|")
    named = ", ".join(f"`{name}{kind if name.startswith('--') else ''}`" for name in reversed(option.opts))
    return " / ".join([named, *(f"`{name}`" for name in option.secondary_opts)])


def _default(option: Any) -> str:
    if option.required:
        return "must be given"
    value = option.default
    if value is None or value is False or value == "" or callable(value):
        return ""
    return "on" if value is True else f"`{getattr(value, 'value', value)}`"


def _cell(text: str | None) -> str:
    return " ".join((text or "").split()).replace("|", "\\|")


if __name__ == "__main__":
    PAGE.write_text(commands_page(), encoding="utf-8")
