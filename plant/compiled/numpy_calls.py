"""NumPy's functions on symbols: a model written with ``np.sin`` and ``np.where`` is traced like one of ours.

NumPy passes on calls that it cannot compute itself (NEP 13 and 18). Every function through which a graph can be
differentiated has an entry here; every other is refused by name.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from plant.compiled import functions
from plant.compiled.expression import Expression
from plant.errors import ModelError

Function = Callable[..., Any]


def _tan(x: Any) -> Any:
    return functions.sin(x) / functions.cos(x)


def _sinh(x: Any) -> Any:
    return 0.5 * (functions.exp(x) - functions.exp(-x))


def _cosh(x: Any) -> Any:
    return 0.5 * (functions.exp(x) + functions.exp(-x))


def _clip(x: Any, least: Any = None, most: Any = None) -> Any:
    x = x if least is None else functions.maximum(x, least)
    return x if most is None else functions.minimum(x, most)


def _power(x: Any, exponent: Any) -> Any:
    return x**exponent


UFUNCS: Mapping[Any, Function] = {
    np.add: lambda a, b: a + b,
    np.subtract: lambda a, b: a - b,
    np.multiply: lambda a, b: a * b,
    np.divide: lambda a, b: a / b,
    np.negative: lambda a: -a,
    np.positive: lambda a: a,
    np.less: lambda a, b: a < b,
    np.less_equal: lambda a, b: a <= b,
    np.greater: lambda a, b: a > b,
    np.greater_equal: lambda a, b: a >= b,
    np.absolute: abs,
    np.fabs: abs,
    np.sign: functions.sign,
    np.square: lambda a: a * a,
    np.power: _power,
    np.float_power: _power,
    np.sqrt: functions.sqrt,
    np.exp: functions.exp,
    np.log: functions.log,
    np.sin: functions.sin,
    np.cos: functions.cos,
    np.tan: _tan,
    np.arctan: functions.arctan,
    np.tanh: functions.tanh,
    np.sinh: _sinh,
    np.cosh: _cosh,
    np.minimum: functions.minimum,
    np.maximum: functions.maximum,
}
"""NumPy's element-wise functions, and ours."""

CHOICES: Mapping[Any, Function] = {np.where: functions.where, np.clip: _clip}
"""Likewise, for functions that are not element-wise ufuncs."""

SUPPORTED = "abs, sign, sqrt, square, exp, log, sin, cos, tan, arctan, sinh, cosh, tanh, minimum, maximum, clip, where"
"""Names of the functions that a model may call, besides arithmetic and comparisons."""


def elementwise_call(function: Any, method: str, arguments: Sequence[Any], options: Mapping[str, Any]) -> Expression:
    """Return an element-wise function of NumPy on symbols.

    Parameters
    ----------
    function : numpy.ufunc
        The function.
    method : str
        Method of the call; only ``"__call__"`` is supported.
    arguments, options : sequence, Mapping
        Its arguments.

    Raises
    ------
    ModelError
        If it is not one of `SUPPORTED`.

    Examples
    --------
    >>> from plant.compiled.expression import symbol
    >>> np.sin(symbol("x")).operation, np.maximum(2.0, symbol("x")).operation
    ('sin', 'where')
    """
    if function not in UFUNCS or method != "__call__" or options:
        raise ModelError(_refusal(function))
    return UFUNCS[function](*map(_plain_number, arguments))


def function_call(function: Any, arguments: Sequence[Any], options: Mapping[str, Any]) -> Expression:
    """Return another function of NumPy on symbols.

    Parameters
    ----------
    function : callable
        The function.
    arguments, options : sequence, Mapping
        Its arguments.

    Raises
    ------
    ModelError
        If it is not one of `SUPPORTED`.
    """
    if function not in CHOICES or options:
        raise ModelError(_refusal(function))
    return CHOICES[function](*map(_plain_number, arguments))


def _plain_number(argument: Any) -> Any:
    """Return a plain number in place of NumPy's own scalar."""
    if isinstance(argument, np.ndarray):
        if argument.ndim:
            raise ModelError(f"a model computes with single numbers, got an array of shape {argument.shape}")
        argument = argument.item()
    return argument.item() if isinstance(argument, np.generic) else argument


def _refusal(function: Any) -> str:
    name = getattr(function, "__name__", str(function))
    return f"np.{name} cannot be traced; a model may call {SUPPORTED}, one number at a time"
