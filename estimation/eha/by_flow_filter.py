"""The flow form as a filter: bulk modulus, leakage and flow bias sample by sample, from pressure, position and speed.

One extended Kalman filter that starts far from the truth believes its first linearisation too much and stays there: on
a ridge where leakage makes up for bulk modulus. A bank of them, each sure of another first guess and weighted by its
likelihood, covers the ridge: a Gaussian sum (Alspach and Sorenson 1972, equations 26 to 33).
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np

from estimation.engine.contract import FilterProblem, Trace
from estimation.filters.batch import filter_batch
from estimation.filters.run import Estimate, filter_problem, in_si
from estimation.log_checks.first_belief import first_load
from estimation.models.eha_forms import BULK_MODULUS, volume_left_open
from estimation.models.flow import flow_rates
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.expression import ONE, as_expression, jacobian
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.solvers.steps import solve_linear

MODULI = (0.35, 0.6, 1.0, 1.6, 2.6)
"""First guesses of bulk modulus, as multiples of the rig's."""

LEAKAGES = (1.0, 2.0, 4.0, 6.5, 9.5, 14.0, 20.0, 28.0)
"""First guesses of leakage, as multiples of a healthy actuator's; Table 3 goes to 12.6."""

BIASES = (1.0, 2.0, 4.0, 6.5)
"""First guesses of flow bias, as multiples of a healthy actuator's; Table 3 goes to 6.1."""

MAKEUPS = (1e-9, 1e-13)
"""Make-up conductances of the guesses [m^3/(s Pa)]: a circuit with make-up valves, and one without."""

GUESS_STD = 0.3
"""Standard deviation of each guess's logarithm: about half the distance to the next [dimensionless]."""

PRESSURE_STD = 1e4
"""Standard deviation of the chamber pressures before the first sample, at rest [Pa]."""

LOAD_STD = 0.3
"""Standard deviation of the chamber pressures before the first sample of a log that begins under load, where the lower
one need not be that of the inner circuit [fraction of the load]."""

SECONDARY_STD: Mapping[str, float] = {"makeup_conductance": 0.1, "speed_lead": 1.0}
"""Relative deviations of what is estimated along with them [fraction]."""

OPENING = 1e3
"""Drop at which a make-up check valve is taken to be half open [Pa]."""

LEAST = 1e-3
"""A guess that is zero begins at this share of the default actuator's value [fraction]."""


def _state(name: str, unit: str, scale: float) -> StateVariable:
    return StateVariable(name, unit, scale, 0.0, 1e-6 * scale, 1e6 * scale, logarithmic=True)


STATES = (
    StateVariable("pressure_a_pa", "Pa", 1e5, 1e6),
    StateVariable("pressure_b_pa", "Pa", 1e5, 1e6),
    replace(_state(BULK_MODULUS, "Pa", 1e8), upper=2e10),
    _state("leakage_coefficient", "m^3/(s Pa)", 5e-12),
    _state("flow_bias", "m^3/s", 2.4e-6),
    _state("makeup_conductance", "m^3/(s Pa)", 1e-9),
    _state("speed_lead", "s", 1e-5),
)
"""Chamber pressures with the process noise that measured speed brings, and constants."""


def flow_filter_step(state: tuple[Scalar, ...], drives: Any, p: Any, h: Scalar) -> tuple[Scalar, ...]:
    """Advance the chamber pressures by one linearly implicit Euler step of the flow form.

    Parameters
    ----------
    state : tuple of Expression
        Chamber pressures [Pa], effective bulk modulus [Pa], leakage coefficient [m^3/(s Pa)], flow bias [m^3/s],
        make-up conductance [m^3/(s Pa)], speed lead [s].
    drives : tuple of pairs
        Motor speed [rad/s] and piston position [m] at the start and end of the step.
    p : namespace of Expression
        The actuator.
    h : Expression
        Time step [s].

    Returns
    -------
    tuple of Expression
        The state one step later.
    """
    pressures = (as_expression(state[0]), as_expression(state[1]))
    constants = dict(zip(("bulk_modulus", *(s.name for s in STATES[3:])), state[2:], strict=True))
    values = {field.name: getattr(p, field.name) for field in fields(EhaParameters)}
    known = SimpleNamespace(**{**values, **constants, "case_leakage": 0.0, "makeup_opening": OPENING})
    rates = [as_expression(rate) for rate in flow_rates(pressures, (*drives, h), known, 0.5)]
    slopes = jacobian(rates, pressures)
    matrix = [[(ONE if i == j else 0.0) - h * slopes[i][j] for j in range(2)] for i in range(2)]
    moved = solve_linear(matrix, [h * rate for rate in rates])
    return (*(x + dx for x, dx in zip(pressures, moved, strict=True)), *state[2:])


def _observe(state: tuple[Scalar, ...], p: Any) -> Mapping[str, Scalar]:
    del p
    return {"differential_pressure_pa": state[0] - state[1]}


FLOW_FILTER = ProcessModel(
    "flow_filter",
    STATES,
    flow_filter_step,
    _observe,
    longest_step=2.5e-4,
    drives=("motor_speed_rad_s", "position_m"),
    parameters=EhaParameters,
    opening=volume_left_open,
)
"""The flow form as a process model: driven by what is measured, so friction plays no part."""


def filter_flow(
    record: Record,
    parameters: EhaParameters,
    noise: Mapping[str, float] | None = None,
    variances: Mapping[str, float] | None = None,
) -> Estimate:
    """Filter a log with a bank of flow-form filters; nothing of leakage, flow bias or friction need be known.

    Parameters
    ----------
    record : Record
        The log, with motor speed, position and differential pressure.
    parameters : EhaParameters
        Geometry and pump are taken from it, and the first guesses' size.
    noise : Mapping[str, float], optional
        Process-noise densities by state name: of a pressure [Pa^2/s], or of a constant's logarithm [1/s], which lets it
        drift.
    variances : Mapping[str, float], optional
        Measurement variances of its channels [SI squared]; read off the log if not given.

    Returns
    -------
    Estimate
        The mixture of all filters, weighted by what the whole log says of them.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    load = first_load(record, variances) if "differential_pressure_pa" in record else 0.0
    anywhere = flow_belief(parameters, load)
    first = filter_problem(FLOW_FILTER, anywhere, record, parameters, noise=noise, variances=variances)
    problems: list[FilterProblem] = []
    for guess in product(MODULI, LEAKAGES, BIASES, MAKEUPS):
        prior = FLOW_FILTER.to_filter(flow_belief(parameters, load, *guess))
        problems.append(replace(first, mean=prior.mean, covariance=prior.covariance))
    return in_si(first, mixture(list(filter_batch(problems))), record.start_time)


def flow_belief(
    p: EhaParameters,
    load: float = 0.0,
    modulus: float = 1.0,
    leakage: float = 1.0,
    bias: float = 1.0,
    makeup: float = MAKEUPS[0],
) -> Gaussian:
    """Return the belief of the flow form before the first sample.

    Parameters
    ----------
    p : EhaParameters
        The actuator.
    load : float
        Differential pressure that the log begins with [Pa].
    modulus, leakage, bias : float
        First guesses, as multiples of the actuator's [dimensionless].
    makeup : float
        First guess of the make-up conductance [m^3/(s Pa)].
    """
    healthy = EhaParameters()
    means = {
        "pressure_a_pa": p.accumulator_pressure + max(load, 0.0),
        "pressure_b_pa": p.accumulator_pressure + max(-load, 0.0),
        BULK_MODULUS: modulus * p.bulk_modulus,
        "leakage_coefficient": leakage * max(p.leakage_coefficient, LEAST * healthy.leakage_coefficient),
        "flow_bias": bias * max(p.flow_bias, LEAST * healthy.flow_bias),
        "makeup_conductance": makeup,
        "speed_lead": 1e-5,
    }
    stds = [
        float(np.hypot(PRESSURE_STD, LOAD_STD * load))
        if state.unit == "Pa" and not state.logarithmic
        else SECONDARY_STD.get(state.name, GUESS_STD) * value
        for state, value in zip(STATES, means.values(), strict=True)
    ]
    return Gaussian(np.array(list(means.values())), np.diag(np.square(stds)))


def mixture(traces: list[Trace]) -> Trace:
    """Return the Gaussian sum of filters that began at different guesses, as one trace.

    Parameters
    ----------
    traces : list of Trace
        The filters' results; one that diverged has no weight.

    Returns
    -------
    Trace
        Moments of the mixture (Alspach and Sorenson 1972), the scores those of the likeliest filter. Where every filter
        diverged, the first one's trace.
    """
    scores = np.array([trace.log_likelihood if np.all(np.isfinite(trace.mean)) else -np.inf for trace in traces])
    scores[np.isnan(scores)] = -np.inf
    if not np.any(np.isfinite(scores)):
        return traces[0]
    weights = np.exp(scores - np.max(scores))
    weights /= np.sum(weights)
    heard = [(weight, trace) for weight, trace in zip(weights, traces, strict=True) if weight > 1e-12]
    mean = np.sum([weight * trace.mean for weight, trace in heard], axis=0)
    spread = [weight * (t.covariance + np.outer(t.mean - mean, t.mean - mean)) for weight, t in heard]
    track = np.sum([weight * trace.track for weight, trace in heard], axis=0)
    variance = np.sum([weight * (t.track_variance + (t.track - track) ** 2) for weight, t in heard], axis=0)
    best = traces[int(np.argmax(scores))]
    return best._replace(mean=mean, covariance=np.sum(spread, axis=0), track=track, track_variance=variance)
