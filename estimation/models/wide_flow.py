"""The wide flow form: the pressure balance with all that a strange rig, oil or logger may add to it.

Every addition has a value at which it is absent, so that one kernel serves every hypothesis: what is not asked about is
held there.
"""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Annotated, Any

from estimation.models.flow import delivered_flow
from estimation.models.greybox import GreyBoxModel
from plant.compiled.functions import Scalar, absolute, maximum, sign, where
from plant.components.check_valve import check_valve_flow
from plant.components.oil import ATMOSPHERE
from plant.eha.model import EhaParameters
from plant.units import SI

VAPOUR = 2e4
"""Absolute pressure about which a chamber that is short of oil becomes soft [Pa]; pressures stay positive."""

SHORTEST_LAG = 1e-6
"""Lag of a pressure sensor that has none [s]."""


@dataclass(frozen=True, kw_only=True)
class WideFlowParameters(EhaParameters):
    """The actuator's parameters, and those of what a strange rig, oil or logger may add; absent by default."""

    makeup_opening: Annotated[float, SI("Pa", "drop at which a make-up valve is half open", "fitted")] = 1e3
    case_leakage: Annotated[float, SI("m^3/(s Pa)", "drain of a port to the inner circuit", "fitted")] = 0.0
    speed_lead: Annotated[float, SI("s", "lead of the motor on the line between samples", "fitted")] = 0.0
    pressure_lag: Annotated[float, SI("s", "first-order lag of the pressure sensor", "fitted")] = 0.0
    pressure_offset: Annotated[float, SI("Pa", "offset of the differential pressure", "fitted")] = 0.0
    position_zero: Annotated[float, SI("m", "encoder's reading in the middle position", "fitted")] = 0.0
    start_pressure: Annotated[float, SI("Pa", "differential pressure before the first sample", "fitted")] = 0.0
    start_level: Annotated[
        float, SI("Pa", "pressure of the lower side before the first sample, over the accumulator's", "fitted")
    ] = 0.0
    air_softness: Annotated[float, SI("Pa", "a of 1/beta(p) = 1/beta + a/p^2", "fitted")] = 0.0
    leakage_growth: Annotated[float, SI("1", "growth of leakage over the log, of its first value", "fitted")] = 0.0
    leakage_bend: Annotated[float, SI("1", "part of that growth which goes with time squared", "fitted")] = 0.0
    crack_pressure: Annotated[float, SI("Pa", "drop at which the make-up valves crack", "fitted")] = 0.0
    makeup_share_b: Annotated[float, SI("1", "conductance of valve B over that of A", "fitted")] = 1.0
    drain_share_a: Annotated[float, SI("1", "drain of port A over the case leakage", "fitted")] = 1.0
    drain_share_b: Annotated[float, SI("1", "drain of port B over the case leakage", "fitted")] = 1.0
    pilot_share: Annotated[float, SI("1", "piloted conductance of a make-up valve over its own", "fitted")] = 0.0
    area_share_b: Annotated[float, SI("1", "piston area of side B over that of side A", "rig")] = 1.0
    volume_share_b: Annotated[float, SI("1", "dead volume of side B over that of side A", "rig")] = 1.0
    by_mass: Annotated[float, SI("1", "1: balanced by mass, 0: by volume", "chosen")] = 0.0

    def __post_init__(self) -> None:
        """Take any finite number: a fit keeps to its own bounds."""


def _stiffness(pressure: Scalar, p: SimpleNamespace) -> Scalar:
    """Return the tangent bulk modulus of a chamber [Pa]: liquid, air that softens as 1/p^2, and vapour."""
    above = maximum(pressure, 0.05 * VAPOUR)
    ratio = VAPOUR / above
    short = ratio * ratio
    liquid = p.bulk_modulus - p.by_mass * (pressure - ATMOSPHERE)
    return 1.0 / ((1.0 + short * short) / liquid + p.air_softness / (above * above))


def _rates(state: tuple[Scalar, ...], drives: Any, p: SimpleNamespace, share: Scalar) -> tuple[Scalar, ...]:
    speeds, (x, next_x), (begun, next_begun), step = drives
    p1, p2, behind = state
    velocity, position = (next_x - x) / step, x + share * (next_x - x) - p.position_zero
    pumped = delivered_flow(speeds, p, step, share)
    A, V, supply = p.piston_area, 2.0 * p.chamber_volume, p.accumulator_pressure
    dp = p1 - p2
    elapsed = begun + share * (next_begun - begun)
    grown = maximum(1.0 + (p.leakage_growth + p.leakage_bend * elapsed) * elapsed, 0.0)
    relieved = sign(dp) * p.relief_conductance * maximum(absolute(dp) - p.relief_pressure, 0.0)
    leaked = p.leakage_coefficient * grown * dp + relieved
    into_1 = _fed(p1, p2, 1.0, p.drain_share_a, p, supply)
    into_2 = _fed(p2, p1, p.makeup_share_b, p.drain_share_b, p, supply)
    swelling = p.by_mass * dp / p.bulk_modulus
    at_1 = pumped * where(pumped > 0.0, 1.0, 1.0 - swelling) - leaked * where(dp > 0.0, 1.0, 1.0 - swelling)
    at_2 = pumped * where(pumped > 0.0, 1.0 + swelling, 1.0) - leaked * where(dp > 0.0, 1.0 + swelling, 1.0)
    area_b = A * p.area_share_b
    rise = _stiffness(p1, p) * (at_1 - A * velocity + into_1) / (V + A * position)
    fall = _stiffness(p2, p) * (area_b * velocity - at_2 + into_2) / (V * p.volume_share_b - area_b * position)
    # how far the sensor is behind stays small where its lag is short, which a stiff step resolves
    return rise, fall, rise - fall - (behind + p.pressure_offset) / (p.pressure_lag + SHORTEST_LAG)


def _fed(
    chamber: Scalar, other: Scalar, makeup_share: Scalar, drain_share: Scalar, p: SimpleNamespace, supply: Scalar
) -> Scalar:
    """Return what the inner circuit feeds into a chamber: through its check valve, a pilot, less the case drain."""
    drop, makeup = supply - chamber, p.makeup_conductance * makeup_share
    piloted = where(other > chamber, p.pilot_share * makeup * drop, 0.0)
    return (
        check_valve_flow(drop - p.crack_pressure, makeup, p.makeup_opening)
        + piloted
        + p.case_leakage * drain_share * drop
    )


def _at_rest(p: SimpleNamespace) -> tuple[Scalar, ...]:
    held, supply = p.start_pressure, p.accumulator_pressure + p.start_level
    return supply + maximum(held, 0.0), supply + maximum(-held, 0.0), -p.pressure_offset


def _shown(state: tuple[Scalar, ...]) -> tuple[Scalar]:
    p1, p2, behind = state
    return (p1 - p2 - behind,)


WIDE_FLOW_FORM = GreyBoxModel(
    name="wide_flow",
    drives=("motor_speed_rad_s", "position_m", "elapsed"),
    outputs=("differential_pressure_pa",),
    unknowns=(),
    initial=_at_rest,
    rates=_rates,
    observe=_shown,
    parameters=WideFlowParameters,
    jump=(0.5, -0.5, 0.0),
)
"""Without unknowns of its own: which of its parameters are free is a hypothesis, see `estimation.fits.hypotheses`."""

LINEAR = {
    "speed_lead": 1e-5,
    "pressure_lag": 1e-3,
    "pressure_offset": 1e4,
    "position_zero": 1e-2,
    "start_pressure": 1e5,
    "start_level": 1e4,
    "air_softness": 1e2,
    "leakage_growth": 1.0,
    "leakage_bend": 1.0,
    "crack_pressure": 1e4,
}
"""Parameters that may be zero or negative, each with a typical size [SI]."""
