"""The help of a verb as plain lines: an option in one line and what it does beside or below it.

Typer's panels have a column each for long names, short names, names that say no, and values. Where a verb has one long
name, what an option does is left with 18 characters on a terminal of 80, and names of channels are cut.
"""

from collections.abc import Iterable
from typing import Any


def read_plainly(command: Any) -> None:
    """Change a command so that its help is plain lines without Python types; a group keeps its panel of commands."""
    if not hasattr(command, "commands"):
        command.rich_markup_mode = None
    for parameter in command.params:
        if parameter.param_type_name == "argument":
            parameter.display_type_rich = _no_type


def hide_bool(parameters: Iterable[Any]) -> None:
    """Change parameters so that panels show no type beside flags."""
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.metavar = ""


def _no_type(ctx: Any) -> str:
    """Return an empty type for an argument whose name says enough."""
    del ctx
    return ""
