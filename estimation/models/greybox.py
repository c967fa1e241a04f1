"""Grey-box models: physics with unknown parameters, to be fitted to a log.

`estimation.fits.greybox.loops` predicts a log with exact sensitivities, `estimation.fits.greybox.fit` finds the
unknowns.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.arrays import Array
from plant.compiled.functions import Scalar
from plant.solvers.steps import Parameters


@dataclass(frozen=True)
class GreyBoxModel:
    """A model whose unknown parameters are fitted to a log.

    Unknowns are fitted as logarithms: they stay positive, and a start that is wrong by a factor is as near as one that
    is wrong by its inverse. One that may be negative is fitted in units of a typical size.

    Parameters
    ----------
    drives : tuple of str
        Channels that drive the model; linear between samples.
    initial : callable
        ``initial(parameters)``: the state before the first sample, in SI.
    rates : callable
        ``rates(state, drives, parameters, share)`` in SI per second. Drives has each channel's value at start and end
        of a step, then the step's length [s]; share is the elapsed part of the step [fraction].
    observe : callable
        ``observe(state)``: the predicted outputs in SI.
    parameters : type
        Frozen dataclass of numbers that the functions read beside the unknowns, which may be fields of it.
    linear : tuple of (str, float)
        The unknowns that may be negative, each with a typical size in SI.
    jump : tuple of float
        Change of the state in SI per unit of what a gap in the drives leaves unknown; empty if the model allows no
        gaps.
    stiff : bool
        Whether steps are implicit, since rates become stiff within one, as when a valve of a small chamber opens.
    """

    name: str
    drives: tuple[str, ...]
    outputs: tuple[str, ...]
    unknowns: tuple[str, ...]
    initial: Callable[[Any], tuple[Scalar, ...]]
    rates: Callable[[Any, Any, Any, Scalar], tuple[Scalar, ...]]
    observe: Callable[[Any], tuple[Scalar, ...]]
    parameters: type[Parameters]
    linear: tuple[tuple[str, float], ...] = ()
    jump: tuple[float, ...] = ()
    stiff: bool = False

    def theta(self, values: Mapping[str, float]) -> Array:
        """Return the fitted coordinates of the unknowns.

        Parameters
        ----------
        values : Mapping[str, float]
            The unknowns in SI.

        Returns
        -------
        ndarray, shape (unknowns,)
            Logarithms, or multiples of the typical size [dimensionless].
        """
        sizes = dict(self.linear)
        return np.array(
            [values[name] / sizes[name] if name in sizes else np.log(values[name]) for name in self.unknowns]
        )

    def values(self, theta: Array) -> Mapping[str, float]:
        """Return the unknowns from their fitted coordinates.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Logarithms, or multiples of the typical size [dimensionless].

        Returns
        -------
        Mapping[str, float]
            The unknowns in SI.
        """
        sizes = dict(self.linear)
        return {
            name: float(t * sizes[name] if name in sizes else np.exp(t))
            for name, t in zip(self.unknowns, theta, strict=True)
        }
