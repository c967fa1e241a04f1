"""The wide flow form: the pressure balance with all effects that a strange rig, oil or logger may add to it.

Every effect has a value at which it is absent, so that one kernel serves every hypothesis: effects that are not tested
are held there.
"""

from dataclasses import dataclass, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

from estimation.models.aerated_oil import present_air, swellings, tangent_stiffness
from estimation.models.completed_flow import CRACKS, USUAL_CRACK
from estimation.models.flow import delivered_flow, leaked_flow, port_flows
from estimation.models.flow_parameters import FlowParameters
from estimation.models.greybox import GreyBoxModel
from estimation.models.inner_circuit import BEND, USUAL_BEND, accumulator_rate, orifice_conductance
from estimation.models.wrong_pressure import SETTLING, pressure_error
from plant.compiled.functions import Scalar, maximum, minimum, sqrt, where
from plant.components.check_valve import make_up_flow
from plant.eha.circuit import chamber_volumes
from plant.eha.model import piston_areas
from plant.units import si

TURBULENT_AT = 5e5
"""Differential pressure at which a turbulent share of the leakage, and the leakage itself, are stated [Pa]."""

LAMINAR_BELOW = 1e4
"""Differential pressure below which every leak is laminar [Pa]; judged: it changes pressure by 0.1 bar at most."""

SHORTEST_LAG = 1e-6
"""Lag of a pressure sensor that has none [s]."""

COURSES = ("side_of_play", "play_by_pressure", "play_at_once", "play_sprung")
"""Courses of the piston in its encoder's play, see `estimation.fits.greybox.play.crossings`."""

OTHER_COURSES = COURSES[1:]
"""Parameters that state how far each of the others replaces the first."""

QUICKNESS, QUICKEST = "air_quickness", 2.0 / 7.0
"""1 - 1/n of the bubbles' exponent n (0 is isothermal), and its largest value, n = 1.4 [dimensionless]."""

GROWTH = ("leakage_growth", "leakage_bend", "leakage_rise")
"""Parameters of a leakage that changes over the log, in the order of `grown_leakage`."""


@dataclass(frozen=True, kw_only=True)
class WideFlowParameters(FlowParameters):
    """The flow form's parameters, and those of what a strange rig, oil or logger may add; absent by default."""

    pressure_lag: float = si(0.0, "s", "first-order lag of the pressure sensor", "fitted")
    filter_time: float = si(1e-3, "s", "inverse natural frequency of a second-order pressure filter", "fitted")
    speed_lag: float = si(0.0, "s", "first-order lag of the motor's speed sensor", "fitted")
    position_lag: float = si(0.0, "s", "first-order lag of the encoder or of its filter", "fitted")
    position_play: float = si(0.0, "m", "play between the piston and the encoder", "fitted")
    play_by_pressure: float = si(0.0, "1", "share of the play that is crossed as pressure turns", "fitted")
    play_at_once: float = si(0.0, "1", "share of the play that is crossed at first", "fitted")
    play_sprung: float = si(0.0, "1", "half plays that the piston springs back as pressure is lost", "fitted")
    pressure_offset: float = si(0.0, "Pa", "offset of the differential pressure", "fitted")
    pressure_drift: float = si(0.0, "Pa", "what that offset gains over the log, at first", "fitted")
    drift_settling: float = si(0.0, "1", "time constants within the log by which that drift settles", "fitted last")
    pressure_sides: float = si(0.0, "1", "half of what the gauge of side A reads more of a pressure than B's", "fitted")
    position_zero: float = si(0.0, "m", "encoder's reading in the middle position", "fitted")
    start_pressure: float = si(0.0, "Pa", "differential pressure before the first sample", "fitted")
    start_level: float = si(
        0.0, "Pa", "pressure of the lower side before the first sample, over the accumulator's", "fitted"
    )
    air_softness: float = si(0.0, "Pa", "a of 1/beta(p) = 1/beta_liquid + a/p^2", "fitted")
    air_onset: float = si(-1.0, "1", "when that air gets in, in lengths of the log", "fitted")
    air_width: float = si(0.05, "1", "how long it takes to get in, in lengths of the log", "fitted last")
    air_quickness: float = si(0.0, "1", "1 - 1/n of bubbles with exponent n: a/p^2 grows with p to that", "fitted last")
    stated_pressure: float = si(1e6, "Pa", "absolute pressure that bulk modulus is stated at", "chosen")
    leakage_growth: float = si(0.0, "1", "growth of leakage over the log, of its value halfway", "fitted")
    leakage_bend: float = si(0.0, "1", "part of that growth which goes with time squared", "fitted")
    leakage_rise: float = si(0.0, "1", "rise of the logarithm of leakage over the log", "fitted")
    leakage_before: float = si(0.0, "1", "leakage before it stepped, over that after, less one", "fitted")
    step_at: float = si(0.5, "1", "middle of that step, in lengths of the log", "fitted")
    step_width: float = si(0.05, "1", "how long it takes, in lengths of the log", "fitted")
    leakage_turbulent: float = si(0.0, "1", "share of leakage at 5 bar that goes with the root of pressure", "fitted")
    pump_compression: float = si(0.0, "1", "pumped oil lost to its compression, over dp / beta of it", "fitted")
    crack_pressure: float = si(0.0, "Pa", "drop at which the make-up valves crack, on average of the two", "fitted")
    crack_difference: float = si(0.0, "Pa", "drop at which valve A cracks over that of valve B", "fitted")
    makeup_share_b: float = si(1.0, "1", "conductance of valve B over that of A", "fitted")
    drain_share_a: float = si(1.0, "1", "drain of port A over the case leakage", "fitted")
    drain_share_b: float = si(1.0, "1", "drain of port B over the case leakage", "fitted")
    by_mass: float = si(0.0, "1", "1: balanced by mass, 0: by volume", "chosen")


def wide_rates(
    state: tuple[Scalar, ...],
    drives: Any,
    p: SimpleNamespace,
    share: Scalar,
    *,
    turbulent: bool = False,
    quick: bool = False,
) -> tuple[Scalar, ...]:
    """Return the rates of both chambers, of how far the sensor is behind, and of the inner circuit [Pa/s].

    Parameters
    ----------
    state : tuple of float
        Pressures of the chambers, how far the sensor is behind, and the inner circuit's pressure [Pa].
    drives : tuple
        Motor speeds, positions, time and slopes at both ends of a step, courses of play, and the step.
    p : SimpleNamespace
        The form's parameters [SI].
    share : float
        Share of the step that has gone [fraction].
    turbulent : bool
        Whether part of the leakage is turbulent.
    quick : bool
        Whether bubbles are compressed faster than heat leaves them.

    Returns
    -------
    tuple of float
        Rates of the state [Pa/s].
    """
    speeds, (read, next_read), (begun, next_begun), (rate, next_rate), *courses, step = drives
    p1, p2, behind, supply = state
    side, next_side = _play_sides(courses, p)
    x = read + p.position_lag * rate + 0.5 * p.position_play * side
    next_x = next_read + p.position_lag * next_rate + 0.5 * p.position_play * next_side
    velocity, position = (next_x - x) / step, x + share * (next_x - x) - p.position_zero
    delivered = delivered_flow(speeds, _with_net_lead(p), step, share)
    (area_1, area_2), (volume_1, volume_2) = piston_areas(p), chamber_volumes(position, p)
    dp = p1 - p2
    pumped = delivered * compressed_delivery(where(delivered > 0.0, dp, -dp) / p.bulk_modulus, p.pump_compression)
    elapsed = begun + share * (next_begun - begun)
    grown = grown_leakage(elapsed, p.leakage_growth, p.leakage_bend, p.leakage_rise)
    grown = grown * stepped_leakage(elapsed, p.leakage_before, p.step_at, p.step_width)
    through = turbulent_leakage(dp, p.leakage_turbulent) if turbulent else 1.0
    leaked = leaked_flow(dp, p.leakage_coefficient * grown * through, p)
    opening, pilot, conductance = p.makeup_opening, p.pilot_share, p.makeup_conductance
    cracking, later = supply - p.crack_pressure, 0.5 * p.crack_difference
    from_1, from_2 = cracking - later - p.crack_a, cracking + later - p.crack_b
    conductance_1 = orifice_conductance(from_1 - p1, conductance, p.makeup_bend)
    conductance_2 = orifice_conductance(from_2 - p2, p.makeup_share_b * conductance, p.makeup_bend)
    fed_1 = make_up_flow(p1, p2, from_1, conductance_1, opening, pilot)
    fed_2 = make_up_flow(p2, p1, from_2, conductance_2, opening, pilot)
    drain = p.case_leakage * grown
    into_1 = fed_1 - p.drain_share_a * drain * (p1 - supply)
    into_2 = fed_2 - p.drain_share_b * drain * (p2 - supply)
    air = present_air(elapsed, p)
    at_1, at_2 = port_flows(pumped, leaked, dp, swellings(p1, p2, air, p, quick=quick))
    rise = tangent_stiffness(p1, air, p, quick=quick) * (at_1 - area_1 * velocity + into_1) / volume_1
    fall = tangent_stiffness(p2, air, p, quick=quick) * (area_2 * velocity - at_2 + into_2) / volume_2
    # `behind` stays small if the sensor's lag is short; a stiff step resolves it
    lagging = rise - fall - (behind + pressure_error((p1, p2), elapsed, p)) / (p.pressure_lag + SHORTEST_LAG)
    return rise, fall, lagging, accumulator_rate(into_1 + into_2, supply, p)


def _play_sides(courses: Any, p: SimpleNamespace) -> tuple[Scalar, Scalar]:
    """Return the piston's position within its encoder's play at the start and end of a step, from -1 to 1."""
    late, by_pressure, at_once, sprung = courses
    start, end = (
        late[i] + p.play_by_pressure * by_pressure[i] + p.play_at_once * at_once[i] + p.play_sprung * sprung[i]
        for i in (0, 1)
    )
    return maximum(minimum(start, 1.0), -1.0), maximum(minimum(end, 1.0), -1.0)


def _with_net_lead(p: SimpleNamespace) -> SimpleNamespace:
    """Return the parameters with the speed's lag added to its lead: a lag acts by its length times the slope."""
    return SimpleNamespace(**{**vars(p), "speed_lead": p.speed_lead + p.speed_lag})


def grown_leakage(elapsed: Scalar, growth: Scalar, bend: Scalar, rise: Scalar) -> Scalar:
    """Return leakage over its value halfway through the log, which a fit determines best.

    Wear may add linearly, and viscosity falls by a share in each minute. So there is a parabola and an exponential,
    approximated by the eighth power of ``(1 + x/16) / (1 - x/16)``, within 0.3 % of it for a leakage that grows
    tenfold.

    Parameters
    ----------
    elapsed : float, ndarray or Expression
        Share of the log [fraction].
    growth, bend : float or Expression
        Coefficients of that share and of its square [dimensionless].
    rise : float or Expression
        Rise of the logarithm over the log [dimensionless].

    Returns
    -------
    float, ndarray or Expression
        Dimensionless; not negative.
    """
    since = elapsed - 0.5
    root = (16.0 + rise * since) / (16.0 - rise * since)
    squared = root * root
    fourth = squared * squared
    return maximum(1.0 + (growth + bend * since) * since, 0.0) * fourth * fourth


def stepped_leakage(elapsed: Scalar, before: Scalar, at: Scalar, width: Scalar) -> Scalar:
    """Return leakage over its value after a step, as when a seal fails or a valve sticks.

    Parameters
    ----------
    elapsed : float, ndarray or Expression
        Share of the log [fraction].
    before : float or Expression
        Leakage before the step over that after, less one [dimensionless].
    at, width : float or Expression
        Middle of the step, and its duration [fraction of the log].

    Returns
    -------
    float, ndarray or Expression
        Dimensionless.
    """
    return 1.0 + before * (1.0 - minimum(maximum((elapsed - at) / width + 0.5, 0.0), 1.0))


def turbulent_leakage(dp: Scalar, share: Scalar) -> Scalar:
    """Return leakage over laminar leakage, if a share of it is proportional to the square root of pressure.

    Long narrow gaps have laminar leakage; a worn edge or a scratch leaks as an orifice does (Merritt, Hydraulic Control
    Systems, 1967, section 3-3).

    Parameters
    ----------
    dp : float or Expression
        Differential pressure [Pa].
    share : float or Expression
        The turbulent share at `TURBULENT_AT` [fraction].

    Returns
    -------
    float or Expression
        Dimensionless; 1 at `TURBULENT_AT`.
    """
    above = sqrt(dp * dp + LAMINAR_BELOW * LAMINAR_BELOW)
    return 1.0 + share * (sqrt(TURBULENT_AT / above) - 1.0)


def compressed_delivery(squeezed: Scalar, share: Scalar) -> Scalar:
    """Return a pump's delivery at outlet pressure, over its displacement: it fills at its inlet's pressure.

    A pump that delivers all that it draws loses the compression of that oil (a share of 1), and that of the oil that
    stays in its teeth (more). A share of 0 counts its displacement at the outlet (Ivantysyn and Ivantysynova,
    Hydrostatic Pumps and Motors, 2001, section 4.2).

    Parameters
    ----------
    squeezed : float, ndarray or Expression
        Rise of pressure through the pump over bulk modulus [dimensionless].
    share : float or Expression
        Oil that it compresses over what it delivers [dimensionless].

    Returns
    -------
    float, ndarray or Expression
        Dimensionless.
    """
    return 1.0 - share * squeezed


def _at_rest(p: SimpleNamespace) -> tuple[Scalar, ...]:
    held, supply = p.start_pressure, p.accumulator_pressure + p.start_level
    return supply + maximum(held, 0.0), supply + maximum(-held, 0.0), -p.pressure_offset, p.accumulator_pressure


def _observed_pressure(state: tuple[Scalar, ...]) -> tuple[Scalar]:
    p1, p2, behind, _ = state
    return (p1 - p2 - behind,)


WIDE_FLOW_FORM = GreyBoxModel(
    name="wide_flow",
    drives=("motor_speed_rad_s", "position_m", "elapsed", "position_rate", *COURSES),
    outputs=("differential_pressure_pa",),
    unknowns=(),
    initial=_at_rest,
    rates=wide_rates,
    observe=_observed_pressure,
    parameters=WideFlowParameters,
    jump=(0.5, -0.5, 0.0, 0.0),
)
"""Without unknowns of its own: which of its parameters are free is a hypothesis, see `estimation.fits.hypotheses`."""


TURBULENT_FLOW_FORM = replace(WIDE_FLOW_FORM, name="wide_flow_turbulent", rates=partial(wide_rates, turbulent=True))
QUICK_FLOW_FORM = replace(WIDE_FLOW_FORM, name="wide_flow_quick", rates=partial(wide_rates, quick=True))
TURBULENT_QUICK_FLOW_FORM = replace(
    WIDE_FLOW_FORM, name="wide_flow_turbulent_quick", rates=partial(wide_rates, turbulent=True, quick=True)
)
"""The same with a share of the leakage turbulent, with `QUICKNESS` of bubbles, and with both. They are separate forms,
so that plain logs, for which the wide form is used too, need not compute roots and powers."""

LINEAR = {
    "speed_lead": 1e-5,
    **dict.fromkeys(("pressure_lag", "speed_lag", "position_lag"), 1e-3),
    "position_play": 1e-5,
    **dict.fromkeys((*OTHER_COURSES, *GROWTH, "leakage_before", "pump_compression", "pilot_share", SETTLING), 1.0),
    "pressure_sides": 0.01,
    **dict.fromkeys(("pressure_offset", "pressure_drift", "start_level", "crack_pressure", "crack_difference"), 1e4),
    "position_zero": 1e-2,
    "start_pressure": 1e5,
    "air_softness": 1e2,
    **dict.fromkeys(("air_onset", QUICKNESS, "step_at", "leakage_turbulent"), 0.1),
    **dict.fromkeys(("area_difference", "volume_difference"), 0.1),
    **dict.fromkeys(CRACKS, USUAL_CRACK),
    BEND: USUAL_BEND,
}
"""Parameters that may be zero or negative, each with a typical size [SI]."""
