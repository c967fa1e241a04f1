"""Dynamics of a model in the data's scale: the interface of every kind, and what output-error models share."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Protocol

from estimation.arrays import Array


class Dynamics(Protocol):
    """Interface of a structure that can be simulated, judged and saved."""

    kind: ClassVar[str]

    @property
    def n_values(self) -> int:
        """Fitted coefficients."""
        ...

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, shape (n,), from the initial state that fits the available outputs best."""
        ...

    def one_step(self, u: Array, y: Array) -> Array:
        """Return the prediction one step ahead, shape (n,)."""
        ...

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of a given length [samples] depend on inputs from before it."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        ...


class OutputErrorDynamics(ABC):
    """Dynamics with noise of the output sensor only: past measurements do not improve the next prediction."""

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of a given length [samples] depend on inputs from before it.

        None, unless a class overrides it.
        """
        del length
        return 0

    @abstractmethod
    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, with its initial state by least squares of the available outputs.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        ndarray, shape (n,)
            Output, scaled.
        """

    def one_step(self, u: Array, y: Array) -> Array:
        """Return the prediction one step ahead, which is the free run.

        Parameters
        ----------
        u : ndarray, shape (n, m)
            Inputs, scaled.
        y : ndarray, shape (n,)
            Output, scaled; NaN where missing.

        Returns
        -------
        ndarray, shape (n,)
            Output, scaled.
        """
        return self.run(u, y)
