"""Faults of the diaphragm motor as changes of its parameters, each with a severity.

A fault of one valve, diaphragm, electrode or chamber is one hypothesis for each place; faults of the whole motor are
one each. Friction and load, and other pairs, look alike from outside: `faults.diaphragm_motor.diagnose` lists them.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from operator import add
from typing import Any, TypeAlias

from estimation.diaphragm_motor.card import MOST_LEAKAGE
from plant.diaphragm_motor.parameters import ROWS, DiaphragmMotorParameters, with_changed_value
from plant.errors import HydrostateError, require_known

HEALTHY = "healthy"
"""Name of a motor without a fault."""

Change: TypeAlias = Callable[[float, float], float]
"""Maps a healthy value and a severity to the faulty value."""


@dataclass(frozen=True)
class MotorFault:
    """A fault at one place, or of the whole motor.

    Parameters
    ----------
    name : str
        Name, such as ``valve_4_leak``.
    kind : str
        The name without its place: ``valve_leak``.
    change : callable
        Function of the healthy value and the severity.
    severities : tuple of float
        Rising severities at which the fault's signature is computed [the fault's unit]; 0 is healthy.
    place : int
        Number of the valve or diaphragm, from 1 at the inlet; 0 for all.
    """

    name: str
    kind: str
    parameter: str
    change: Change
    meaning: str
    severities: tuple[float, ...]
    unit: str = "1"
    place: int = 0

    def inject(self, healthy: DiaphragmMotorParameters, severity: float) -> DiaphragmMotorParameters:
        """Return the motor with the fault.

        Parameters
        ----------
        healthy : DiaphragmMotorParameters
            The motor without the fault.
        severity : float
            Severity of the fault [the fault's unit].
        """
        value = getattr(healthy, self.parameter)
        if self.place:
            faulty = with_changed_value(value, self.place, self.change(value[self.place - 1], severity))
        elif self.parameter in ROWS:
            faulty = tuple(self.change(one, severity) for one in value)
        else:
            faulty = self.change(value, severity)
        return replace(healthy, **{self.parameter: faulty})


def _open_partly(value: float, severity: float) -> float:
    return value * (1.0 - severity) + severity


def _reduce_by_share(value: float, severity: float) -> float:
    return (1.0 - severity) * value


def _enlarge_by_share(value: float, severity: float) -> float:
    return (1.0 + severity) * value


def _faults_at_each_place(part: str, kind: str, parameter: str, *rest: Any) -> Iterator[MotorFault]:
    """Yield one kind of fault at each place; `rest` is as in `MotorFault`."""
    for place in range(1, ROWS[parameter] + 1):
        yield MotorFault(f"{part}_{place}_{kind.removeprefix(f'{part}_')}", kind, parameter, *rest, place=place)


def _whole_motor_fault(name: str, *rest: Any) -> MotorFault:
    return MotorFault(name, name, *rest)


_ALL = (
    *_faults_at_each_place(
        "valve",
        "valve_leak",
        "valve_leak",
        _open_partly,
        "opening of the shut valve; 100 % is stuck open",
        (0.0, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.45, 0.7, 1.0),
    ),
    *_faults_at_each_place(
        "valve",
        "valve_blocked",
        "valve_lift",
        _reduce_by_share,
        "share of its opening that the valve has lost",
        (0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9),
    ),
    *_faults_at_each_place(
        "diaphragm",
        "depolarised",
        "polarisation",
        _reduce_by_share,
        "share of its drive that the diaphragm has lost; 100 % is dead",
        (0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0),
    ),
    *_faults_at_each_place(
        "electrode",
        "gain",
        "sensor_gain",
        _enlarge_by_share,
        "relative change of the electrode's gain",
        (-1.0, 0.0, 1.0),
    ),
    *_faults_at_each_place(
        "chamber",
        "gas",
        "gas_fraction",
        add,
        "gas in the chamber above the healthy share, over its volume",
        (0.0, 0.002, 0.005, 0.01, 0.02, 0.04, 0.07, 0.1),
    ),
    _whole_motor_fault(
        "gas_everywhere",
        "gas_fraction",
        add,
        "gas in every chamber above the healthy share, over its volume",
        (0.0, 0.002, 0.005, 0.01, 0.02, 0.03, 0.05),
    ),
    _whole_motor_fault(
        "soft_clamp",
        "diaphragm_compliance",
        _enlarge_by_share,
        "relative rise of the diaphragms' compliance",
        (0.0, 0.05, 0.1, 0.2, 0.3, 0.45),
    ),
    _whole_motor_fault(
        "cylinder_leakage",
        "crossport_leakage",
        add,
        "leakage across the piston above the healthy one",
        (0.0, 2e-12, 5e-12, 1e-11, 1.5e-11, MOST_LEAKAGE),
        "m^3/(s Pa)",
    ),
    _whole_motor_fault(
        "friction",
        "coulomb_friction",
        add,
        "Coulomb friction above the healthy one",
        (0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0),
        "N",
    ),
    _whole_motor_fault(
        "load",
        "load_force",
        add,
        "load above the one given",
        (-15.0, -12.0, -9.0, -6.0, -3.0, 0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0),
        "N",
    ),
    _whole_motor_fault(
        "clogged_ports",
        "port_area",
        _reduce_by_share,
        "share of their area that all ports have lost",
        (0.0, 0.1, 0.2, 0.3, 0.4, 0.5),
    ),
    _whole_motor_fault(
        "slow_valves",
        "valve_lag",
        _enlarge_by_share,
        "relative rise of the valves' time constant",
        (0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0),
    ),
)

MOTOR_FAULTS: Mapping[str, MotorFault] = {fault.name: fault for fault in _ALL}
"""Every fault by name; places count from the inlet."""


def motor_with_fault(healthy: DiaphragmMotorParameters, name: str, severity: float) -> DiaphragmMotorParameters:
    """Return the motor with a fault.

    Parameters
    ----------
    name : str
        One of `MOTOR_FAULTS`.
    severity : float
        Severity of the fault [the fault's unit]; 0 is healthy.

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
        unit = "" if fault.unit == "1" else f" {fault.unit}"
        raise HydrostateError(f"severity of {name} must be {least:g} to {most:g}{unit}, got {severity:g}")
    return fault.inject(healthy, severity)
