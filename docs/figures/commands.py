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


def commands_page() -> str:
    """Return the page: every command in the order of the work, with what it takes, defaults and examples."""
    parts = [HEAD]
    panel = ""
    for entry in COMMANDS:
        if entry.panel != panel:
            panel = entry.panel
            parts.append(f"## {panel.lstrip('0123456789 ')}\n")
        group: Any = typer.main.get_command(application([entry.name]))
        for path, command in _below(entry.name, group.commands[entry.name]):
            parts.append(_section(path, command))
    return "\n".join(parts)


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
