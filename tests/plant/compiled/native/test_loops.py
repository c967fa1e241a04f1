"""A loop of a module is compiled at its first call, with all functions that it calls and constants that it reads."""

from types import FunctionType
from typing import Any

import numpy as np
import pytest

from plant.compiled.native.loops import Loop, dependencies, natively_compiled, text_of

SHARE = 0.25


@natively_compiled()
def halved(x: float) -> float:
    """Return a share.

    Parameters
    ----------
    x : float
        A number.
    """
    return SHARE * x


@natively_compiled()
def summed(values: Any) -> float:
    """Return the sum of shares.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Numbers.
    """
    total = 0.0
    for k in range(values.size):
        total += halved(values[k])
    return total


def elsewhere(loop: Loop[..., Any], **names: Any) -> Loop[..., Any]:
    """Return a loop as it would be in a module in which some names have another meaning."""
    function: Any = loop.__wrapped__
    return Loop(FunctionType(function.__code__, {**function.__globals__, **names}, function.__name__), ())


def test_a_loop_is_compiled_with_the_loops_it_calls_and_the_constants_it_reads() -> None:
    values = np.array([1.0, 2.0, 5.0])
    assert [summed(values), summed(2.0 * values)] == [2.0, 4.0]
    loops, constants = dependencies(summed)
    assert ([one.__wrapped__.__name__ for one in loops], constants) == (["halved", "summed"], {"SHARE": 0.25})
    assert "SHARE = 0.25" in text_of(summed)


@natively_compiled()
def both(x: float) -> float:
    """Return a sum; ``other`` is another module's.

    Parameters
    ----------
    x : float
        A number.
    """
    return halved(x) + other(x) + SHARE


other: Any = None


def test_two_loops_or_two_constants_of_one_name_are_refused() -> None:
    with pytest.raises(NameError, match="two loops are named halved"):
        dependencies(elsewhere(both, other=elsewhere(halved)))
    with pytest.raises(NameError, match="two constants are named SHARE"):
        dependencies(elsewhere(both, other=halved, SHARE=0.5))
