"""Check valves, which let oil through in one direction."""

from plant.compiled.functions import Scalar, maximum, where


def check_valve_flow(drop: Scalar, conductance: Scalar, opening_pressure: Scalar) -> Scalar:
    """Return the flow of a check valve whose poppet lifts with the pressure drop: none backward, smooth at the seat.

    The opening is ``drop / (drop + opening_pressure)``, so flow and slope are continuous, and oil never flows against
    the pressure. Source: judged, the paper gives no characteristic.

    Parameters
    ----------
    drop : float or Expression
        Upstream pressure minus downstream pressure [Pa].
    conductance : float or Expression
        Flow per pascal when wide open [m^3/(s Pa)].
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
    """Return the make-up flow from the inner circuit into a chamber, minus the back flow through a piloted valve.

    A single-rod piston displaces more oil on one side than on the other. The excess leaves through the valve of the
    low-pressure side, which the pressure of the other side holds open. Source: Rahmfeld and Ivantysynova, *Displacement
    controlled linear actuator with differential cylinder*, International Journal of Fluid Power 2 (2001).

    Parameters
    ----------
    chamber, other : float or Expression
        Pressures of this chamber and of the other [Pa].
    supply : float or Expression
        Pressure of the inner circuit [Pa].
    conductance : float or Expression
        Flow of the valve per pascal when wide open [m^3/(s Pa)].
    opening_pressure : float or Expression
        Drop at which it is half open [Pa].
    pilot_share : float or Expression
        Conductance of the valve held open by the pilot, relative to `conductance`; 0 for a plain check valve
        [dimensionless].

    Returns
    -------
    float or Expression
        Flow into the chamber [m^3/s].
    """
    drop = supply - chamber
    piloted = where(other > chamber, pilot_share * conductance * drop, 0.0)
    return check_valve_flow(drop, conductance, opening_pressure) + piloted
