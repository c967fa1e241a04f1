"""The help of a verb as plain lines: each option on one line, with its description beside or below it.

Typer's panels have separate columns for long names, short names, negated names, and values. If one option has a long
name, descriptions have only 18 of 80 characters on a terminal, and names of channels are cut.
"""

from collections.abc import Iterable
from typing import Any


def use_plain_help(command: Any) -> None:
    """Change a command so that its help is plain lines without Python types; a group keeps its panel of commands."""
    if not hasattr(command, "commands"):
        command.rich_markup_mode = None
    for parameter in command.params:
        if parameter.param_type_name == "argument":
            parameter.display_type_rich = _no_type


def hide_bool(parameters: Iterable[Any]) -> None:
    """Change parameters so that help panels show no type for flags."""
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""


def _no_type(ctx: Any) -> str:
    """Return an empty type for an argument whose name is clear enough."""
    del ctx
    return ""
