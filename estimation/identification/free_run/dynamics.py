"""Dynamics of a model in the data's scale: what each kind must offer, and what those of output error share."""

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
        """Return the free run, shape (n,), from the state that suits the outputs that are there best."""
        ...

    def one_step(self, u: Array, y: Array) -> Array:
        """Return the prediction one step ahead, shape (n,)."""
        ...

    def unanswered(self, length: int) -> int:
        """Return how many first outputs of a log of some length [samples] respond to inputs from before it."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        ...


class OutputErrorDynamics(ABC):
    """Dynamics whose noise is the output sensor's: what was measured before says nothing of the next sample."""

    def unanswered(self, length: int) -> int:
        """Return how many first outputs of a log of some length [samples] respond to inputs from before it.

        None do, unless a class says otherwise.
        """
        del length
        return 0

    @abstractmethod
    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, its initial state by least squares of the outputs that are there.

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
