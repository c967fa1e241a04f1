"""The least-squares problem of a user's equations and one log or several."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.equations.definition import Equations, Parameter
from estimation.equations.kernel import compile_equations
from estimation.fits.greybox.descent import Point
from plant.errors import HydrostateError, LogError
from plant.log.record import Record

OUTLIER = 3.0
"""Residuals beyond this many standard deviations count linearly in a robust fit (Huber 1964) [dimensionless]."""

Bounds: TypeAlias = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class Part:
    """One log in the form that a fit uses.

    Parameters
    ----------
    inputs : ndarray, shape (n, inputs)
        Inputs [their units], no sample missing; a column of zeros if there is no input.
    measured : ndarray, shape (outputs, n)
        Outputs [their units]; NaN is missing.
    sample_time : float
        Seconds between samples [s].
    """

    inputs: Array
    measured: Array
    sample_time: float


def part_of(equations: Equations, record: Record) -> Part:
    """Return a log in the form that a fit of these equations uses.

    Raises
    ------
    LogError
        If a channel is missing, an input has gaps, or an output has no samples.
    """
    for name in (*equations.inputs, *equations.outputs):
        if name not in record:
            raise LogError(f"channel {name!r} is needed; the log has {', '.join(record)}")
    for name in equations.inputs:
        lost = np.flatnonzero(~np.isfinite(record[name]))
        if len(lost):
            raise LogError(
                f"input {name!r} must be a number at every sample, got {len(lost)} of {len(record)} that are none, the "
                f"first at {record.time[lost[0]]:g} s: fill them in, or cut the log there"
            )
    for name in equations.outputs:
        values = record[name]
        if np.isinf(values).any():
            raise LogError(f"output {name!r} must be finite or missing (NaN), got infinite values")
        if np.count_nonzero(np.isfinite(values)) < 2:
            raise LogError(
                f"output {name!r} must have two samples or more, got {np.count_nonzero(np.isfinite(values))}"
            )
    inputs = [record[name] for name in equations.inputs] or [np.zeros(len(record))]
    measured = [record[name] for name in equations.outputs]
    return Part(np.column_stack(inputs), np.array(measured), record.sample_time)


@dataclass(frozen=True, eq=False)
class Problem:
    """Equations and logs, the steps of the equations, and the assumed noise of each output.

    Parameters
    ----------
    parts : tuple of Part
        The logs.
    scheme, substeps : str, int
        One of `estimation.equations.kernel.SCHEMES`, and its number of steps from sample to sample.
    noise : ndarray, shape (outputs,)
        Standard deviation of each output's noise [its unit].
    robust : bool
        Whether residuals beyond `OUTLIER` deviations count linearly.
    """

    equations: Equations
    parts: tuple[Part, ...]
    scheme: str
    substeps: int
    noise: Array
    robust: bool = False

    def with_noise(self, noise: Array) -> "Problem":
        """Return the same problem with other noise.

        Parameters
        ----------
        noise : ndarray, shape (outputs,)
            Standard deviations [its unit each].
        """
        return replace(self, noise=noise)

    @cached_property
    def unknowns(self) -> tuple[Parameter, ...]:
        """All fitted quantities: the parameters, then the free initial states of every log."""
        first = [
            Parameter(start_of(self.equations, name, part), _bounds_of(self.equations, name))
            for part in self.parts
            for name in self.equations.free
        ]
        return (*self.equations.parameters.values(), *first)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns; those of initial states are in words."""
        several = len(self.parts) > 1
        first = [
            f"initial {name}" + (f" of log {number}" if several else "")
            for number in range(1, len(self.parts) + 1)
            for name in self.equations.free
        ]
        return (*self.equations.parameters, *first)

    def coordinates(self, values: Array) -> Array:
        """Return the coordinates in which the unknowns are searched.

        Parameters
        ----------
        values : ndarray, shape (unknowns,)
            Each in its unit.

        Returns
        -------
        ndarray, shape (unknowns,)
            Logarithms, or multiples of a typical size [dimensionless].
        """
        return np.array(
            [np.log(v) if one.logarithmic else v / one.size for v, one in zip(values, self.unknowns, strict=True)]
        )

    def values(self, theta: Array) -> Array:
        """Return the unknowns from their coordinates.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Coordinates [dimensionless].

        Returns
        -------
        ndarray, shape (unknowns,)
            Each in its unit.
        """
        return np.array(
            [np.exp(t) if one.logarithmic else t * one.size for t, one in zip(theta, self.unknowns, strict=True)]
        )

    @property
    def bounds(self) -> Bounds:
        """Least and largest coordinates [dimensionless], shape (unknowns,) each."""
        low, high = (np.array([one.bounds[end] for one in self.unknowns]) for end in (0, 1))
        return self.coordinates(low), self.coordinates(high)

    def predicted(self, theta: Array) -> list[Array]:
        """Return the outputs that the equations predict.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Coordinates [dimensionless].

        Returns
        -------
        list of ndarray, shape (outputs, n)
            One array for each log, in units of the outputs.
        """
        return [found for found, _ in self._runs(self.values(theta), sloped=False)]

    def residuals(self, theta: Array) -> list[Array]:
        """Return predicted minus measured, over the noise.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Coordinates [dimensionless].

        Returns
        -------
        list of ndarray, shape (outputs, n)
            One array for each log; zero if a sample is missing [dimensionless].
        """
        return [self._misfit(found, part) for found, part in zip(self.predicted(theta), self.parts, strict=True)]

    def errors(self, theta: Array) -> list[Array]:
        """Return predicted minus measured, in units of the outputs.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Coordinates [dimensionless].

        Returns
        -------
        list of ndarray, shape (samples that are there,)
            One array for each output, over all logs.
        """
        errors = np.concatenate(self.residuals(theta), axis=1) * self.noise[:, None]
        seen = ~np.isnan(np.concatenate([part.measured for part in self.parts], axis=1))
        return [row[kept] for row, kept in zip(errors, seen, strict=True)]

    def slopes(self, theta: Array) -> Array:
        """Return the derivatives of the residuals.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Coordinates [dimensionless].

        Returns
        -------
        ndarray, shape (residuals, unknowns)
            Log after log, output after output; zero if a sample is missing [dimensionless].
        """
        return np.concatenate([jacobian for _, jacobian in self._rows(theta)])

    def at(self, theta: Array) -> Point:
        """Return the misfit at a point; its cost is infinite if the equations diverge.

        Parameters
        ----------
        theta : ndarray, shape (unknowns,)
            Coordinates [dimensionless].
        """
        diverged = Point(theta, np.inf, np.zeros(len(theta)), np.eye(len(theta)))
        cost, gradient, gram = 0.0, np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        for errors, jacobian in self._rows(theta):
            if not (np.isfinite(errors).all() and np.isfinite(jacobian).all()):
                return diverged
            size = np.abs(errors)
            weight = np.minimum(1.0, OUTLIER / np.maximum(size, OUTLIER)) if self.robust else np.ones_like(size)
            with np.errstate(all="ignore"):  # squares of finite numbers may overflow
                cost += float(np.sum((1.0 - 0.5 * weight) * weight * errors**2))
                gradient += jacobian.T @ (weight * errors)
                gram += (jacobian * weight[:, None]).T @ jacobian if self.robust else jacobian.T @ jacobian
        return Point(theta, cost, gradient, gram) if np.isfinite(cost) and np.isfinite(gram).all() else diverged

    def _rows(self, theta: Array) -> list[tuple[Array, Array]]:
        """Return residuals and their derivatives, log by log."""
        values = self.values(theta)
        by_theta = np.array([v if one.logarithmic else one.size for v, one in zip(values, self.unknowns, strict=True)])
        fitted, free = len(self.equations.parameters), len(self.equations.free)
        rows: list[tuple[Array, Array]] = []
        for number, (found, slopes) in enumerate(self._runs(values, sloped=True)):
            part, own = self.parts[number], slice(fitted + number * free, fitted + (number + 1) * free)
            jacobian = np.zeros((found.size, len(theta)))
            with np.errstate(invalid="ignore", over="ignore"):
                scaled = slopes / self.noise[:, None, None]
                scaled[np.isnan(part.measured)] = 0.0
                scaled = scaled.reshape(found.size, -1)
                jacobian[:, :fitted] = scaled[:, :fitted] * by_theta[:fitted]
                jacobian[:, own] = scaled[:, fitted:] * by_theta[own]
            rows.append((self._misfit(found, part).ravel(), jacobian))
        return rows

    def _misfit(self, found: Array, part: Part) -> Array:
        with np.errstate(invalid="ignore", over="ignore"):
            errors = (found - part.measured) / self.noise[:, None]
        errors[np.isnan(part.measured)] = 0.0
        return errors

    def _runs(self, values: Array, *, sloped: bool) -> list[tuple[Array, Array]]:
        """Return predicted outputs and their derivatives, log by log, in units of the channels."""
        model, run = self.equations, compile_equations(self.equations, self.scheme)
        fitted, free = len(model.parameters), len(model.free)
        held = [
            value
            for name in model.states
            if not isinstance(value := model.initial.get(name, Parameter(0.0)), Parameter)
        ]
        known = np.array([*map(float, model.known.values()), *map(float, held)] or [0.0])
        found: list[tuple[Array, Array]] = []
        for number, part in enumerate(self.parts):
            own = np.concatenate([values[:fitted], values[fitted + number * free : fitted + (number + 1) * free]])
            predicted = np.empty(part.measured.shape)
            slopes = np.empty((*part.measured.shape, len(own)) if sloped else (0, 0, len(own)))
            with np.errstate(all="ignore"):  # the search rejects a trial that diverges
                run(own, known, part.inputs, part.sample_time, self.substeps, predicted, slopes)
            found.append((predicted, slopes))
        return found


def start_of(equations: Equations, name: str, part: Part) -> float:
    """Return the first guess of an initial state: the given value, else the first measured one, else zero.

    Returns
    -------
    float
        In the state's unit.
    """
    given = equations.initial.get(name)
    if isinstance(given, Parameter):
        return given.start
    if name not in equations.outputs or equations.observe is not None:
        return 0.0
    seen = part.measured[list(equations.outputs).index(name)]
    return float(next(iter(seen[np.isfinite(seen)]), 0.0))


def _bounds_of(equations: Equations, name: str) -> tuple[float, float]:
    given = equations.initial.get(name)
    return given.bounds if isinstance(given, Parameter) else (-np.inf, np.inf)


def spread(parts: Sequence[Part]) -> Array:
    """Return the standard deviation of each output over all logs [its unit], shape (outputs,)."""
    return np.array([float(np.nanstd(row)) for row in np.concatenate([part.measured for part in parts], axis=1)])


def known_noise(equations: Equations, noise: Mapping[str, float]) -> Array:
    """Return given deviations of the outputs' noise, NaN if not given.

    Parameters
    ----------
    noise : Mapping[str, float]
        Standard deviation by output [its unit].

    Returns
    -------
    ndarray, shape (outputs,)
        Each in its unit.

    Raises
    ------
    HydrostateError
        If a name is not an output, or a deviation is not positive.
    """
    for name, value in noise.items():
        if name not in equations.outputs:
            raise HydrostateError(f"noise names {name!r}, which is none of the outputs {', '.join(equations.outputs)}")
        if not 0.0 < value < np.inf:
            raise HydrostateError(f"the noise of {name!r} must be a positive standard deviation, got {value!r}")
    return np.array([float(noise.get(name, np.nan)) for name in equations.outputs])
