"""Flow from the inner circuit into the chambers: make-up valves, orifices when wide open, less the drains."""

from types import SimpleNamespace

from plant.compiled.functions import Scalar, absolute, sqrt, where
from plant.components.check_valve import make_up_flow

BEND, USUAL_BEND = "makeup_bend", 1e-4
"""Inverse of the drop above which the flow of a make-up valve is proportional to its square root, and its typical size
[1/Pa]."""


def inner_flows(
    pressures: tuple[Scalar, Scalar],
    p: SimpleNamespace,
    cracks: tuple[Scalar, Scalar] = (0.0, 0.0),
    bend: Scalar = 0.0,
) -> tuple[Scalar, Scalar]:
    """Return the flow from the inner circuit into each chamber: make-up valve less drain.

    Parameters
    ----------
    pressures : tuple of float or Expression
        Absolute, of both chambers [Pa].
    p : namespace
        As `estimation.models.flow.chamber_rates` needs them.
    cracks : tuple of float or Expression
        Drops at which the make-up valves leave their seats [Pa].
    bend : float or Expression
        Inverse of the drop from which their flow bends, see `orifice_conductance` [1/Pa].

    Returns
    -------
    tuple of float or Expression
        Flows [m^3/s].
    """
    supply, opening, pilot = p.accumulator_pressure, p.makeup_opening, p.pilot_share
    into_1, into_2 = (
        make_up_flow(
            chamber, other, seat, orifice_conductance(seat - chamber, p.makeup_conductance, bend), opening, pilot
        )
        - p.case_leakage * (chamber - supply)
        for chamber, other, seat in zip(pressures, pressures[::-1], [supply - crack for crack in cracks], strict=True)
    )
    return into_1, into_2


def accumulator_rate(taken: Scalar, supply: Scalar, p: SimpleNamespace) -> Scalar:
    """Return the rate of the inner circuit's pressure: a single rod's gas is stiffer the smaller it is.

    Such a rod takes a third of the gas volume at every stroke and returns it. A through rod hardly changes it, and with
    a variable stiffness its search ended in another minimum.

    Parameters
    ----------
    taken : float or Expression
        Flow from it into the chambers [m^3/s].
    supply : float or Expression
        Its pressure, absolute [Pa].
    p : namespace
        `accumulator_pressure` at rest [Pa], `accumulator_stiffness` there [Pa/m^3], and `area_difference` [fraction].

    Returns
    -------
    float or Expression
        Rate [Pa/s].
    """
    compressed = where(absolute(p.area_difference) > 0.0, supply / p.accumulator_pressure, 1.0)
    return -p.accumulator_stiffness * compressed * compressed * taken


def orifice_conductance(drop: Scalar, conductance: Scalar, bend: Scalar) -> Scalar:
    """Return the conductance of a make-up valve, which falls with the root of a large drop, as an orifice's does.

    Parameters
    ----------
    drop : float or Expression
        Pressure of the inner circuit less that of the chamber [Pa].
    conductance : float or Expression
        Conductance at a small drop [m^3/(s Pa)].
    bend : float or Expression
        Inverse of the drop from which it falls; 0 for a constant conductance [1/Pa].

    Returns
    -------
    float or Expression
        Conductance [m^3/(s Pa)].

    Examples
    --------
    >>> [float(orifice_conductance(drop, 1e-9, bend)) for drop, bend in ((6e4, 0.0), (6e4, 5e-5), (-6e4, 5e-5))]
    [1e-09, 5e-10, 5e-10]
    """
    if isinstance(bend, float) and bend == 0.0:
        return conductance
    return conductance / sqrt(1.0 + bend * absolute(drop))
