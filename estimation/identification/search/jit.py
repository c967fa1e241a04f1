"""Compiles this package's plain loops: one decorator, which type checkers see through."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from plant.compiled.native.loops import natively_compiled

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile a loop and the functions it calls to machine code, cached, without the interpreter's lock.

    Sums may be reordered, so that they vectorise; NaN and infinity keep their meaning.

    Parameters
    ----------
    function : callable
        In plain arithmetic on arrays and scalars; its documentation has the arrays' shapes.

    Returns
    -------
    callable
        The same, compiled at its first call.
    """
    return natively_compiled(freely=("reassoc", "contract", "nsz"))(function)
