"""Severities of a fitted circuit in workshop units, each with a 95 % interval."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from estimation.finding import Quantity
from estimation.log_checks.order import percentiles
from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.circuit_runs import fitted_parameters, friction_parts
from faults.diagnosis.circuits.class_regions import ClassFits
from faults.diagnosis.circuits.friction_shape import FORCE_PLACES
from faults.diagnosis.circuits.open_classes import OpenCircuit
from plant.arrays import Array
from plant.components.friction import quadratic_friction
from plant.components.oil import ATMOSPHERE
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.steady_state import steady_state

DRAWS = 2_000
"""Random circuits for the intervals: their ends are right to 3 %."""

KIND_SPREAD = 0.2
"""Relative difference of bulk modulus between sound actuators of one kind [dimensionless]: lower values may mean
air."""

FRICTION_SEVERITIES = frozenset({"velocity_lost", "added_friction", "pressure_rise"})
"""Severities that depend on friction."""

OIL_SEVERITIES = frozenset({"bulk_modulus", "entrained_air"})
"""Severities that depend on bulk modulus."""

UNITS: Mapping[str, str] = {
    "leakage_flow": "L/min",
    "velocity_lost": "%",
    "added_friction": "N",
    "pressure_rise": "%",
    "bulk_modulus": "Pa",
    "entrained_air": "%",
}
"""The severities. Leakage flow and bias are at rated pressure (the relief setting). Velocity lost and pressure rise are
in the steady state at rated speed, relative to the healthy actuator. Friction is at rated velocity, over the healthy
one. The air is that at atmospheric pressure which would make the oil so soft."""


class KnownLosses(NamedTuple):
    """Leakage and flow bias that are known from another source than a fitted circuit.

    Parameters
    ----------
    logarithms : ndarray, shape (2,)
        Logarithms of both, as the first two coordinates of a circuit [dimensionless].
    covariance : ndarray, shape (2, 2)
        Covariance of their errors [dimensionless].
    """

    logarithms: Array
    covariance: Array


class KnownFriction(NamedTuple):
    """Friction that is known from another source than a fitted circuit.

    Parameters
    ----------
    forces : ndarray, shape (3,)
        Friction at rest, its quadratic part at rated velocity, and all of it there [N].
    covariance : ndarray, shape (3, 3)
        Covariance of their errors [N^2].
    bent_covariance : ndarray, shape (3, 3)
        The same if the friction law may have another shape [N^2].
    """

    forces: Array
    covariance: Array
    bent_covariance: Array


def severities_at(point: Array, actuator: Actuator) -> Mapping[str, float]:
    """Return the severities of a circuit.

    Parameters
    ----------
    point : ndarray, shape (7,)
        Its coordinates.

    Returns
    -------
    Mapping[str, float]
        In the units of `UNITS`.
    """
    return {name: float(values[0]) for name, values in _circuit_severities(point[None], actuator).items()}


def _circuit_severities(points: Array, actuator: Actuator, forces: Array | None = None) -> Mapping[str, Array]:
    """Return the severities of many circuits, each of shape (n,); ``forces``, shape (n, 3), are other friction."""
    healthy = actuator.circuit
    values = fitted_parameters(points, healthy, actuator.rated)
    if forces is not None:
        rest, bent, whole = forces.T
        values["friction_coulomb"] = rest
        values["friction_linear"] = (whole - rest - bent) / actuator.rated
        values["friction_quadratic"] = bent / actuator.rated**2
    p = SimpleNamespace(**{**vars(healthy), **values})  # only a few of the parameters are read
    velocity, pressure = steady_state(healthy.rated_speed, p)
    sound_velocity, sound_pressure = _rated_state(healthy)
    rubbing, sound = (
        quadratic_friction(actuator.rated, 1.0, q.friction_quadratic, q.friction_linear, q.friction_coulomb)
        for q in (p, healthy)
    )
    return {
        "leakage_flow": 6e4 * (p.leakage_coefficient * healthy.relief_pressure + p.flow_bias),
        "velocity_lost": 100.0 * (1.0 - velocity / sound_velocity),
        "added_friction": rubbing - sound,
        "pressure_rise": 100.0 * (pressure / sound_pressure - 1.0) if sound_pressure > 0.0 else np.zeros(len(points)),
        "bulk_modulus": p.bulk_modulus,
        "entrained_air": _air_percent(p.bulk_modulus, actuator),
    }


@lru_cache(maxsize=16)
def _rated_state(circuit: CircuitParameters) -> tuple[float, float]:
    """Return velocity and pressure of a circuit at rated speed [m/s, Pa], kept for the next log."""
    return steady_state(circuit.rated_speed, circuit)


def severities(
    fits: ClassFits,
    actuator: Actuator,
    widths: Mapping[str, float] | None = None,
    circuits: Sequence[OpenCircuit] = (),
    known: KnownLosses | None = None,
    rubbing: KnownFriction | None = None,
) -> Mapping[str, Quantity]:
    """Return the severities of a fitted circuit with their intervals.

    Parameters
    ----------
    fits : ClassFits
        The fit.
    widths : Mapping[str, float], optional
        Factor on each interval [dimensionless]; 1 if not given.
    circuits : sequence of OpenCircuit, optional
        Circuits that the log leaves open, see `circuits_left_open`; the best alone if not given. Values are those of
        the likeliest, and intervals include all of them.
    known : KnownLosses, optional
        Leakage and flow bias in place of the circuit's. Its friction stays: what a fit absorbed in leakage does not
        follow the derivatives.
    rubbing : KnownFriction, optional
        Friction in place of the circuit's.

    Returns
    -------
    Mapping[str, Quantity]
        By the names of `UNITS`. Those that depend on friction have a total interval already, since the law may have
        another shape than the rig's.
    """
    among = circuits or [OpenCircuit(fits.best.coordinates, 1.0)]
    if known is not None:
        among = [one._replace(coordinates=np.append(known.logarithms, one.coordinates[2:])) for one in among]
    straight = curved = None
    if rubbing is not None:
        straight, curved = (rubbing.forces, rubbing.covariance), (rubbing.forces, rubbing.bent_covariance)
    found = _drawn_severities(_with_known_losses(fits.spread, known), among, actuator, widths or {}, straight)
    if not np.any(fits.bend_shifts):
        return found
    bent = _drawn_severities(
        _with_known_losses(fits.bent_spread, known), among, actuator, widths or {}, curved, FRICTION_SEVERITIES
    )
    return found | {name: replace(found[name], ci95_total=bent[name].ci95) for name in FRICTION_SEVERITIES}


def _with_known_losses(spread: Array, known: KnownLosses | None) -> Array:
    """Return a covariance of coordinates in which the losses are known from another source."""
    if known is None:
        return spread
    out = np.array(spread)
    out[:2], out[:, :2] = 0.0, 0.0
    out[:2, :2] = known.covariance
    return out


def _drawn_severities(
    spread: Array,
    among: Sequence[OpenCircuit],
    actuator: Actuator,
    widths: Mapping[str, float],
    rubbing: tuple[Array, Array] | None,
    asked: Collection[str] = UNITS,
) -> dict[str, Quantity]:
    """Return the severities of the likeliest circuit, with intervals of all under a covariance of their coordinates.

    ``rubbing`` has forces of friction and their covariance, in place of the circuits'. The result may be restricted to
    some.
    """
    centre = max(among, key=lambda one: one.probability).coordinates
    draws = _normal_draws(len(centre))
    circuits, forces = np.vstack([_draw_centres(among) + draws @ np.linalg.cholesky(spread).T, centre]), None
    if rubbing is not None:
        known, covariance = rubbing
        forces = np.vstack([known + draws[:, FORCE_PLACES] @ np.linalg.cholesky(covariance).T, known])
    with np.errstate(all="ignore"):  # NaN if friction falls so fast that no steady state exists
        table = _circuit_severities(circuits, actuator, forces)
    found: dict[str, Quantity] = {}
    unresolved = _unresolved_friction(actuator)
    for name, values in table.items():
        if name not in asked:
            continue
        value, drawn = float(values[-1]), values[:-1]
        if not np.isfinite(value):
            found[name] = Quantity(None, UNITS[name])
            continue
        finite = drawn[~np.isnan(drawn)]
        low, high = percentiles(finite, (2.5, 97.5)) if len(finite) else (np.nan, np.nan)
        of_forces = rubbing is not None and name in FRICTION_SEVERITIES  # the factors are for errors of circuits only
        stretch = 1.0 if of_forces else widths.get(name, 1.0)
        least = unresolved.get(name, 0.0)
        ends = value - stretch * (value - low) - least, value + stretch * (high - value) + least
        if name == "bulk_modulus" and stretch != 1.0:  # in logarithms, so never negative
            ends = value * (low / value) ** stretch, value * (high / value) ** stretch
        found[name] = Quantity(value, UNITS[name], ends)
    if "entrained_air" not in asked:
        return found
    return found | {"entrained_air": _with_air_interval(found["entrained_air"], found["bulk_modulus"], actuator)}


@cache
def _normal_draws(coordinates: int) -> Array:
    """Return draws of white noise, shape (`DRAWS`, coordinates), equal for every log so that fits are repeatable."""
    return np.random.default_rng(0).standard_normal((DRAWS, coordinates))


def _unresolved_friction(actuator: Actuator) -> Mapping[str, float]:
    """Return the friction below the resolution of a fit, by severity: no logarithm starts at zero (`LEAST_FORCE`).

    It is zero if the healthy friction exceeds that at rest, at rated velocity and in the part between.
    """
    p = actuator.circuit
    parts, least = friction_parts(p, actuator.rated)
    if min(parts) >= least:
        return {}
    pressure = _rated_state(p)[1]
    rise = 100.0 * least / (p.piston_area * pressure) if pressure > 0.0 else 0.0
    return {"added_friction": least, "pressure_rise": rise}


def _draw_centres(circuits: Sequence[OpenCircuit]) -> Array:
    """Return the circuit about which each draw lies, in proportion to its probability, shape (`DRAWS` or 1, 7)."""
    shares = np.cumsum([one.probability for one in circuits])
    if len(circuits) == 1:
        return circuits[0].coordinates[None]
    of = np.searchsorted(shares / shares[-1], (np.arange(DRAWS) + 0.5) / DRAWS)
    return np.array([one.coordinates for one in circuits])[of]


@lru_cache(maxsize=16)
def healthy_severities(actuator: Actuator) -> Mapping[str, float]:
    """Return the severities of a healthy actuator, kept for the next log.

    Returns
    -------
    Mapping[str, float]
        In the units of `UNITS`.
    """
    return severities_at(actuator.conditions[0], actuator)


@lru_cache(maxsize=16)
def limits_of(actuator: Actuator) -> Mapping[str, float]:
    """Return the default limits beyond which an actuator is not sound; cached for the next log.

    Returns
    -------
    Mapping[str, float]
        Half-way from healthy to minor leakage or minor friction; the softest oil of a sound actuator of this kind. In
        the units of `UNITS`; air has no limit, since bulk modulus has one.
    """
    names, sound = list(CONDITIONS), healthy_severities(actuator)
    leaking, rubbing = (
        severities_at(actuator.conditions[names.index(name)], actuator) for name in ("minor_leakage", "minor_friction")
    )
    faulty = {
        **{name: leaking[name] for name in ("leakage_flow", "velocity_lost")},
        **{name: rubbing[name] for name in ("added_friction", "pressure_rise")},
    }
    halfway = {name: float(0.5 * (sound[name] + value)) for name, value in faulty.items()}
    return halfway | {"bulk_modulus": float((1.0 - KIND_SPREAD) * sound["bulk_modulus"])}


def with_bulk_modulus(found: Mapping[str, Quantity], estimated: Quantity, actuator: Actuator) -> Mapping[str, Quantity]:
    """Return severities with the estimated bulk modulus in place of the circuit's, and the air that follows.

    Parameters
    ----------
    found : Mapping[str, Quantity]
        Severities of a circuit.
    estimated : Quantity
        Effective bulk modulus [Pa]; without a value if the log does not determine it.

    Returns
    -------
    Mapping[str, Quantity]
        By the names of `UNITS`.
    """
    if estimated.value is None or estimated.ci95 is None:
        return {**found, "bulk_modulus": estimated, "entrained_air": Quantity(None, UNITS["entrained_air"])}
    ends, total = (
        None
        if ci is None
        else (float(_air_percent(max(ci[1], 1.0), actuator)), float(_air_percent(max(ci[0], 1.0), actuator)))
        for ci in (estimated.ci95, estimated.ci95_total)
    )
    air = Quantity(float(_air_percent(estimated.value, actuator)), UNITS["entrained_air"], ends, ci95_total=total)
    return {**found, "bulk_modulus": estimated, "entrained_air": _with_air_interval(air, estimated, actuator)}


def _air_percent(bulk_modulus: Any, actuator: Actuator) -> Any:
    """Return the air at atmospheric pressure that would make the oil so soft [%], for one modulus or many."""
    healthy = actuator.circuit
    softness = 1.0 / bulk_modulus - 1.0 / healthy.bulk_modulus
    return 100.0 * np.maximum(0.0, softness * healthy.accumulator_pressure**2 / ATMOSPHERE)


def _with_air_interval(air: Quantity, modulus: Quantity, actuator: Actuator) -> Quantity:
    """Return the air with an interval that begins at zero if bulk modulus may be that of a sound actuator."""
    unlike = actuator.circuit.bulk_modulus * (1.0 - KIND_SPREAD)

    ends, total = (
        None if one is None or stiff is None else (max(0.0, one[0]) if stiff[1] < unlike else 0.0, one[1])
        for one, stiff in ((air.ci95, modulus.ci95), (air.ci95_total, modulus.ci95_total))
    )
    return Quantity(air.value, air.unit, ends, ci95_total=total)
