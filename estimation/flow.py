"""The flow form: bulk modulus and leakage from the pressure balance alone, where differential pressure is logged.

Motor speed and position are both measured, so both flows of equation 5.8 are known: what the pump delivers and what
the piston sweeps. Differential pressure is then a balance of two chambers with few unknowns, and friction does not
appear at all.
"""

from dataclasses import replace
from types import SimpleNamespace

from estimation.greybox import Drives, GreyBoxModel
from plant.compiled.functions import Scalar, absolute, sign, where
from plant.components.valves import pumped_flow


def flow_step(state: tuple[Scalar, Scalar], drives: Drives, p: SimpleNamespace, step: Scalar) -> tuple[Scalar, Scalar]:
    """Advance the two chamber pressures by one implicit Euler step (equations 5.1 to 5.4 with errata E2 and E8).

    Each chamber holds ``2 V_0`` and the volume that the piston sweeps, so that the two together are the lumped plant's
    ``V_0`` (errata E2). Leakage, make-up and relief are implicit; which valves are open is read off the old pressures.
    The log's speed is linear between samples, the motor's is not: towards its new speed a lagging motor is always
    ahead of the straight line, by ``T^2 / (12 lag)`` for sample time T, which `speed_lead` takes up.

    Parameters
    ----------
    state : tuple of float or Expression
        Absolute pressures of both chambers [Pa].
    drives : tuple of pairs
        Motor speed [rad/s] and piston position [m] at the start and end of the step.
    p : namespace
        The actuator's parameters and `speed_lead` [s], as floats or expressions.
    step : float or Expression
        Time step [s].

    Returns
    -------
    tuple of float or Expression
        Both pressures one step later [Pa].
    """
    p1, p2 = state
    (speed, next_speed), (x, next_x) = drives
    A, V, beta, supply = p.piston_area, 2.0 * p.chamber_volume, p.bulk_modulus, p.accumulator_pressure
    ahead = p.speed_lead * (next_speed - speed) / step
    delivered = 0.5 * (
        pumped_flow(speed + ahead, p.pump_displacement, p.flow_bias)
        + pumped_flow(next_speed + ahead, p.pump_displacement, p.flow_bias)
    )
    swept = A * (next_x - x) / step
    relieving = where(absolute(p1 - p2) > p.relief_pressure, p.relief_conductance, 0.0)
    through = p.leakage_coefficient + relieving
    net = delivered - swept + relieving * p.relief_pressure * sign(p1 - p2)
    swing = 0.5 * A * (x + next_x)
    stiffness_1, stiffness_2 = step * beta / (V + swing), step * beta / (V - swing)
    makeup_1 = where(p1 < supply, p.makeup_conductance, 0.0)
    makeup_2 = where(p2 < supply, p.makeup_conductance, 0.0)
    right_1 = p1 + stiffness_1 * (net + makeup_1 * supply)
    right_2 = p2 + stiffness_2 * (makeup_2 * supply - net)
    a11, a12 = 1.0 + stiffness_1 * (through + makeup_1), -(stiffness_1 * through)
    a22, a21 = 1.0 + stiffness_2 * (through + makeup_2), -(stiffness_2 * through)
    determinant = a11 * a22 - a12 * a21
    return (right_1 * a22 - a12 * right_2) / determinant, (a11 * right_2 - a21 * right_1) / determinant


def _at_rest(p: SimpleNamespace) -> tuple[Scalar, Scalar]:
    return p.accumulator_pressure, p.accumulator_pressure


def _differential(state: tuple[Scalar, Scalar]) -> Scalar:
    return state[0] - state[1]


FLOW_FORM = GreyBoxModel(
    name="flow",
    drives=("motor_speed_rad_s", "position_m"),
    output="differential_pressure_pa",
    unknowns=("bulk_modulus", "leakage_coefficient", "flow_bias", "makeup_conductance", "speed_lead"),
    initial=_at_rest,
    step=flow_step,
    observe=_differential,
)
"""The flow form with its unknowns; friction is none of them."""

RELIEVING_FLOW_FORM = replace(
    FLOW_FORM, name="flow_relieving", unknowns=(*FLOW_FORM.unknowns, "relief_pressure", "relief_conductance")
)
"""The same for a log in which the relief valve opens: its setting and slope are then unknown too."""
