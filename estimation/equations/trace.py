"""Calls a user's functions with symbols, and explains what is wrong with them if that fails."""

from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np

from plant.compiled.expression import Expression, as_expression
from plant.compiled.numpy_calls import SUPPORTED
from plant.errors import HydrostateError


class Named:
    """Parameters by name, as a user's functions read them.

    Parameters
    ----------
    values : Mapping[str, Any]
        Their values [each its unit], or symbols.
    """

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        near = get_close_matches(name, list(self.__dict__), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise HydrostateError(f"parameter {name!r} is read, but not among {', '.join(self.__dict__)}{hint}")


def grouped(kind: str, names: Sequence[str], values: Sequence[Any]) -> Any:
    """Return values as a tuple whose elements also have names.

    Parameters
    ----------
    kind : str
        Kind of values, for messages.
    names, values : sequence
        One name for each value.

    Examples
    --------
    >>> grouped("State", ["angle", "speed"], [1.0, 2.0]).speed
    2.0
    """
    return namedtuple(kind, names)(*values)  # pyright: ignore[reportUntypedNamedTuple] -- the names are the user's


def traced(
    what: str,
    function: Callable[[Any, Any, Any], Any],
    wanted: Sequence[str],
    state: Any,
    inputs: Any,
    parameters: Named,
) -> list[Expression]:
    """Return the outputs of a user's function as expressions.

    Parameters
    ----------
    what : str
        Name of the function: ``"derivative"``.
    wanted : sequence of str
        Names of the values it returns.

    Raises
    ------
    HydrostateError
        If it fails on symbols, or returns another count.
    """
    name = f"{what} {getattr(function, '__name__', '')!r}"
    try:
        result = function(state, inputs, parameters)
    except TypeError as error:
        said = str(error)
        if "Expression" in said:  # the message of math functions and float for a symbol
            said = f"{said.replace('Expression', 'a symbol')}; it may call NumPy's {SUPPORTED}, and no function of math"
        raise HydrostateError(f"{name} cannot be traced: {said}") from error
    except HydrostateError as error:
        raise HydrostateError(f"{name}: {error.message}") from None
    except AttributeError as error:
        known = getattr(error.obj, "_fields", None)
        if known is None:
            raise HydrostateError(f"{name} fails: {error}") from error
        kind = "state" if type(error.obj).__name__ == "State" else "input"
        raise HydrostateError(f"{name} reads {kind} {error.name!r}, which is none of {', '.join(known)}") from None
    except Exception as error:
        raise HydrostateError(f"{name} fails: {type(error).__name__}: {error}") from error
    listed: list[Any] = list(result) if isinstance(result, tuple | list | np.ndarray) else [result]
    if len(listed) != len(wanted):
        raise HydrostateError(
            f"{name} must return {len(wanted)} values, one for each of {', '.join(wanted)}, got {len(listed)}"
        )
    return [_number(name, one, value) for one, value in zip(wanted, listed, strict=True)]


def _number(name: str, of: str, value: Any) -> Expression:
    if isinstance(value, Expression):
        if value.operation in ("<", "<=", ">", ">="):
            raise HydrostateError(f"{name} must return numbers, got a comparison for {of}: use np.where")
        return value
    try:
        return as_expression(float(value))
    except (TypeError, ValueError):
        raise HydrostateError(f"{name} must return numbers, got {value!r} for {of}") from None
