"""Check valves, which let oil through one way."""

from plant.compiled.functions import Scalar, maximum


def check_valve_flow(drop: Scalar, conductance: Scalar, opening_pressure: Scalar) -> Scalar:
    """Return the flow of a check valve whose poppet lifts with the pressure drop: none backward, smooth at its seat.

    It opens in proportion ``drop / (drop + opening_pressure)``, so that flow and slope are continuous, and flow never
    runs against pressure. Source: judged, the paper gives no characteristic.

    Parameters
    ----------
    drop : float or Expression
        Pressure before the valve less that behind it [Pa].
    conductance : float or Expression
        Flow a pascal when wide open [m^3/(s Pa)].
    opening_pressure : float or Expression
        Drop at which it is half open [Pa], positive.

    Returns
    -------
    float or Expression
        Flow [m^3/s], not negative.

    Examples
    --------
    >>> float(check_valve_flow(7e3, 1e-9, 7e3)), float(check_valve_flow(-1e6, 1e-9, 7e3))
    (3.5e-06, 0.0)
    """
    forward = maximum(drop, 0.0)
    return conductance * forward * forward / (forward + opening_pressure)
