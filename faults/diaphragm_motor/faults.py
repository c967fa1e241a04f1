"""Faults of the diaphragm motor as changes of its parameters, each with a severity.

A fault of one valve, diaphragm, electrode or chamber is a hypothesis for each place; faults of the whole motor are one
each. Friction and load, and other pairs, look alike from outside: `faults.diaphragm_motor.diagnose` says which.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TypeAlias

from plant.diaphragm_motor.parameters import DIAPHRAGMS, VALVES, DiaphragmMotorParameters, changed
from plant.errors import HydrostateError, require_known

HEALTHY = "healthy"
"""What a motor without a fault is called."""

Injection: TypeAlias = Callable[[DiaphragmMotorParameters, float], DiaphragmMotorParameters]
"""From a healthy motor and a severity to a faulty one."""


@dataclass(frozen=True)
class MotorFault:
    """A fault at one place, or of the whole motor.

    Parameters
    ----------
    name : str
        Such as ``valve_4_leak``.
    kind : str
        The same without its place: ``valve_leak``.
    meaning : str
        What the severity is.
    unit : str
        Of the severity.
    severities : tuple of float
        Rising severities at which the fault's signature is computed [the fault's unit]; 0 is healthy.
    inject : callable
        Takes a healthy motor and a severity.
    """

    name: str
    kind: str
    meaning: str
    unit: str
    severities: tuple[float, ...]
    inject: Injection


def _valve_leak(place: int) -> Injection:
    return lambda p, s: replace(p, valve_leak=changed(p.valve_leak, place, p.valve_leak[place - 1] * (1.0 - s) + s))


def _valve_blocked(place: int) -> Injection:
    return lambda p, s: replace(p, valve_lift=changed(p.valve_lift, place, (1.0 - s) * p.valve_lift[place - 1]))


def _depolarised(place: int) -> Injection:
    return lambda p, s: replace(p, polarisation=changed(p.polarisation, place, (1.0 - s) * p.polarisation[place - 1]))


def _sensor_gain(place: int) -> Injection:
    return lambda p, s: replace(p, sensor_gain=changed(p.sensor_gain, place, (1.0 + s) * p.sensor_gain[place - 1]))


def _gas_in_chamber(place: int) -> Injection:
    return lambda p, s: replace(p, gas_fraction=changed(p.gas_fraction, place, p.gas_fraction[place - 1] + s))


def _soft_clamp(p: DiaphragmMotorParameters, s: float) -> DiaphragmMotorParameters:
    return replace(p, diaphragm_compliance=(1.0 + s) * p.diaphragm_compliance)


LOCAL: Mapping[str, tuple[str, int, str, tuple[float, ...], Callable[[int], Injection]]] = MappingProxyType(
    {
        "valve_leak": (
            "valve",
            VALVES,
            "opening of the shut valve; 1 is stuck open",
            (0.0, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0),
            _valve_leak,
        ),
        "valve_blocked": (
            "valve",
            VALVES,
            "share of its opening that the valve has lost",
            (0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9),
            _valve_blocked,
        ),
        "depolarised": (
            "diaphragm",
            DIAPHRAGMS,
            "share of its drive that the diaphragm has lost; 1 is dead",
            (0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0),
            _depolarised,
        ),
        "gain": ("electrode", DIAPHRAGMS, "relative change of the electrode's gain", (-1.0, 0.0, 1.0), _sensor_gain),
        "gas": (
            "chamber",
            DIAPHRAGMS,
            "gas in the chamber above the healthy share, over its volume",
            (0.0, 0.002, 0.005, 0.01, 0.02, 0.04, 0.07, 0.1),
            _gas_in_chamber,
        ),
    }
)
"""Faults of one place, by kind: of what, of how many, meaning and values of the severity, injection."""

GLOBAL = (
    MotorFault(
        "gas_everywhere",
        "gas_everywhere",
        "gas in every chamber above the healthy share, over its volume",
        "1",
        (0.0, 0.002, 0.005, 0.01, 0.02, 0.03, 0.05),
        lambda p, s: replace(p, gas_fraction=tuple(share + s for share in p.gas_fraction)),
    ),
    MotorFault(
        "soft_clamp",
        "soft_clamp",
        "relative rise of the diaphragms' compliance",
        "1",
        (0.0, 0.05, 0.1, 0.2, 0.3, 0.45),
        _soft_clamp,
    ),
    MotorFault(
        "cylinder_leakage",
        "cylinder_leakage",
        "leakage across the piston above the healthy one",
        "m^3/(s Pa)",
        (0.0, 2e-12, 5e-12, 1e-11, 1.5e-11, 2e-11),
        lambda p, s: replace(p, crossport_leakage=p.crossport_leakage + s),
    ),
    MotorFault(
        "friction",
        "friction",
        "Coulomb friction above the healthy one",
        "N",
        (0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0),
        lambda p, s: replace(p, coulomb_friction=p.coulomb_friction + s),
    ),
    MotorFault(
        "load",
        "load",
        "load above the one given",
        "N",
        (-15.0, -12.0, -9.0, -6.0, -3.0, 0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0),
        lambda p, s: replace(p, load_force=p.load_force + s),
    ),
    MotorFault(
        "clogged_ports",
        "clogged_ports",
        "share of their area that all ports have lost",
        "1",
        (0.0, 0.1, 0.2, 0.3, 0.4, 0.5),
        lambda p, s: replace(p, port_area=(1.0 - s) * p.port_area),
    ),
    MotorFault(
        "slow_valves",
        "slow_valves",
        "relative rise of the valves' time constant",
        "1",
        (0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0),
        lambda p, s: replace(p, valve_lag=(1.0 + s) * p.valve_lag),
    ),
)
"""Faults of the whole motor."""

MOTOR_FAULTS: Mapping[str, MotorFault] = MappingProxyType(
    {
        fault.name: fault
        for fault in (
            *(
                MotorFault(f"{part}_{place}_{_short}", kind, meaning, "1", severities, at(place))
                for kind, (part, places, meaning, severities, at) in LOCAL.items()
                for _short in [kind.removeprefix(f"{part}_")]
                for place in range(1, places + 1)
            ),
            *GLOBAL,
        )
    }
)
"""Every fault by name; places count from the inlet."""


def motor_with_fault(healthy: DiaphragmMotorParameters, name: str, severity: float) -> DiaphragmMotorParameters:
    """Return the motor with a fault.

    Parameters
    ----------
    healthy : DiaphragmMotorParameters
        The healthy motor.
    name : str
        One of `MOTOR_FAULTS`.
    severity : float
        How bad [the fault's unit]; 0 is healthy.

    Returns
    -------
    DiaphragmMotorParameters
        The motor.

    Raises
    ------
    HydrostateError
        If there is no such fault, or the severity is beyond its range.

    Examples
    --------
    >>> motor_with_fault(DiaphragmMotorParameters(), "diaphragm_4_depolarised", 0.2).polarisation
    (1.0, 1.0, 1.0, 0.8, 1.0, 1.0, 1.0)
    """
    require_known("a fault of the diaphragm motor", name, MOTOR_FAULTS)
    fault = MOTOR_FAULTS[name]
    least, most = fault.severities[0], fault.severities[-1]
    if not least <= severity <= most:
        raise HydrostateError(f"severity of {name} must be {least:g} to {most:g} {fault.unit}, got {severity:g}")
    return fault.inject(healthy, severity)
