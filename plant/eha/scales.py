"""Factors by which the paper rig's leakage and friction are multiplied to mean the same on another actuator.

Section 3 defines leakage by the fraction of velocity that it costs and friction by the fraction of pressure that it
adds, both in the normal state at rated speed.
"""

import math
from collections.abc import Container, Mapping
from dataclasses import replace
from functools import lru_cache

from plant.eha.model import SIZED_BY_PUMP, EhaParameters
from plant.eha.steady_state import steady_state

PAPER_RIG = EhaParameters()
"""The rig on which Tables 3 and 4 were measured."""


def leakage_scales(p: EhaParameters) -> Mapping[str, float]:
    """Return the scales of leakage coefficient and flow bias.

    Flow bias scales with the rated flow of the pump, the leakage coefficient with that flow divided by the differential
    pressure at which the healthy actuator settles.

    Returns
    -------
    Mapping[str, float]
        By parameter; 1 for the paper's rig [dimensionless].

    Examples
    --------
    >>> leakage_scales(EhaParameters())
    {'leakage_coefficient': 1.0, 'flow_bias': 1.0}
    """
    flow = p.rated_flow / PAPER_RIG.rated_flow
    return {"leakage_coefficient": flow / _pressure_ratio(p), "flow_bias": flow}


def friction_scales(p: EhaParameters) -> Mapping[str, float]:
    """Return the scales of the three coefficients of friction.

    Friction scales with that differential pressure times the piston's area, at the same fraction of the velocity that
    the pump's rated flow would give without losses.

    Returns
    -------
    Mapping[str, float]
        By parameter; 1 for the paper's rig [dimensionless].

    Examples
    --------
    >>> friction_scales(EhaParameters())["friction_coulomb"]
    1.0
    """
    area = p.piston_area / PAPER_RIG.piston_area
    velocity = p.rated_flow / PAPER_RIG.rated_flow / area
    force = area * _pressure_ratio(p)
    return {
        "friction_quadratic": force / velocity**2,
        "friction_linear": force / velocity,
        "friction_coulomb": force,
    }


def with_valves_sized(p: EhaParameters, given: Container[str]) -> EhaParameters:
    """Return an actuator whose valves pass its own pump's flow, unless its rig file gives the valves.

    A single-rod actuator sends half of that flow through its make-up valves at every stroke. With the paper's valves, a
    pump of 15 times the flow lost 5 bar there, and the friction estimate was half the true value. Values that a file
    gives are not changed.

    Parameters
    ----------
    p : EhaParameters
        The actuator, with the paper's valves unless the file gives them.
    given : container of str
        Entries that its rig file gives.

    Returns
    -------
    EhaParameters
        With the paper's pressure drop at rated flow.

    Examples
    --------
    >>> with_valves_sized(EhaParameters(), ()) == EhaParameters()
    True
    """
    flow = p.rated_flow / PAPER_RIG.rated_flow
    return replace(p, **{name: flow * getattr(p, name) for name in SIZED_BY_PUMP if name not in given})


def natural_frequency(p: EhaParameters) -> float:
    """Return the natural frequency of the piston on its oil, with pump and valves shut, in mid-stroke.

    Source: Merritt, Hydraulic Control Systems (1967), section 6-2, for two chambers of ``2 V_0`` each.

    Returns
    -------
    float
        [Hz]

    Examples
    --------
    >>> round(natural_frequency(EhaParameters()))
    39
    """
    stiffness = p.bulk_modulus * p.piston_area**2 / p.chamber_volume
    return (stiffness / p.moving_mass) ** 0.5 / (2.0 * math.pi)


@lru_cache(maxsize=256)
def _pressure_ratio(p: EhaParameters) -> float:
    """Return the healthy pressure at rated speed over the paper's; 1 for an actuator that needs no pressure.

    Cached: the starts of a search, and the nine conditions of each log of a batch, use it for the same rig.
    """
    _, pressure = steady_state(p.rated_speed, p)
    _, paper = steady_state(PAPER_RIG.rated_speed, PAPER_RIG)
    return pressure / paper if pressure > 0.0 else 1.0
