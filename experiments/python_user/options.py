"""Options of verbs, as a Python user gives them."""

from collections.abc import Mapping
from dataclasses import fields
from numbers import Real
from typing import Any

from experiments.python_user.answers import no_such, refuse


def known_options(options: Mapping[str, Any], known: Mapping[str, Any], verb: str) -> Mapping[str, Any]:
    """Return the options if the verb has each of them, and each has the type of its default.

    Parameters
    ----------
    options, known : Mapping[str, Any]
        The given options, and all options with their defaults.

    Raises
    ------
    HydrostateError
        If one is unknown, or of another type.
    """
    for name, value in options.items():
        if name not in known:
            refuse(no_such(verb, name, list(known)))
        default = known[name]
        counts = isinstance(default, int) and not isinstance(default, bool)
        if (counts or isinstance(default, float)) and (isinstance(value, bool) or not isinstance(value, Real)):
            refuse(f"{name} must be a number, got {value!r:.80}")
        if isinstance(default, str) and not isinstance(value, str):
            refuse(f"{name} must be a text{f' such as {default!r}' if default else ''}, got {value!r:.80}")
        if isinstance(default, bool) and not isinstance(value, bool) and type(value).__name__ not in ("bool", "bool_"):
            refuse(f"{name} must be True or False, got {value!r:.80}")
    return options


def refuse_entries(options: Mapping[str, Any], known: Mapping[str, Any], parameters: type[Any]) -> None:
    """Refuse options that are entries of a rig, and say where they belong.

    Parameters
    ----------
    options, known : Mapping[str, Any]
        The given options, and all options with their defaults.
    parameters : type
        Class of the actuator's parameters.

    Raises
    ------
    HydrostateError
        If one is a parameter of the actuator.
    """
    for name in options.keys() & {one.name for one in fields(parameters)} - known.keys():
        refuse(
            f"{name} is a parameter of the actuator: give it in a rig file, or as "
            f"rig=replace(rig, parameters=replace(rig.parameters, {name}=...)) with replace of dataclasses"
        )
