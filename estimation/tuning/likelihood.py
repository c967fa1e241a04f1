"""Maximum-likelihood grey-box fit: physical parameters from the innovations of an extended Kalman filter.

The likelihood of a log is that of its innovations (Schweppe 1965); its gradient is exact
(`estimation.tuning.sensitivity`), and so is the Fisher information of the linearised model, which serves the optimiser
as Hessian. Bulk modulus, leakage, flow bias and friction move in logarithmic coordinates, and the noise levels are
fitted along with them, so that intervals follow what the log shows and not what was assumed of it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from types import MappingProxyType

import numpy as np

from estimation.arrays import Array
from estimation.engine.contract import FilterProblem
from estimation.engine.layout import layout
from estimation.filters.ekf import EKF
from estimation.filters.run import available_channels, filter_problem
from estimation.finding import NORMAL_95, interval_95
from estimation.log_checks.first_belief import first_belief
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.eha_forms import PRESSURE_FORM
from estimation.trust.whiteness import quantum
from estimation.tuning.scoring import Coordinate, Maximum, maximise
from plant.eha.model import EhaParameters, lumped_step
from plant.errors import HydrostateError, require_each_known
from plant.log.record import Record

LUMPED_FORM = replace(PRESSURE_FORM, name="lumped", states=PRESSURE_FORM.states[:3], step=lumped_step)
"""The pressure form with bulk modulus as a parameter: what is constant need not be a state of a fit."""

FITTED = (
    "bulk_modulus",
    "leakage_coefficient",
    "flow_bias",
    "friction_quadratic",
    "friction_linear",
    "friction_coulomb",
)
"""Parameters that may be fitted."""

BLOCKS = 64
"""Stretches whose scores are summed for the sandwich covariance; each is taken as independent of the others."""

NOISE_SPREAD = 3.0
"""Standard deviation of what is presumed of the logarithm of a noise level: a factor of twenty either way."""

LEAST_SHARE = 0.25
"""Of the noise of measured motor speed, so much at least is taken to be the sensor's, and unseen by the plant."""

STARTS = (1.0, 0.3, 3.0)
"""Factors on the guess of bulk modulus from which the likeliest is taken first."""

SCREENED = 20_000
"""Samples at the beginning of a longer log on which the starts are compared."""


@dataclass(frozen=True, eq=False)
class LikelihoodFit:
    """Physical parameters of greatest likelihood.

    Parameters
    ----------
    parameters : Mapping[str, tuple of float]
        Value and standard deviation [SI], by parameter name; the larger of the two deviations below.
    covariance : ndarray, shape (p, p)
        Inverse Fisher information, of logarithms; of `friction_linear`, in units of `linear_scale`.
    sandwich : ndarray, shape (p, p)
        The same from the scatter of the scores between stretches of the log (White 1982, theorem 3.2): right where the
        innovations are not as white as the model has them.
    linear_scale : float
        Unit of the linear friction's coordinate [N s/m].
    noise : Mapping[str, float]
        Process-noise densities found, by state name [SI squared a second].
    variances : Mapping[str, float]
        Sensor variances found, by channel [SI squared].
    nis : Mapping[str, float]
        Mean normalised innovation squared of each channel [dimensionless].
    log_likelihood : float
        Log-likelihood [dimensionless].
    converged : bool
        Whether the optimiser came to rest.
    """

    parameters: Mapping[str, tuple[float, float]]
    covariance: Array
    sandwich: Array
    linear_scale: float
    noise: Mapping[str, float]
    variances: Mapping[str, float]
    nis: Mapping[str, float]
    log_likelihood: float
    converged: bool

    def interval(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of a parameter; of a logarithm, so that it stays positive.

        Parameters
        ----------
        name : str
            Parameter name.

        Returns
        -------
        tuple of float
            Lower and upper end [SI].
        """
        value, std = self.parameters[name]
        if name == "friction_linear":
            return interval_95(value, std)
        factor = math.exp(NORMAL_95 * std / value)
        return value / factor, value * factor

    @property
    def inflation(self) -> float:
        """Largest ratio of the sandwich's standard deviations to the Fisher information's [dimensionless]."""
        return float(np.sqrt(np.max(np.diag(self.sandwich) / np.diag(self.covariance))))


def fit_likelihood(
    record: Record,
    parameters: EhaParameters,
    unknowns: Sequence[str] = FITTED,
    *,
    channels: tuple[str, ...] | None = None,
) -> LikelihoodFit:
    """Fit physical parameters, and the noise levels with them, by the likelihood of the innovations.

    Parameters
    ----------
    record : Record
        The log: motor speed, and position, velocity or differential pressure.
    parameters : EhaParameters
        The actuator; its values are known, or the first guesses of the unknowns.
    unknowns : sequence of str
        What is fitted, from `FITTED`.
    channels : tuple of str, optional
        Channels to use; by default all that the model predicts and the record has.

    Returns
    -------
    LikelihoodFit
        Values, intervals, and what was found of the noise.

    Raises
    ------
    HydrostateError
        If an unknown is not of `FITTED`, comes twice, or its first guess is not positive.
    LogError
        If the record lacks motor speed, or has no channel that the model predicts.
    """
    model = LUMPED_FORM
    _check(unknowns, parameters)
    used = channels if channels is not None else available_channels(model, record)
    prior = first_belief(model, record, parameters.bulk_modulus, parameters.bulk_modulus)
    problem = filter_problem(model, prior, record, parameters, channels=used, noise=_first_noise(record, parameters))
    scale = (
        parameters.friction_coulomb / (parameters.pump_displacement * parameters.rated_speed) * parameters.piston_area
    )
    names = layout(EKF, model, used).rows
    known = {field.name: getattr(parameters, field.name) for field in fields(EhaParameters)}
    coordinates = [
        Coordinate(name, names.index(name), known[name], scale if name == "friction_linear" else None)
        for name in unknowns
    ]
    coordinates += noise_coordinates(problem, record, parameters)
    found = _from_several_starts(problem, coordinates)
    return _report(found, problem, unknowns, scale)


def noise_coordinates(
    problem: FilterProblem, record: Record, parameters: EhaParameters, speed_variance: float | None = None
) -> list[Coordinate]:
    """Return the logarithms of process and sensor noise as coordinates, presumed within a factor of the given.

    Parameters
    ----------
    problem : FilterProblem
        The task; a process noise of 0 stays so.
    record : Record
        The log; a sensor's variance stays above that of its quantum, and the noise of differential pressure above a
        quarter of what the noise of measured motor speed makes it.
    parameters : EhaParameters
        The actuator.
    speed_variance : float, optional
        Measurement variance of motor speed [rad^2/s^2]; read off the log if not given.

    Returns
    -------
    list of Coordinate
        One a state with noise, then one a channel.
    """
    names = layout(EKF, problem.model, problem.channels).rows
    unseen = _speed_noise(record, parameters, speed_variance)
    noise: list[tuple[str, float, float]] = []
    for i, (state, value) in enumerate(zip(problem.model.states, problem.noise, strict=True)):
        if value > 0.0:
            least = LEAST_SHARE * unseen / state.scale**2 if state.name == "differential_pressure_pa" else 0.0
            noise.append((f"q{i}", float(value), min(least, 0.99 * float(value))))
    sensors: list[tuple[str, float, float]] = []
    for c, channel in enumerate(problem.channels):
        resolved = quantum(record[channel])
        floor = min(resolved**2 / 12.0, 0.99 * float(problem.variances[c]))
        sensors.append((f"r{c}", float(problem.variances[c]), floor))
    return [
        Coordinate(name, names.index(name), value, floor=floor, spread=NOISE_SPREAD)
        for name, value, floor in (*noise, *sensors)
    ]


def _check(unknowns: Sequence[str], parameters: EhaParameters) -> None:
    if not unknowns:
        raise HydrostateError(f"something must be unknown: one or more of {', '.join(FITTED)}")
    require_each_known("an unknown", unknowns, FITTED)
    for name in unknowns:
        if name != "friction_linear" and not getattr(parameters, name) > 0.0:
            raise HydrostateError(f"the first guess of {name} must be positive, got {getattr(parameters, name)!r}")


def _first_noise(record: Record, p: EhaParameters) -> Mapping[str, float]:
    """Return process noise as the speed sensor's own noise makes it: flow that the filter believes and is not there."""
    stiffness = (p.bulk_modulus / p.chamber_volume) ** 2
    silent = (1e-4 * p.rated_speed * p.pump_displacement) ** 2 * record.sample_time * stiffness
    pressure = max(_speed_noise(record, p), silent)
    return {
        "position_m": 1e-2 * pressure / stiffness / p.piston_area**2,
        "velocity_m_s": 1e-8,
        "differential_pressure_pa": pressure,
    }


def _speed_noise(record: Record, p: EhaParameters, variance: float | None = None) -> float:
    """Return the noise density of differential pressure that comes of the noise of measured speed [Pa^2/s]."""
    if variance is None:
        variance = measurement_variances(record, ["motor_speed_rad_s"])["motor_speed_rad_s"]
    return variance * record.sample_time * (p.pump_displacement * p.bulk_modulus / p.chamber_volume) ** 2


def _from_several_starts(problem: FilterProblem, coordinates: Sequence[Coordinate]) -> Maximum:
    first = coordinates[0]
    if first.name != "bulk_modulus":
        return maximise(problem, coordinates)
    begin = replace(problem, measured=problem.measured[:SCREENED], drives=problem.drives[:SCREENED])
    guesses = [[replace(first, guess=factor * first.guess), *coordinates[1:]] for factor in STARTS]
    found = [maximise(begin, guess, iterations=6) for guess in guesses]
    likeliest = max(found, key=lambda one: one.objective)
    return maximise(problem, likeliest.coordinates)


def _report(found: Maximum, problem: FilterProblem, unknowns: Sequence[str], scale: float) -> LikelihoodFit:
    count = len(unknowns)
    covariance = np.asarray(np.linalg.inv(found.information), dtype=np.float64)
    scores = np.array([block.sum(axis=0) for block in np.array_split(found.sensitivity.scores, BLOCKS)])
    scores -= scores.mean(axis=0)
    sandwich = covariance @ (scores.T @ scores * BLOCKS / (BLOCKS - 1.0)) @ covariance
    std = np.sqrt(np.maximum(np.diag(covariance), np.diag(sandwich)))
    values = {c.name: c.guess for c in found.coordinates}
    sizes = [scale if name == "friction_linear" else values[name] for name in unknowns]
    units = dict(zip((s.name for s in problem.model.states), problem.model.noise_units.tolist(), strict=True))
    return LikelihoodFit(
        parameters=MappingProxyType(
            {name: (values[name], float(std[i] * sizes[i])) for i, name in enumerate(unknowns)}
        ),
        covariance=covariance[:count, :count],
        sandwich=sandwich[:count, :count],
        linear_scale=scale,
        noise=MappingProxyType({name: values.get(f"q{i}", 0.0) * unit for i, (name, unit) in enumerate(units.items())}),
        variances=MappingProxyType({channel: values[f"r{c}"] for c, channel in enumerate(problem.channels)}),
        nis=MappingProxyType(dict(zip(problem.channels, found.sensitivity.nis.tolist(), strict=True))),
        log_likelihood=found.sensitivity.log_likelihood,
        converged=found.converged,
    )
