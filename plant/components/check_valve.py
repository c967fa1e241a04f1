"""Check valves, which let oil through one way."""

from plant.compiled.functions import Scalar, maximum, where


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


def make_up_flow(
    chamber: Scalar,
    other: Scalar,
    supply: Scalar,
    conductance: Scalar,
    opening_pressure: Scalar,
    pilot_share: Scalar,
) -> Scalar:
    """Return the make-up flow from the inner circuit into a chamber, less the back flow that a pilot permits.

    A single rod displaces more oil on one side than on the other; what is over leaves through the low side's valve,
    which the pressure of the other side holds open. Source: Rahmfeld and Ivantysynova, *Displacement controlled linear
    actuator with differential cylinder*, International Journal of Fluid Power 2 (2001).

    Parameters
    ----------
    chamber, other : float or Expression
        Pressures of this chamber and of the other [Pa].
    supply : float or Expression
        Pressure of the inner circuit [Pa].
    conductance : float or Expression
        Flow of the valve a pascal when wide open [m^3/(s Pa)].
    opening_pressure : float or Expression
        Drop at which it is half open [Pa].
    pilot_share : float or Expression
        Conductance while it is held open, over its own; 0 for a plain check valve [dimensionless].

    Returns
    -------
    float or Expression
        Flow into the chamber [m^3/s].
    """
    drop = supply - chamber
    piloted = where(other > chamber, pilot_share * conductance * drop, 0.0)
    return check_valve_flow(drop, conductance, opening_pressure) + piloted
