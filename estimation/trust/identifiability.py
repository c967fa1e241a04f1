"""Identifiability before any experiment: the card of a sensor set and a drive.

The bound of every unknown is the posterior Cramér-Rao bound along a noiseless run of the lumped plant, with the
sensors' noise and a prior of only the order of magnitude (`estimation.trust.bounds`). Parameters that are taken as
known vary with their uncertainty from the rig file, and so widen it: bulk modulus enters only as chamber volume over
bulk modulus, so no experiment determines it better than the volume is known.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.models.eha_forms import PRESSURE_FORM
from estimation.models.gaussian import Gaussian
from estimation.models.model import StateVariable
from estimation.trust.bounds import posterior_bound
from estimation.trust.card import Card
from plant.compiled.functions import Scalar
from plant.eha.model import EhaParameters, lumped_step
from plant.errors import HydrostateError, require_each_known
from plant.log.record import Record
from plant.sensors.sensors import BENCH, Sensors, noise_variances
from plant.units import notes

UNKNOWN = (
    "bulk_modulus",
    "leakage_coefficient",
    "flow_bias",
    "friction_quadratic",
    "friction_linear",
    "friction_coulomb",
)
"""Default unknowns of an experiment."""

TAKEN_AS_KNOWN = ("chamber_volume", "pump_displacement", "piston_area", "moving_mass")
"""Parameters that are read from a drawing, with the uncertainty of the rig file."""

CARD_CHANNELS = ("position_m", "velocity_m_s", "differential_pressure_pa")
"""Channels that a card can have."""

PRIOR_DEVIATION = 1.0
"""Standard deviation of an unknown's logarithm before the experiment: a factor of e in either direction."""


def identifiability_card(
    parameters: EhaParameters,
    speed: Array,
    sample_time: float,
    channels: Sequence[str] = CARD_CHANNELS,
    *,
    sensors: Sensors = BENCH,
    unknowns: Sequence[str] = UNKNOWN,
    uncertainties: Mapping[str, float] | None = None,
) -> Card:
    """Return how well an experiment can determine an actuator's parameters.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator as assumed.
    speed : ndarray, shape (samples,)
        Motor speed that would drive it from rest [rad/s].
    sample_time : float
        Time between samples [s].
    channels : sequence of str
        Channels that would be logged besides motor speed, from `CARD_CHANNELS`.
    sensors : Sensors
        Their noise; that of motor speed drives the plant without being seen.
    unknowns : sequence of str
        Parameters to determine; the others are known as well as `uncertainties` says.
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of parameters taken as known, as in a rig file [fraction].

    Returns
    -------
    Card
        Bounds, and parameters that cannot be told apart; `estimation.trust.card.sentences` puts it in words.

    Raises
    ------
    HydrostateError
        If a channel or an unknown is not one that a card can have, or a sensor's noise is zero.
    """
    _require_names("a channel", channels, CARD_CHANNELS)
    _require_names("an unknown", unknowns, UNKNOWN)
    variances = _variances(sensors, channels)
    spreads = {name: (uncertainties or {}).get(name, 0.0) for name in (*UNKNOWN, *TAKEN_AS_KNOWN)}
    noise = _speed_noise(parameters, sensors, sample_time)
    record = Record(sample_time, {"motor_speed_rad_s": speed})

    def bounded(known: Mapping[str, float]) -> tuple[Array, Array]:
        prior = _prior(parameters, {**known, **dict.fromkeys(unknowns, PRIOR_DEVIATION)})
        bound = posterior_bound(CARD_FORM, prior, record, parameters, variances=variances, noise=noise)
        if bound.belief is None:
            raise HydrostateError("the lumped plant does not stay finite under this drive: check rig and drive")
        return bound.belief.covariance / np.outer(*2 * [_sizes(parameters)]), bound.mean[:, 1]

    covariance, velocity = bounded(spreads)
    exact, _ = bounded(dict.fromkeys(spreads, 0.0))
    places = [CARD_FORM.index(name) for name in unknowns]
    block = covariance[np.ix_(places, places)]
    std = np.sqrt(np.diag(block))
    eigenvalues, vectors = np.linalg.eigh(block)
    return Card(
        channels=tuple(channels),
        unknowns=tuple(unknowns),
        relative_std=MappingProxyType(dict(zip(unknowns, map(float, std), strict=True))),
        known_exactly=MappingProxyType(
            {name: float(exact[i, i] ** 0.5) for name, i in zip(unknowns, places, strict=True)}
        ),
        correlation=block / np.outer(std, std),
        friction_force=_force_deviation(parameters, covariance, float(np.max(np.abs(velocity)))),
        weakest=MappingProxyType(dict(zip(unknowns, map(float, vectors[:, -1]), strict=True))),
        weakest_std=float(max(eigenvalues[-1], 0.0) ** 0.5),
        stuck=float(np.mean(velocity == 0.0)),
        uncertainties=MappingProxyType({name: s for name, s in spreads.items() if s > 0.0 and name not in unknowns}),
    )


def _card_step(state: tuple[Scalar, ...], speeds: Any, p: Any, h: Scalar) -> tuple[Scalar, ...]:
    values = {one.name: getattr(p, one.name) for one in fields(EhaParameters)}
    values |= dict(zip((*UNKNOWN, *TAKEN_AS_KNOWN), state[3:], strict=True))
    return (*lumped_step(state[:3], speeds, SimpleNamespace(**values), h), *state[3:])


def _observe(state: tuple[Scalar, ...], p: Any) -> Mapping[str, Scalar]:
    del p
    return dict(zip(CARD_CHANNELS, state[:3], strict=True))


def _as_state(name: str) -> StateVariable:
    size, unit = abs(float(getattr(EhaParameters(), name))), notes(EhaParameters)[name].unit
    return StateVariable(name, unit, size, 0.0, logarithmic=name != "friction_linear")


CARD_FORM = replace(
    PRESSURE_FORM,
    name="card",
    states=(
        *(replace(state, noise_density=0.0) for state in PRESSURE_FORM.states[:3]),
        *(_as_state(name) for name in (*UNKNOWN, *TAKEN_AS_KNOWN)),
    ),
    step=_card_step,
    observe=_observe,
)
"""The lumped plant with every parameter of a card as a state; known ones have no variance."""


def _require_names(what: str, given: Sequence[str], known: Sequence[str]) -> None:
    if not given:
        raise HydrostateError(f"{what} is needed: one or more of {', '.join(known)}")
    require_each_known(what, given, known)


def _variances(sensors: Sensors, channels: Sequence[str]) -> Mapping[str, float]:
    """Return every channel's variance, infinite if it is not logged: one kernel serves every sensor set."""
    noise = noise_variances(sensors)
    for channel in channels:
        if not noise.get(channel, 0.0) > 0.0:
            raise HydrostateError(f"these sensors give {channel} no noise, or do not have it: a card needs its noise")
    return {channel: noise[channel] if channel in channels else math.inf for channel in CARD_CHANNELS}


def _speed_noise(p: EhaParameters, sensors: Sensors, sample_time: float) -> Mapping[str, float]:
    """Return the noise of measured speed as a flow that the model assumes and the plant does not have."""
    flow = p.pump_displacement**2 * sensors.speed_noise**2 * sample_time
    return {"differential_pressure_pa": flow * (p.bulk_modulus / p.chamber_volume) ** 2}


def _sizes(p: EhaParameters) -> Array:
    """Return the reference sizes of a covariance; for linear friction, which may be near 0, that of all friction."""
    values = [abs(float(getattr(p, name))) for name in (*UNKNOWN, *TAKEN_AS_KNOWN)]
    values[UNKNOWN.index("friction_linear")] = _linear_size(p)
    return np.array([1.0, 1.0, 1.0, *values])


def _linear_size(p: EhaParameters) -> float:
    rated = p.rated_flow / p.piston_area
    return max(abs(p.friction_linear), 0.1 * p.friction_coulomb / rated)


def _prior(p: EhaParameters, spreads: Mapping[str, float]) -> Gaussian:
    """Return the prior: rest at a position known to 10 um, and parameters in SI with their relative deviations."""
    values: list[float] = []
    for name in (*UNKNOWN, *TAKEN_AS_KNOWN):
        value = float(getattr(p, name))
        if value == 0.0 and name != "friction_linear":
            raise HydrostateError(f"a card tells {name} relative to its value, which must be positive, got 0")
        values.append(value)
    held = np.array([spreads[name] for name in (*UNKNOWN, *TAKEN_AS_KNOWN)]) * _sizes(p)[3:]
    return Gaussian(np.array([0.0, 0.0, 0.0, *values]), np.diag(np.concatenate([[1e-5, 1e-6, 1e3], held]) ** 2))


def _force_deviation(p: EhaParameters, covariance: Array, velocity: float) -> float:
    """Return the relative deviation of a_1 v^2 + a_2 v + a_3."""
    names = ("friction_quadratic", "friction_linear", "friction_coulomb")
    places = [CARD_FORM.index(name) for name in names]
    terms = np.array([velocity**2, velocity, 1.0]) * _sizes(p)[places]
    force = p.friction_quadratic * velocity**2 + p.friction_linear * velocity + p.friction_coulomb
    return float((terms @ covariance[np.ix_(places, places)] @ terms) ** 0.5 / force) if force > 0.0 else math.inf
