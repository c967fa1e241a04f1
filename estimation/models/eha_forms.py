"""Process models of the electro-hydrostatic actuator, with effective bulk modulus as a state.

*Acceleration form* is the published one, equations 7.1 to 7.4 with errata E3, E4 and E8: it differentiates the
friction force and is therefore valid between reversals only (errata E9). *Pressure form* keeps differential pressure
as a state, so friction enters the force balance undifferentiated and the piston may stick.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from estimation.arrays import Array
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.functions import Scalar, sign
from plant.eha.model import PARAMETER_NAMES, EhaParameters, EhaValues, lumped_step, reduced_derivative

BULK_MODULUS = "bulk_modulus_pa"
"""Name of the state that every form estimates."""

BULK_MODULUS_STATE = StateVariable(BULK_MODULUS, "Pa", 1e8, 0.0, 0.0, 2e10)
"""Constant in time; scaled by 1e8 (errata E10); held between nothing and ten times pure oil."""


def with_bulk_modulus(p: EhaValues, bulk_modulus: Scalar) -> SimpleNamespace:
    """Return the parameters with another effective bulk modulus, which may be an expression.

    Parameters
    ----------
    bulk_modulus : float or Expression
        Effective bulk modulus [Pa], convention of equation 5.8 (errata E2).
    """
    values = {name: getattr(p, name) for name in PARAMETER_NAMES}
    return SimpleNamespace(**{**values, "bulk_modulus": bulk_modulus})


def acceleration_step(
    state: tuple[Scalar, Scalar, Scalar, Scalar], speeds: tuple[Scalar, Scalar], p: EhaValues, step: Scalar
) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Advance the published model by one explicit Euler step, equations 7.1 to 7.4 (errata E3, E8).

    Parameters
    ----------
    state : tuple of float or Expression
        Position [m], velocity [m/s], acceleration [m/s^2], effective bulk modulus [Pa].
    speeds : tuple of float or Expression
        Motor speed at the start and at the end of the step [rad/s]; the published step uses the first.
    p : EhaParameters or namespace of Expression
        The actuator; its own bulk modulus is not used.
    step : float or Expression
        Time step T [s].

    Returns
    -------
    tuple of float or Expression
        The state one step later.
    """
    x, v, a, beta = state
    _, _, jerk = reduced_derivative((x, v, a), speeds[0], with_bulk_modulus(p, beta))
    return x + step * v, v + step * a, a + step * jerk, beta


def printed_step(
    state: tuple[Scalar, Scalar, Scalar, Scalar], speeds: tuple[Scalar, Scalar], p: EhaValues, step: Scalar
) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Advance the published model as printed in equations 7.1 to 7.4, to show what that does.

    The quadratic part of friction is divided by the volume too (errata E3), and the flow bias stands as in 5.8
    (errata E8).

    Parameters
    ----------
    state : tuple of float or Expression
        Position [m], velocity [m/s], acceleration [m/s^2], effective bulk modulus [Pa].
    speeds : tuple of float or Expression
        Motor speed at the start and at the end of the step [rad/s]; the published step uses the first.
    p : EhaParameters or namespace of Expression
        The actuator; its own bulk modulus is not used.
    step : float or Expression
        Time step T [s].

    Returns
    -------
    tuple of float or Expression
        The state one step later.
    """
    x1, x2, x3, x4 = state
    A, V0, M, L = p.piston_area, p.chamber_volume, p.moving_mass, p.leakage_coefficient
    a1, a2, a3 = p.friction_quadratic, p.friction_linear, p.friction_coulomb
    u = p.pump_displacement * speeds[0] - sign(speeds[0]) * p.flow_bias
    decay = (a2 * V0 + M * L * x4) / (M * V0) * x3
    swept = (A * A + a2 * L) / (M * V0) * x4 * x2
    rubbed = (2.0 * a1 * x2 * x3 / (M * V0) + (a1 * x2 * x2 + a3) * L / (M * V0) * x4) * sign(x2)
    return x1 + step * x2, x2 + step * x3, x3 + step * (A * u / (M * V0) * x4 - decay - swept - rubbed), x4


def pressure_step(
    state: tuple[Scalar, Scalar, Scalar, Scalar], speeds: tuple[Scalar, Scalar], p: EhaValues, step: Scalar
) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Advance the lumped model by one implicit step, equations 5.8 to 5.10 (errata E9).

    Parameters
    ----------
    state : tuple of float or Expression
        Position [m], velocity [m/s], differential pressure [Pa], effective bulk modulus [Pa].
    speeds : tuple of float or Expression
        Motor speed at the start and at the end of the step [rad/s].
    p : EhaParameters or namespace of Expression
        The actuator; its own bulk modulus is not used.
    step : float or Expression
        Time step [s].

    Returns
    -------
    tuple of float or Expression
        The state one step later.
    """
    x, v, dp, beta = state
    return (*lumped_step((x, v, dp), speeds, with_bulk_modulus(p, beta), step), beta)


def undetermined_volume(
    p: EhaParameters, unknown: Mapping[str, Array], sample_time: float
) -> tuple[Array, Mapping[str, float]]:
    """Return the variance of chamber volume due to gaps in the drives, and the shift of each state with it.

    Pressures are moved as if the piston stood still, position and velocity as if the oil were rigid, acceleration by
    the force of that pressure: all as far as they may.

    Parameters
    ----------
    unknown : Mapping[str, ndarray], each of shape (n,)
        Variance of what the pump turned [rad^2], and of where the piston was [m^2], sample by sample.
    sample_time : float
        Time between samples [s].

    Returns
    -------
    tuple of (ndarray, Mapping[str, float])
        Variance of the volume that each sample adds [m^6], and by state name [SI unit of the state per m^3].
    """
    A, V0, M, beta = p.piston_area, p.chamber_volume, p.moving_mass, p.bulk_modulus
    factors = {"motor_speed_rad_s": p.pump_displacement, "position_m": A}
    volume = np.sum([factors[drive] ** 2 * variance for drive, variance in unknown.items()], axis=0)
    return volume, {
        "position_m": 1.0 / A,
        "velocity_m_s": 1.0 / (A * sample_time),
        "acceleration_m_s2": A / M * beta / V0,
        "differential_pressure_pa": beta / V0,
        "pressure_a_pa": 0.5 * beta / V0,
        "pressure_b_pa": 0.5 * beta / V0,
    }


def _observe_motion(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    del p
    return {"position_m": state[0], "velocity_m_s": state[1]}


def _observe_motion_and_pressure(state: tuple[Scalar, ...], p: EhaValues) -> Mapping[str, Scalar]:
    return {**_observe_motion(state, p), "differential_pressure_pa": state[2]}


ACCELERATION_FORM = ProcessModel(
    "acceleration",
    (
        StateVariable("position_m", "m", 1e-3, 1e-10),
        StateVariable("velocity_m_s", "m/s", 1e-2, 1e-6),
        StateVariable("acceleration_m_s2", "m/s^2", 1.0, 1.0),
        BULK_MODULUS_STATE,
    ),
    acceleration_step,
    _observe_motion,
    longest_step=1e-4,
    parameters=EhaParameters,
    opening=undetermined_volume,
)

PRINTED_FORM = replace(ACCELERATION_FORM, name="acceleration_as_printed", step=printed_step)
"""The published form as printed, with its misprint: it is no choice of `FORMS`."""

PRESSURE_FORM = replace(
    ACCELERATION_FORM,
    name="pressure",
    states=(
        StateVariable("position_m", "m", 1e-3, 1e-13),
        StateVariable("velocity_m_s", "m/s", 1e-2, 1e-2),
        StateVariable("differential_pressure_pa", "Pa", 1e5, 1e6),
        BULK_MODULUS_STATE,
    ),
    step=pressure_step,
    observe=_observe_motion_and_pressure,
)

FORMS: Mapping[str, ProcessModel] = {model.name: model for model in (ACCELERATION_FORM, PRESSURE_FORM)}
"""The process models, by name."""
