"""Initial states of the circuit: at rest, or under the pressure at the start of a log."""

from plant.compiled.functions import Scalar, maximum, minimum, where
from plant.components.oil import specific_volume
from plant.eha.circuit import CircuitState, CircuitValues, chamber_volumes


def at_rest(p: CircuitValues) -> CircuitState:
    """Return the state at rest in mid-stroke: both chambers at the accumulator's pressure, or one higher under a load.

    Parameters
    ----------
    p : CircuitParameters or namespace of float
        The circuit.

    Returns
    -------
    tuple of float
        As named in `STATES`.
    """
    return under_pressure(p.load_force / p.piston_area, 0.0, p)


def under_pressure(pressure: Scalar, velocity: Scalar, p: CircuitValues) -> CircuitState:
    """Return a state in mid-stroke under a differential pressure: one chamber is above the accumulator's pressure.

    The seals are deflected as far as the force on the piston deflects them.

    Parameters
    ----------
    pressure : float
        Differential pressure [Pa].
    velocity : float
        Piston velocity [m/s].
    p : CircuitParameters or namespace of float
        The circuit.

    Returns
    -------
    tuple of float
        As named in `STATES`.
    """
    push = p.piston_area * pressure - p.load_force
    bristle = maximum(minimum(push / where(p.friction_coulomb > 0.0, p.friction_coulomb, 1.0), 1.0), -1.0)
    filled_a, filled_b = (
        volume / specific_volume(p.accumulator_pressure + more, p.bulk_modulus, p.air_fraction, p.vapour_pressure)
        for volume, more in zip(chamber_volumes(0.0, p), (maximum(pressure, 0.0), maximum(-pressure, 0.0)), strict=True)
    )
    return 0.0, bristle, 0.0, velocity, filled_a, filled_b, p.accumulator_oil
