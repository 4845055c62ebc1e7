"""Help that ends with examples to copy, and completion that loads no more than the command it is asked about."""

import re
import shlex
from collections.abc import Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from psvideo.cli.examples import EXAMPLES
from psvideo.cli.options.panels import MANY, panel_of
from psvideo.errors import nearest

PROGRAM = "psvideo"
MISSING = {
    "rig": "It names the file that says where the lights are, rig.toml: psvideo calibrate mirror-sphere measures them "
    "on a chrome ball.",
    "out": "It names what to write; nothing that exists is replaced without --force.",
}
"""What options that may not be left out are for."""
OTHER_NAMES = {"--preset": "--for", "--output": "--out", "--lights": "--rig"}
"""What other programs, and other commands here, call an option."""
NUMBERS = (
    (r"Input should be a valid integer.*", "expected a whole number"),
    (r"Input should be a valid number.*", "expected a number"),
    (r"Input should be a finite number", "expected a number"),
    (r"Input should be greater than or equal to (\S+)", r"expected \1 or more"),
    (r"Input should be less than or equal to (\S+)", r"expected \1 or less"),
)
"""What pydantic says of a number that is none or out of range, and the same in the words of other messages."""


def examples_of(path: str) -> tuple[tuple[str, str], ...]:
    """Return the examples of a command by its path (``calibrate readout``): what each does, and the line to type."""
    return EXAMPLES.get(path, ())


def _print_examples(context: typer.Context) -> None:
    """Print examples as they are typed: no frame around them and no wrapping, so that they can be copied."""
    path = context.command_path.partition(" ")[2]
    for place, (purpose, line) in enumerate(examples_of(path)):
        print(f"{'' if place else ' Examples'}\n   # {purpose}\n   {line}")


def _take_no_value(params: list[Any]) -> None:
    """Let help show flags without a value; by itself it would say <bool>."""
    for param in params:
        if getattr(param, "is_flag", False):
            param.metavar = ""


def _with_the_nearest(message: str) -> str:
    """Return what is said of a word that is no choice, with the choice that was probably meant.

    >>> _with_the_nearest("Value error, 'nuk' is not one of 'nuke', 'blender'.")
    "'nuk' is not one of 'nuke', 'blender'; did you mean 'nuke'?"
    >>> _with_the_nearest("'a,b' is not one of 'a', 'b'.")
    "'a,b' is not one of 'a', 'b': give the option once for each"
    >>> _with_the_nearest("Input should be greater than or equal to 1")
    'expected 1 or more'
    """
    message = message.removeprefix("Value error, ")
    for pattern, words in NUMBERS:
        message = re.sub(pattern, words, message)
    word, between, listed = message.partition(" is not one of ")
    choices = re.findall("'([^']*)'", listed)
    if "," in word and set(re.split(r"\s*,\s*", word.strip("'"))) <= {*choices}:
        return f"{message.rstrip('.')}: give the option once for each"
    meant = nearest(word.strip("'"), choices) if between else ""
    return f"{message.rstrip('.')}; {meant}" if meant.endswith("?") else message


def _refuse_no_options(args: Sequence[str], known: Set[str]) -> None:
    """Raise where an option is typed under a name that it has elsewhere, or a file's name looks like one; what
    follows ``--`` is no option."""
    typed = args[: args.index("--")] if "--" in args else args
    for name in (word.partition("=")[0] for word in typed):
        meant = OTHER_NAMES.get(name)
        if meant in known and name not in known:
            raise typer.BadParameter(f"there is no option {name}; did you mean {meant}?")
    for word in typed:  # as a shell's * hands them on
        if word.startswith("-") and word.partition("=")[0] not in known and word != "-" and Path(word).exists():
            raise typer.BadParameter(
                f"{word} is a file or folder here, and what begins with - is read as an option; name it "
                f"{shlex.quote(f'./{word}')}."
            )


class Teaching(TyperCommand):
    """A command whose help ends with its examples."""

    def get_params(self, ctx: Any) -> Any:
        """Return the options, where they are many each with the panel it stands in."""
        params: list[Any] = list(super().get_params(ctx))
        _take_no_value(params)
        if len(params) > MANY:
            for param in params:
                if param.param_type_name == "option" and not param.required:
                    param.rich_help_panel = param.rich_help_panel or panel_of(param.name or "")
        return params

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words typed; what a beginner leaves out, or calls by another name, is explained."""
        _refuse_no_options(args, {name for param in self.params for name in param.opts})
        try:
            return list(super().parse_args(ctx, args))
        except typer.BadParameter as fault:
            if not fault.message:  # it is missing
                fault.message = MISSING.get(getattr(fault.param, "name", None) or "", "")
            fault.message = _with_the_nearest(fault.message)
            raise

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help, then the examples."""
        super().format_help(ctx, formatter)
        _print_examples(ctx)


class TeachingGroup(TyperGroup):
    """A group of commands whose help ends with its examples; its commands stand in the order of the work."""

    def get_params(self, ctx: Any) -> Any:
        """Return the options."""
        params: list[Any] = list(super().get_params(ctx))
        _take_no_value(params)
        return params

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help, then the examples."""
        super().format_help(ctx, formatter)
        _print_examples(ctx)


def teach(app: typer.Typer) -> typer.Typer:
    """Give every command of ``app`` and of its groups help with examples; return ``app``."""
    app.info.cls = TeachingGroup
    for command in app.registered_commands:
        command.cls = Teaching
    for group in app.registered_groups:
        group.cls = TeachingGroup
        if group.typer_instance is not None:
            teach(group.typer_instance)
    return app


def words_typed(arguments: Sequence[str], environment: Mapping[str, str]) -> list[str]:
    """Return the words after ``psvideo``, or, where a shell asks what could be typed next, those that it sent along.

    >>> words_typed([], {"_PSVIDEO_COMPLETE": "complete_bash", "COMP_WORDS": "psvideo strobe r"})
    ['strobe', 'r']
    >>> words_typed(["help", "sync"], {})
    ['sync', '--help']
    """
    if "_PSVIDEO_COMPLETE" in environment:
        line = environment.get("COMP_WORDS") or environment.get("_TYPER_COMPLETE_ARGS", "")
        try:
            return shlex.split(line)[1:]
        except ValueError:  # a quotation mark that is not closed yet
            return line.split()[1:]
    if arguments and arguments[0] == "help":
        return [*arguments[1:], "--help"]
    return list(arguments)


def command_called(words: Sequence[str]) -> str:
    """Return the first word that is no option: the command's name, or nothing."""
    return next((word for word in words if not word.startswith("-")), "")
