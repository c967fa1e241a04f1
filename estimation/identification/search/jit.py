"""How the plain loops of this package are compiled: one decorator, typed as if it were not there."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numba

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile a loop to machine code, cached beside its file, without holding the interpreter's lock.

    Sums may be reordered, so that they vectorise; NaN and infinity keep their meaning. Numba does not notice a
    change in a function that a cached one calls in another file: a compiled function calls its own file only.

    Parameters
    ----------
    function : callable
        In plain arithmetic on arrays and scalars.

    Returns
    -------
    callable
        The same, compiled at its first call.
    """
    decorate = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})
    return decorate(function)
