"""`ProcessModel`: how the state evolves and what the sensors measure, as a filter assumes it.

To add a model, write its step as plain arithmetic on a tuple of scalars and name its states; kernels, Jacobians and
every filter follow from that (`estimation.models.eha_forms` has two examples).
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from math import inf, log
from typing import Any, TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.log_checks.sample_time import ROUNDING, too_far_apart
from estimation.models.gaussian import Gaussian
from plant.compiled.functions import Scalar
from plant.errors import HydrostateError, LogError
from plant.runs import steps_a_sample
from plant.solvers.steps import Parameters

OPENING = "opening_"
"""Prefix of a drive that holds extra variance of a state, added per sample to the process noise, in the filter's units
[dimensionless]; the state's name follows. See `estimation.log_checks.bridging`."""

MOST_SUBSTEPS = 1000
"""Most model steps per sample: beyond that a filter would take forever, and the model has settled within a sample."""

Opening: TypeAlias = Callable[[Any, Mapping[str, Array], float], tuple[Array, Mapping[str, float]]]
"""``opening(parameters, unknown, sample time [s])``: from the variance of each drive within gaps (for position itself,
for others their integral), the variance that each sample adds to some quantity, and the change of the states per unit
of it."""


@dataclass(frozen=True)
class StateVariable:
    """One state of a process model.

    Parameters
    ----------
    name : str
        Name with unit suffix, as in log columns.
    scale : float
        Size of one unit inside the filter, in SI: the filter's numbers are then of order one (errata E10)
        [in the state's unit].
    noise_density : float
        Random-walk intensity of the process noise [state's unit squared a second].
    lower, upper : float
        Physical bounds of the estimate [in the state's unit].
    logarithmic : bool
        Whether the filter works on the logarithm of the state over its scale: the state then stays positive, a factor
        is as near as its inverse, and the noise density is that of the logarithm [1/s].
    """

    name: str
    unit: str
    scale: float
    noise_density: float
    lower: float = -inf
    upper: float = inf
    logarithmic: bool = False

    @property
    def scaled_bounds(self) -> tuple[float, float]:
        """Physical bounds in the filter's units [dimensionless]."""
        if not self.logarithmic:
            return self.lower / self.scale, self.upper / self.scale
        low = log(self.lower / self.scale) if self.lower > 0.0 else -inf
        return low, log(self.upper / self.scale) if self.upper < inf else inf


@dataclass(frozen=True)
class ProcessModel:
    """A process model.

    Parameters
    ----------
    states : tuple of StateVariable
        The states, in the order of the step's tuple.
    step : callable
        ``step(state, (speed at start, speed at end), parameters, h)`` in SI; with several drives, one such pair each.
    observe : callable
        ``observe(state, parameters)``, which returns the predicted value [SI] of each channel that it can predict.
    longest_step : float
        Longest step for which the model is accurate; slower logs have several steps per sample [s].
    drives : tuple of str
        Channels that drive the model; linear between samples.
    parameters : type
        Frozen dataclass of floats that `step` and `observe` read.
    opening : callable, optional
        Effect of gaps in the drives; without it, straight lines across gaps are assumed exact.
    """

    name: str
    states: tuple[StateVariable, ...]
    step: Callable[[Any, Any, Any, Scalar], tuple[Scalar, ...]]
    observe: Callable[[Any, Any], Mapping[str, Scalar]]
    longest_step: float
    drives: tuple[str, ...] = ("motor_speed_rad_s",)
    parameters: type[Parameters] = field(kw_only=True)
    opening: Opening | None = field(default=None, kw_only=True)

    def substeps(self, sample_time: float) -> int:
        """Return the number of model steps that a sample needs.

        Parameters
        ----------
        sample_time : float
            Seconds between samples [s].

        Returns
        -------
        int
            At least 1.

        Raises
        ------
        LogError
            If they are more than `MOST_SUBSTEPS`.
        """
        if sample_time > (1.0 + ROUNDING) * (slowest := MOST_SUBSTEPS * self.longest_step):
            raise LogError(too_far_apart(sample_time, slowest))
        return steps_a_sample(sample_time, self.longest_step)

    @property
    def width(self) -> int:
        """Count of states."""
        return len(self.states)

    def to_filter(self, belief: Gaussian) -> Gaussian:
        """Return a belief in the filter's units.

        Parameters
        ----------
        belief : Gaussian
            In SI; a logarithmic state's deviation is taken relative to its mean.

        Raises
        ------
        HydrostateError
            If a logarithmic state's mean is not positive.
        """
        mean = belief.mean.copy()
        slope = np.array([state.scale for state in self.states])
        for i, state in enumerate(self.states):
            if state.logarithmic:
                if mean[i] <= 0.0:
                    raise HydrostateError(f"the first guess of {state.name} must be positive, got {mean[i]}")
                slope[i], mean[i] = mean[i], log(mean[i] / state.scale)
            else:
                mean[i] /= state.scale
        return Gaussian(mean, belief.covariance / np.outer(slope, slope))

    def to_si(self, mean: Array) -> tuple[Array, Array]:
        """Return states in SI, and their change per unit of the filter's number.

        Parameters
        ----------
        mean : ndarray, shape (..., n)
            States in the filter's units [dimensionless].

        Returns
        -------
        tuple of ndarray, each shape (..., n)
            The states, and the slopes that turn the filter's standard deviations into SI.
        """
        scale = np.array([state.scale for state in self.states])
        rising = np.array([state.logarithmic for state in self.states])
        with np.errstate(over="ignore", invalid="ignore"):  # a diverging filter overflows, and must show it
            grown = scale * np.exp(np.where(rising, mean, 0.0))
            return np.where(rising, grown, scale * mean), grown

    @property
    def noise_units(self) -> Array:
        """Units of the filter's process-noise densities, shape (n,) [SI squared; 1 of a logarithm]."""
        return np.array([1.0 if state.logarithmic else state.scale**2 for state in self.states])

    def noise_densities(self, noise: Mapping[str, float] | None) -> Array:
        """Return process-noise densities in the filter's units.

        Parameters
        ----------
        noise : Mapping[str, float] or None
            Densities that replace the model's, by state name [SI squared a second]; of a logarithmic state, those of
            the logarithm [1/s].

        Returns
        -------
        ndarray, shape (n,)
            One a state [1/s].
        """
        given = noise or {}
        return np.array([given.get(state.name, state.noise_density) for state in self.states]) / self.noise_units

    def require_drives(self, record: Collection[str]) -> None:
        """Refuse a record that lacks what drives the model.

        Parameters
        ----------
        record : collection of str
            The record, or the names of its channels.

        Raises
        ------
        LogError
            If it lacks a drive.
        """
        missing = [drive for drive in self.drives if drive not in record]
        if missing:
            wanted = ", ".join(self.drives)
            raise LogError(f"the {self.name} form needs {wanted}; the log has no {' and no '.join(missing)}")

    def index(self, name: str) -> int:
        """Return the position of a state.

        Raises
        ------
        KeyError
            If the model has no such state.
        """
        for i, state in enumerate(self.states):
            if state.name == name:
                return i
        raise KeyError(f"{self.name} has no state {name!r}, it has {[state.name for state in self.states]}")
