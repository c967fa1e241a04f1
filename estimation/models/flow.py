"""The flow form: bulk modulus and leakage from the pressure balance alone, where differential pressure is logged.

Motor speed and position are both measured, so both flows of equation 5.8 are known: what the pump delivers and what
the piston sweeps. Differential pressure is then a balance of two chambers with few unknowns, and friction does not
appear at all.
"""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from estimation.arrays import Array
from estimation.models.flow_parameters import FlowParameters
from estimation.models.greybox import GreyBoxModel
from estimation.models.inner_circuit import accumulator_rate, inner_flows
from plant.compiled.functions import Scalar, absolute, maximum, sign, where
from plant.components.oil import ATMOSPHERE
from plant.components.valves import pumped_flow
from plant.eha.circuit import chamber_volumes
from plant.eha.model import piston_areas


class Delivery(NamedTuple):
    """External inputs of the chambers: pump flow, and the piston's velocity and position.

    Parameters
    ----------
    pumped : float or Expression
        Flow of the pump [m^3/s].
    velocity : float or Expression
        Piston velocity [m/s].
    position : float or Expression
        Piston position [m].
    """

    pumped: Scalar
    velocity: Scalar
    position: Scalar


def delivered_flow(speeds: tuple[Scalar, Scalar], p: SimpleNamespace, step: Scalar, share: Scalar) -> Scalar:
    """Return the pump's flow within a step (errata E8); the motor leads the straight line between samples.

    The log's speed is linear between samples, the motor's is not: a motor with a lag that approaches its new speed
    always leads the straight line, by ``T^2 / (12 lag)`` for sample time T, which is `speed_lead`.

    Parameters
    ----------
    speeds : tuple of float or Expression
        Motor speed at the start and end of the step [rad/s].
    p : namespace
        The actuator's parameters and `speed_lead` [s].
    step : float or Expression
        Time step [s].
    share : float or Expression
        How far into the step [fraction].

    Returns
    -------
    float or Expression
        Flow [m^3/s].
    """
    speed, next_speed = speeds
    slope = next_speed - speed
    return pumped_flow(speed + share * slope + p.speed_lead * slope / step, p.pump_displacement, p.flow_bias)


def chamber_rates(
    pressures: tuple[Scalar, Scalar],
    delivery: Delivery,
    p: SimpleNamespace,
    *,
    by_mass: bool,
    cracks: tuple[Scalar, Scalar] = (0.0, 0.0),
    bend: Scalar = 0.0,
) -> tuple[Scalar, Scalar]:
    """Return the rates of change of the chamber pressures (equations 5.1 to 5.4 with errata E2, E8 and E17).

    Each chamber holds ``2 V_0``, on average of the two, and the volume that the piston sweeps, so that the two together
    are the lumped plant's ``V_0`` (errata E2).

    Balanced by mass, oil that leaves a chamber under pressure is denser than where it arrives by
    ``(p1 - p2) / beta``, and its tangent stiffness falls as it is compressed; equations 5.1 to 5.4 balance volumes,
    which loses nothing while pressures are a small part of bulk modulus.

    Parameters
    ----------
    pressures : tuple of float or Expression
        Absolute, of both chambers [Pa].
    delivery : Delivery
        Pumped flow, velocity and position [m^3/s, m/s, m].
    p : namespace
        The actuator's parameters, `case_leakage` a port to the inner circuit [m^3/(s Pa)], and `makeup_opening`, the
        drop at which a check valve is half open [Pa].
    by_mass : bool
        Whether flows are balanced by mass rather than by volume.
    cracks : tuple of float or Expression
        Drops at which the make-up valves leave their seats [Pa].
    bend : float or Expression
        See `inner_flows` [1/Pa].

    Returns
    -------
    tuple of float or Expression
        Rates [Pa/s].
    """
    p1, p2 = pressures
    pumped, velocity, position = delivery
    beta = p.bulk_modulus
    area_1, area_2 = piston_areas(p)
    volume_1, volume_2 = chamber_volumes(position, p)
    dp = p1 - p2
    into_1, into_2 = inner_flows(pressures, p, cracks, bend)
    stiffness_1 = beta - (p1 - ATMOSPHERE) if by_mass else beta
    stiffness_2 = beta - (p2 - ATMOSPHERE) if by_mass else beta
    # density is inversely proportional to that stiffness
    swelling = (dp / stiffness_1, dp / stiffness_2) if by_mass else (0.0, 0.0)
    at_1, at_2 = port_flows(pumped, leaked_flow(dp, p.leakage_coefficient, p), dp, swelling)
    return (
        stiffness_1 * (at_1 - area_1 * velocity + into_1) / volume_1,
        stiffness_2 * (area_2 * velocity - at_2 + into_2) / volume_2,
    )


def leaked_flow(dp: Scalar, leakage: Scalar, p: SimpleNamespace) -> Scalar:
    """Return the cross-chamber flow: piston leakage and relief valve.

    Parameters
    ----------
    dp : float or Expression
        Differential pressure [Pa].
    leakage : float or Expression
        Leakage coefficient [m^3/(s Pa)].
    p : namespace
        `relief_conductance` [m^3/(s Pa)] and `relief_pressure` [Pa].

    Returns
    -------
    float or Expression
        Flow from chamber 1 to chamber 2 [m^3/s].
    """
    return leakage * dp + sign(dp) * p.relief_conductance * maximum(absolute(dp) - p.relief_pressure, 0.0)


def port_flows(pumped: Scalar, leaked: Scalar, dp: Scalar, swelling: tuple[Scalar, Scalar]) -> tuple[Scalar, Scalar]:
    """Return the flow into chamber 1 and that out of chamber 2, each as its volume there.

    A flow is counted at its outlet for the pump, at its inlet for a leak: the denser side is chamber 1 if ``dp > 0``.

    Parameters
    ----------
    pumped, leaked : float or Expression
        Flow of the pump, and of leakage and relief [m^3/s].
    dp : float or Expression
        Differential pressure [Pa].
    swelling : tuple of float or Expression
        Relative growth of oil that goes from chamber 1 to chamber 2, of its volume in chamber 2 and of that in chamber
        1; 0 where volumes are balanced [fraction].

    Returns
    -------
    tuple of float or Expression
        Flows [m^3/s].
    """
    grown, shrunk = 1.0 + swelling[0], 1.0 - swelling[1]
    at_1 = pumped * where(pumped > 0.0, 1.0, shrunk) - leaked * where(dp > 0.0, 1.0, shrunk)
    at_2 = pumped * where(pumped > 0.0, grown, 1.0) - leaked * where(dp > 0.0, grown, 1.0)
    return at_1, at_2


def flow_rates(
    state: tuple[Scalar, Scalar],
    drives: Any,
    p: SimpleNamespace,
    share: Scalar,
    *,
    by_mass: bool = False,
    bend: Scalar = 0.0,
) -> tuple[Scalar, Scalar]:
    """Return the rates of the flow form: both flows are measured.

    Parameters
    ----------
    state : tuple of float or Expression
        Absolute pressures of both chambers [Pa].
    drives : tuple
        Motor speed [rad/s] and piston position [m] at the start and end of the step, and its length [s].
    p : namespace
        As `chamber_rates` needs them, and `speed_lead` [s].
    share : float or Expression
        How far into the step [fraction].
    by_mass : bool
        See `chamber_rates`.
    bend : float or Expression
        See `inner_flows` [1/Pa].

    Returns
    -------
    tuple of float or Expression
        Rates [Pa/s].
    """
    cracks = p.crack_a, p.crack_b
    return chamber_rates(state, _delivery(drives, p, share), p, by_mass=by_mass, cracks=cracks, bend=bend)


def _delivery(drives: Any, p: SimpleNamespace, share: Scalar) -> Delivery:
    """Return the flow, velocity and position within a step, between those measured at its ends."""
    speeds, (x, next_x), step = drives
    return Delivery(delivered_flow(speeds, p, step, share), (next_x - x) / step, x + share * (next_x - x))


def fed_rates(
    state: tuple[Scalar, Scalar, Scalar],
    drives: Any,
    p: SimpleNamespace,
    share: Scalar,
    *,
    by_mass: bool,
    bent: bool = False,
) -> tuple[Scalar, Scalar, Scalar]:
    """Return the rates of both chambers and of the inner circuit that feeds them.

    Parameters
    ----------
    state : tuple of float or Expression
        Absolute pressures of both chambers and of the inner circuit [Pa].
    drives : tuple
        As of `flow_rates`.
    p : namespace
        As of `flow_rates`, and `accumulator_stiffness` [Pa/m^3] and, of bent ones, `makeup_bend` [1/Pa].
    share : float or Expression
        How far into the step [fraction].
    by_mass : bool
        See `chamber_rates`.
    bent : bool
        Whether make-up valves are orifices at a large drop, see `inner_flows`.

    Returns
    -------
    tuple of float or Expression
        Rates [Pa/s].
    """
    p1, p2, supply = state
    bend = p.makeup_bend if bent else 0.0
    fed = SimpleNamespace(**{**vars(p), "accumulator_pressure": supply})
    into_1, into_2 = inner_flows((p1, p2), fed, (p.crack_a, p.crack_b), bend)
    pushed_back = accumulator_rate(into_1 + into_2, supply, p)
    return *flow_rates((p1, p2), drives, fed, share, by_mass=by_mass, bend=bend), pushed_back


def _held_volume_rates(
    state: tuple[Scalar, Scalar], drives: Any, p: SimpleNamespace, share: Scalar
) -> tuple[Scalar, Scalar]:
    in_the_middle = _delivery(drives, p, share)._replace(position=0.0)
    return chamber_rates(state, in_the_middle, p, by_mass=False, cracks=(p.crack_a, p.crack_b))


def _at_rest(p: SimpleNamespace) -> tuple[Scalar, Scalar]:
    return p.accumulator_pressure, p.accumulator_pressure


def all_at_rest(p: SimpleNamespace) -> tuple[Scalar, Scalar, Scalar]:
    """Return the pressures of both chambers and the inner circuit at rest [Pa]."""
    return p.accumulator_pressure, p.accumulator_pressure, p.accumulator_pressure


def _differential(state: tuple[Scalar, ...]) -> tuple[Scalar]:
    return (state[0] - state[1],)


FLOW_FORM = GreyBoxModel(
    name="flow",
    drives=("motor_speed_rad_s", "position_m"),
    outputs=("differential_pressure_pa",),
    unknowns=(
        "bulk_modulus",
        "leakage_coefficient",
        "flow_bias",
        "makeup_conductance",
        "makeup_opening",
        "case_leakage",
        "speed_lead",
    ),
    initial=_at_rest,
    rates=flow_rates,
    observe=_differential,
    parameters=FlowParameters,
    linear=(("speed_lead", 1e-5),),
    jump=(0.5, -0.5),
)
"""The flow form with its unknowns, balanced by volume, without friction."""

STIFFNESS = "accumulator_stiffness"
"""Rise of the inner circuit's pressure per volume of oil that the chambers return to it [Pa/m^3]. Without it, bulk
modulus of a circuit with 1 L of gas comes out up to 0.8 % wrong."""

MASS_FLOW_FORM = replace(
    FLOW_FORM,
    name="flow_mass",
    unknowns=(*FLOW_FORM.unknowns, STIFFNESS),
    initial=all_at_rest,
    rates=partial(fed_rates, by_mass=True),
    jump=(0.5, -0.5, 0.0),
)
"""Balanced by mass, with an inner circuit whose pressure rises with the oil that it takes."""


HELD_FLOW_FORM = replace(FLOW_FORM, name="flow_held", rates=_held_volume_rates)
"""The same with the volumes that the chambers have in mid-stroke, as equation 5.8 holds them: of an actuator whose dead
volume is far larger than what the piston sweeps, and of the lumped plant."""

NEAR_RELIEF = 0.97
"""Share of the relief setting above which the valve is assumed to open [fraction]."""


def reaches_relief(pressure: Array, setting: float) -> bool:
    """Return whether the relief valve opens in a log.

    Parameters
    ----------
    pressure : ndarray of any shape
        Differential pressure [Pa]; NaN is missing.
    setting : float
        The valve's setting [Pa].

    Examples
    --------
    >>> reaches_relief(np.array([0.0, np.nan, -3.4e6]), 3.4475e6)
    True
    """
    return float(np.nanmax(np.abs(pressure))) > NEAR_RELIEF * setting


def form_with_relief(form: GreyBoxModel) -> GreyBoxModel:
    """Return the form for a log in which the relief valve opens: its setting and slope are then unknown too."""
    return replace(form, unknowns=(*form.unknowns, "relief_pressure", "relief_conductance"))
