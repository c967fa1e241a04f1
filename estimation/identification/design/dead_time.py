"""Dead time: the number of samples before the output responds."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from estimation.identification.fit.fitted import Task
from estimation.identification.fit.output_error import descend_from
from estimation.identification.search.criterion import Structure
from estimation.identification.search.pole_search import banded_spectra, search_poles
from plant.errors import HydrostateError

TRIED = 6
"""Delays that are compared on the data, after a search in the frequency domain."""

STEPS = 60
"""Evaluations a delay."""


def estimate_delay(u: ArrayLike, y: ArrayLike, *, n_numerator: int = 2, n_denominator: int = 2, most: int = 20) -> int:
    """Return the dead time with which an output-error model of a given size fits best.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input, no gaps; output, NaN where missing.
    most : int
        Longest delay considered [samples].

    Returns
    -------
    int
        Dead time [samples].

    Raises
    ------
    HydrostateError
        As `fit_output_error`.

    Examples
    --------
    >>> u = np.sign(np.sin(0.05 * np.arange(400) ** 1.3))
    >>> estimate_delay(u, np.roll(u, 3) * (np.arange(400) > 2), n_numerator=1, n_denominator=1)
    3
    """
    if most < 0:
        raise HydrostateError(f"most must be at least 0, got {most}")
    form = Structure(n_numerator, n_denominator, most)
    data = Task(form, 1.0, "white", ("input", "output")).experiments(u, y)
    data = replace(data, used=data.used & (np.arange(data.u.size) >= form.n_states))
    spectra = banded_spectra(data.bridged())
    coarse = [
        search_poles(Structure(n_numerator, n_denominator, delay), spectra, data.u.size) for delay in range(most + 1)
    ]
    order = np.argsort([costs[0] for costs, _ in coarse], kind="stable")[:TRIED]
    exact = {
        int(delay): min(
            descend_from(Structure(n_numerator, n_denominator, int(delay)), theta, data, STEPS)[0]
            for theta in coarse[delay][1][:3]
        )
        for delay in order
    }
    return min(exact, key=lambda delay: (exact[delay], delay))
