"""Maximum-likelihood grey-box fit: physical parameters from the innovations of an extended Kalman filter.

The likelihood of a log is that of its innovations (Schweppe 1965). Its gradient is exact
(`estimation.tuning.sensitivity`), and so is the Fisher information of the linearised model, which the optimiser uses as
Hessian. Bulk modulus, leakage, flow bias and friction are fitted in logarithmic coordinates, together with the noise
levels, so that intervals follow from the log and not from assumptions about it.
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
from estimation.models.eha_forms import PRESSURE_FORM
from estimation.tuning.scoring import Coordinate, Maximum, maximise
from estimation.tuning.tuning import noise_coordinates, speed_noise
from plant.eha.model import EhaParameters, lumped_step
from plant.errors import HydrostateError, require_each_known
from plant.log.record import Record

LUMPED_FORM = replace(PRESSURE_FORM, name="lumped", states=PRESSURE_FORM.states[:3], step=lumped_step)
"""The pressure form with bulk modulus as a parameter: a constant need not be a state of a fit."""

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
"""Number of stretches whose scores are summed for the sandwich covariance; they are taken as independent."""

STARTS = (1.0, 0.3, 3.0)
"""Factors on the guess of bulk modulus; the fit continues from the likeliest."""

SCREENED = 20_000
"""Number of samples at the beginning of a longer log on which the starts are compared."""


@dataclass(frozen=True, eq=False)
class LikelihoodFit:
    """Physical parameters of greatest likelihood."""

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
        """Return the 95 % interval of a parameter, on a logarithmic scale if it must stay positive."""
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
    """Fit physical parameters, and the noise levels with them, by the likelihood of the innovations."""
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


def _check(unknowns: Sequence[str], parameters: EhaParameters) -> None:
    if not unknowns:
        raise HydrostateError(f"something must be unknown: one or more of {', '.join(FITTED)}")
    require_each_known("an unknown", unknowns, FITTED)
    for name in unknowns:
        if name != "friction_linear" and not getattr(parameters, name) > 0.0:
            raise HydrostateError(f"the first guess of {name} must be positive, got {getattr(parameters, name)!r}")


def _first_noise(record: Record, p: EhaParameters) -> Mapping[str, float]:
    """Return the process noise that the speed sensor causes: its noise is a flow that does not exist."""
    stiffness = (p.bulk_modulus / p.chamber_volume) ** 2
    silent = (1e-4 * p.rated_speed * p.pump_displacement) ** 2 * record.sample_time * stiffness
    pressure = max(speed_noise(record, p), silent)
    return {
        "position_m": 1e-2 * pressure / stiffness / p.piston_area**2,
        "velocity_m_s": 1e-8,
        "differential_pressure_pa": pressure,
    }


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
