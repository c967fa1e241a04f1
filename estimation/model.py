"""`ProcessModel`: what a filter believes about how the state moves and what the sensors see.

To add a model, write its step as plain arithmetic on a tuple of scalars and name its states; kernels, Jacobians and
every filter follow from that (`estimation.eha` has two examples).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, inf
from typing import Any

from plant.compiled.functions import Scalar
from plant.integrate import StepFunction


@dataclass(frozen=True)
class StateVariable:
    """One state of a process model.

    Parameters
    ----------
    name : str
        Name with unit suffix, as in log columns.
    unit : str
        SI unit.
    scale : float
        Size of one unit inside the filter, in SI: the filter's numbers are then of order one (errata E10)
        [in the state's unit].
    noise_density : float
        Random-walk intensity of the process noise [state's unit squared a second].
    lower, upper : float
        Physical bounds that the estimate is held to [in the state's unit].
    """

    name: str
    unit: str
    scale: float
    noise_density: float
    lower: float = -inf
    upper: float = inf


@dataclass(frozen=True)
class ProcessModel:
    """A process model.

    Parameters
    ----------
    name : str
        Name in reports and JSON.
    states : tuple of StateVariable
        The states, in the order of the step's tuple.
    step : callable
        ``step(state, (speed at start, speed at end), parameters, h)`` in SI.
    observe : callable
        ``observe(state, parameters)``, which returns the predicted value [SI] of each channel that it can predict.
    longest_step : float
        Longest step that the model takes well; slower logs are sub-stepped [s].
    """

    name: str
    states: tuple[StateVariable, ...]
    step: StepFunction
    observe: Callable[[Any, Any], Mapping[str, Scalar]]
    longest_step: float

    def substeps(self, sample_time: float) -> int:
        """Return how many steps of the model a sample needs.

        Parameters
        ----------
        sample_time : float
            Seconds between samples [s].

        Returns
        -------
        int
            At least 1.
        """
        return max(1, ceil(sample_time / self.longest_step - 1e-9))

    @property
    def width(self) -> int:
        """Count of states."""
        return len(self.states)

    def index(self, name: str) -> int:
        """Return the position of a state.

        Parameters
        ----------
        name : str
            State name.

        Returns
        -------
        int
            Its index.

        Raises
        ------
        KeyError
            If the model has no such state.
        """
        for i, state in enumerate(self.states):
            if state.name == name:
                return i
        raise KeyError(f"{self.name} has no state {name!r}, it has {[state.name for state in self.states]}")
