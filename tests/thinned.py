"""`thinned(cases, fast)`: some cases of a test run with the fast tests, all of them with the slow ones."""

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def thinned(cases: Iterable[Any], fast: Collection[Any]) -> list[Any]:
    """Return cases for `pytest.mark.parametrize`; those that are not ``fast`` run only in `make test-slow`.

    Parameters
    ----------
    cases : iterable
        Values of one parameter that all show the same claim.
    fast : collection
        The cases that `make test` runs.

    Returns
    -------
    list
        The cases in their order.

    Raises
    ------
    ValueError
        If a fast case is none of the cases.
    """
    every = list(cases)
    if unknown := [case for case in fast if case not in every]:
        raise ValueError(f"none of the cases: {unknown}")
    slow = pytest.mark.slow
    return [
        case if case in fast else pytest.param(*case if isinstance(case, tuple) else (case,), marks=slow)
        for case in every
    ]
