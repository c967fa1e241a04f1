"""Faults as physical changes of the circuit: throttle voltages, air in the oil, a worn pump, a drifting relief valve.

Each function returns changed parameters; `faults.eha.inject.abrupt_fault` and `faults.eha.inject.growing_fault` apply
them over time.
"""

from dataclasses import replace
from math import isfinite

import numpy as np

from faults.conditions import FRICTION_TABLE, LEAKAGE_TABLE, LEVELS, PAPER_RIG
from plant.components.orifice import effective_area, orifice_constant, orifice_friction
from plant.eha.circuit_parameters import MOST_AIR, CircuitParameters
from plant.eha.throttles import SHUT_VOLTS, ThrottleA, ThrottleB, require_volts
from plant.errors import HydrostateError

OIL_DENSITY = 860.0
"""Density of hydraulic oil [kg/m^3], judged; it cancels between calibration and use."""

SHUT_ORIFICE = 3.7e-10
"""Flow of a shut throttle over the root of pressure [m^3/(s Pa^0.5)], judged: 100 mL/min at 207 bar."""

VOLTS_A = (SHUT_VOLTS, 2.0, 1.75)
"""Throttle A's voltages for leakage none, minor, major [V], Table 1 (errata E6)."""

VOLTS_B = (0.0, 2.3, 2.5)
"""Throttle B's voltages for friction none, minor, major [V], Table 1."""

THROTTLE_A = ThrottleA(
    VOLTS_A,
    tuple(LEAKAGE_TABLE[level].leakage_coefficient for level in LEVELS),
    tuple(LEAKAGE_TABLE[level].flow_bias for level in LEVELS),
)
"""Throttle A of the paper's rig: Table 3 at Table 1's voltages."""


def _orifice_area(orifice: float) -> float:
    return orifice * (0.5 * OIL_DENSITY) ** 0.5


def _paper_throttle_b() -> ThrottleB:
    """Return throttle B: rated at 0 V, Table 4's increments of a_1 at Table 1's voltages, shut at 10 V."""
    p = CircuitParameters()
    open_area = _orifice_area(float(orifice_constant(p.throttle_rated_flow, p.throttle_rated_pressure)))
    at_open = orifice_friction(OIL_DENSITY, p.piston_area, open_area)
    healthy, *faulty = (FRICTION_TABLE[level].friction_quadratic for level in LEVELS)
    areas = [float(effective_area(OIL_DENSITY, p.piston_area, a1 - healthy + at_open)) for a1 in faulty]
    return ThrottleB(
        (SHUT_VOLTS, *reversed(VOLTS_B)),
        (_orifice_area(SHUT_ORIFICE), *reversed(areas), open_area),
    )


THROTTLE_B = _paper_throttle_b()
"""Throttle B of the paper's rig."""


def with_throttles(base: CircuitParameters, a_volts: float, b_volts: float) -> CircuitParameters:
    """Return the circuit with its throttles at other voltages; the given circuit is healthy, with A shut and B open.

    At Table 1's voltages the paper's rig becomes Tables 3 and 4. Throttle A adds a leakage path and its bias; B adds an
    orifice's load on the coupled cylinder (a_1). a_2 and a_3 belong to the seals and are interpolated linearly in that
    load between Table 4's rows, so that friction rises at every speed; beyond the last row they stay constant. Another
    rig keeps its own values and has the paper's valves added.

    Parameters
    ----------
    base : CircuitParameters
        The healthy circuit.
    a_volts, b_volts : float
        Control voltages of throttles A and B [V], 0 to 10; 10 V is shut.

    Raises
    ------
    RigError
        If a voltage is not between 0 and 10 V.

    Examples
    --------
    >>> round(with_throttles(CircuitParameters(), 2.0, 2.5).friction_quadratic)
    4462000
    """
    require_volts("throttle B", b_volts)
    leakage, bias = THROTTLE_A.at(a_volts)
    load, open_load = (
        orifice_friction(OIL_DENSITY, PAPER_RIG.piston_area, THROTTLE_B.at(volts)) for volts in (b_volts, 0.0)
    )
    linear, coulomb = _seal_friction_ratios(load - open_load)
    return replace(
        base,
        leakage_coefficient=base.leakage_coefficient + (leakage - PAPER_RIG.leakage_coefficient),
        flow_bias=base.flow_bias + (bias - PAPER_RIG.flow_bias),
        friction_quadratic=base.friction_quadratic + (load - open_load),
        friction_linear=base.friction_linear + linear,
        friction_coulomb=base.friction_coulomb + coulomb,
    )


def aerated(base: CircuitParameters, air_fraction: float) -> CircuitParameters:
    """Return the circuit with air in its oil.

    Parameters
    ----------
    air_fraction : float
        Entrained air at atmospheric pressure [dimensionless], 0 to 0.5.

    Raises
    ------
    HydrostateError
        If the fraction is out of range.
    """
    _require("air fraction", air_fraction, MOST_AIR)
    return replace(base, air_fraction=air_fraction)


def with_drifted_relief(base: CircuitParameters, factor: float) -> CircuitParameters:
    """Return the circuit with another set-point of its relief valve.

    Parameters
    ----------
    factor : float
        Set-point relative to the healthy one [dimensionless], positive, at most 2.

    Raises
    ------
    HydrostateError
        If the factor is out of range.

    Examples
    --------
    >>> with_drifted_relief(CircuitParameters(), 0.5).relief_pressure
    1723750.0
    """
    if factor == 0.0:
        raise HydrostateError("relief factor must be positive, got 0.0")
    _require("relief factor", factor, 2.0)
    return replace(base, relief_pressure=factor * base.relief_pressure)


def _seal_friction_ratios(load: float) -> tuple[float, float]:
    """Return a_2 and a_3 relative to their healthy values for a load of throttle B, between Table 4's rows."""
    levels = [FRICTION_TABLE[level] for level in LEVELS]
    loads = [level.friction_quadratic - levels[0].friction_quadratic for level in levels]
    linear, coulomb = (
        float(np.interp(load, loads, [getattr(level, name) - getattr(levels[0], name) for level in levels]))
        for name in ("friction_linear", "friction_coulomb")
    )
    return linear, coulomb


def _require(name: str, value: float, highest: float) -> None:
    if not (isfinite(value) and 0.0 <= value <= highest):
        raise HydrostateError(f"{name} must be between 0 and {highest:g}, got {value!r}")
