"""Hypotheses about a rig, its oil and its logger that a log accepts or rejects.

A log that the plain flow form does not explain is fitted under them (`estimation.fits.hypothesis_search.explain`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite

from estimation.finding import NORMAL_95
from estimation.models.completed_flow import CRACKS, USUAL_CRACK
from estimation.models.filtered_flow import FILTER_TIME
from estimation.models.flow import STIFFNESS
from estimation.models.inner_circuit import BEND
from estimation.models.wide_flow import OTHER_COURSES, QUICKEST, QUICKNESS
from estimation.models.wrong_pressure import MOST_SETTLING, SETTLING


@dataclass(frozen=True)
class Hypothesis:
    """An effect of rig, oil or logger that extends the plain flow form.

    Parameters
    ----------
    name : str
        Name.
    free : tuple of str
        Parameters of `WideFlowParameters` that are fitted beside the plain ones.
    starts : tuple of Mapping[str, float]
        First guesses [SI]; other parameters start at "no effect".
    delays : tuple of float
        Possible delays of a channel beside its lag, negative for a lead [s].
    late : str
        That channel.
    shares_of_peak : tuple of float
        First guesses of the relief setting, over the log's highest differential pressure [fraction].
    instead : tuple of str
        Unknowns of the plain form that cannot be distinguished from it, and are held.
    far : bool
        Whether the effect is so far from "no effect" that the slope there does not predict it.
    from_first_sample : bool
        Whether the search begins with the log's first differential pressure, and that of a load with several levels.
    least : float
        Least size of the first parameter for which the hypothesis keeps its meaning [SI].
    from_mid_travel : bool
        Whether the search also begins with an encoder that reads zero in the middle of the log's travel.
    from_change : bool
        Whether the search begins where the lost flow shows a step of leakage.
    from_entry : bool
        Whether the search begins where the lost flow shows that air enters, and then tries the whole log.
    at_end : tuple of str
        Parameters that are fitted only at the end of the search.
    by_mass : bool
        Whether the search balances mass whatever the plain form does: bubbles change the volume of flows.
    beside : tuple of str
        Parameters that are fitted along with it, but are not part of its predicted gain.
    lower : bool
        Whether the first parameter must be below the rig file's value for the hypothesis to keep its meaning.
    known : tuple of str
        Parameters that the effect always has, so they must be determined: a valve that never opens has no drop, a
        circuit without air no entry time, and air present from the beginning enters at no time.
    """

    name: str
    free: tuple[str, ...]
    starts: tuple[Mapping[str, float], ...] = ({},)
    delays: tuple[float, ...] = (0.0,)
    late: str = "differential_pressure_pa"
    shares_of_peak: tuple[float, ...] = ()
    instead: tuple[str, ...] = ()
    far: bool = False
    from_first_sample: bool = False
    least: float = 0.0
    from_mid_travel: bool = False
    from_change: bool = False
    from_entry: bool = False
    at_end: tuple[str, ...] = ()
    by_mass: bool = False
    beside: tuple[str, ...] = ()
    lower: bool = False
    known: tuple[str, ...] = ()

    def told(self, values: Mapping[str, float], std: Mapping[str, float]) -> bool:
        """Return whether a log determines the parameters that the hypothesis needs.

        Parameters
        ----------
        values, std : Mapping[str, float]
            Parameters found, and standard deviations; those without one are known [SI].
        """
        found = not self.lower or isfinite(std.get(self.free[0], 0.0))
        return found and all(NORMAL_95 * std.get(name, 0.0) < abs(values[name]) for name in self.known)


DELIVERY = Hypothesis("delivery", ("pump_displacement",))
"""Tested in every log: a pump that delivers less may look like leakage, with bulk modulus a fifth too low."""

ENCODER_ZERO = Hypothesis(
    "encoder_zero", ("position_zero",), ({"position_zero": -0.06}, {"position_zero": 0.06}), from_mid_travel=True
)
"""Tested in every log too: held chamber volumes, or valves that crack, may look like it."""

VOLUME = Hypothesis("volume", ("chamber_volume",))

START_LOAD = Hypothesis("start_load", ("start_pressure", "start_level"))

BEGUN_UNDER_LOAD = replace(START_LOAD, from_first_sample=True, by_mass=True, beside=(STIFFNESS,))
"""The same for a log that begins under load or in motion."""

LEAST_PLAY = 5e-6
"""Least play that counts as one [m]; judged. A smaller one stands for details of valves and accumulator."""

PLAY = Hypothesis(
    "position_play",
    ("position_play", *OTHER_COURSES),
    ({"position_play": 1e-5}, {"position_play": 5e-5}),
    beside=(*CRACKS, STIFFNESS),
    least=LEAST_PLAY,
)
"""In the plain fit make-up valves and accumulator have absorbed the play, so they are fitted again."""

LEAST_BEND = 1e-6
"""Least bend of the make-up valves' flow that counts [1/Pa]; judged: at 10 bar the flow per pascal is then halved."""

MAKEUP_BENDS = Hypothesis("makeup_bends", (BEND,), ({BEND: 3e-5},), least=LEAST_BEND, beside=CRACKS)
"""A wide-open make-up valve is an orifice. Tested if a load pulls the piston faster than the pump feeds it."""

OFFSET = Hypothesis("pressure_offset", ("pressure_offset",))
PRESSURE_DRIFT = Hypothesis("pressure_drift", ("pressure_drift",), at_end=(SETTLING,))
"""A zero that warms up after the sensor is switched on drifts more and more slowly."""

PRESSURE_SIDES = Hypothesis("pressure_sides", ("pressure_sides",))
"""Two chamber gauges have one gain each, and a differential gauge may have one per direction. Tested alone: beside
others it absorbs part of a speed offset, and right pairs of hypotheses are no longer found."""

OFFSET_AT_REST = replace(OFFSET, from_first_sample=True)
"""The same for a log that begins at rest with a differential pressure: that is the offset, or there is a load."""

LATE_TRIED = (0.0, 2e-3, 5e-3, 9e-3)
"""Delays with which the search for a late channel begins [s]."""

EARLY_TRIED = (-1e-3, -3e-3, -6e-3, -1e-2)
"""The same for a speed that leads the rest: it is delayed by whole milliseconds, and its lag corrects the remainder
[s]."""

LEAST_ROD = 0.02
"""Least difference of the piston areas over their sum for a single rod [fraction]; judged. Chambers that differ only in
volume look like an encoder with another zero."""

LATEST = 2e-2
"""Longest delay that is searched for or reported [s]: no sensor, filter or bus is later. In a log of another actuator
the cost may fall with every millisecond, and the search would have no end."""

PRESSURE_LATE = Hypothesis("pressure_late", ("pressure_lag",), ({"pressure_lag": 1e-3},), LATE_TRIED)

PRESSURE_FILTERED = replace(
    PRESSURE_LATE,
    free=("pressure_lag", FILTER_TIME),
    starts=({"pressure_lag": 5e-3, FILTER_TIME: 3e-3},),
    delays=(0.0,),
)
"""The same behind a second-order filter: for slow signals it is a delay by no whole number of samples."""

SPEED_LATE = Hypothesis(
    "speed_late", ("speed_lag",), ({"speed_lag": 1e-3},), LATE_TRIED, "motor_speed_rad_s", instead=("speed_lead",)
)
"""Also tested if the motor's lead is at its upper limit: a lag of a little more than a sample time looks like that, and
put bulk modulus four deviations off (1.16 ms at 1 kHz)."""

LEAKAGE_RISE = Hypothesis("leakage_rise", ("leakage_rise",))

LEAKAGE_STEP = Hypothesis(
    "leakage_step",
    ("leakage_before", "step_at", "step_width"),
    ({"leakage_before": -0.5},),
    from_change=True,
    beside=CRACKS,
)
"""A seal fails within the log. Before that, the drops at which make-up valves open are priors, as in a plain log."""

LEAKAGE_TURBULENT = Hypothesis("leakage_turbulent", ("leakage_turbulent",))
"""A worn edge or a scratch leaks like an orifice. A lag of the pressure took its place, with bulk modulus 7 % too
low."""

PUMP_COMPRESSES = Hypothesis("pump_compresses", ("pump_compression",))
"""A pump draws oil at low pressure. At 50 bar and 300 MPa it delivers 1.7 % less than it draws, at any speed. Neither
leakage nor another displacement absorbs that, and logs were refused."""

AIR = Hypothesis(
    "air",
    ("air_softness",),
    ({"air_softness": 1e2}, {"air_softness": 1e3}),
    at_end=(QUICKNESS,),
    known=("air_softness",),
)
"""Slopes do not predict what a constantly softer oil has absorbed: beside 1000 for growing leakage they predicted less
than 750 of 3600. Bubbles under quick compression are stiffer than isothermal ones at low pressure and softer at high
pressure. Logs at high pressure show it: without an exponent they were refused, at 1.1 to 1.2 times the noise."""

AIR_MIDWAY = Hypothesis(
    "air_midway",
    ("air_softness", "air_onset"),
    ({"air_softness": 1e3}, {"air_softness": 3e3}),
    far=True,
    from_entry=True,
    at_end=("air_width",),
    beside=CRACKS,
    by_mass=True,
    known=("air_softness", "air_onset"),
)
"""The lost flow shows roughly when air enters. The duration is fitted last: a short one stops a descent."""

MAKEUP_BLOCKED = Hypothesis(
    "makeup_blocked",
    ("makeup_share_b",),
    ({"makeup_share_b": 1e-4}, {"makeup_share_b": 1e4, "makeup_conductance": 1e-13}),
    far=True,
)

PORTS_DRAIN = tuple(
    Hypothesis(f"port_{side}_drains", (f"drain_share_{side}",), ({f"drain_share_{side}": 1e2},)) for side in "ab"
)

MAKEUP_HIDDEN = replace(MAKEUP_BLOCKED, far=False, beside=CRACKS)
"""The same beside a plain fit, in which the opening drops of valves have absorbed it: they are fitted again."""

VOLUME_HIDDEN = replace(VOLUME, beside=(*CRACKS, STIFFNESS))
"""The same beside a plain fit: valves, and an accumulator whose level follows the piston, have absorbed part of it."""

ZERO_HIDDEN = replace(ENCODER_ZERO, beside=(*CRACKS, STIFFNESS))
"""The same of an encoder's zero: an accumulator far stiffer than presumed has taken it up, and valves a part."""

MAY_HIDE = (MAKEUP_HIDDEN, *PORTS_DRAIN, LEAKAGE_RISE, OFFSET, PUMP_COMPRESSES, VOLUME_HIDDEN)
"""Also tested if the plain form explains the log: opening drops and leakage may absorb the effect. With `DELIVERY` and
`ENCODER_ZERO` they are nine, for which one evaluation is made beside the fit: slopes predict the gain of each,
including a stuck valve."""

CHECKS_CRACK = Hypothesis(
    "checks_crack", ("crack_pressure", "crack_difference"), ({"crack_pressure": 1e4},), known=("crack_pressure",)
)

CHECKS_HIDDEN = replace(CHECKS_CRACK, beside=CRACKS)
"""The same beside a plain fit whose opening drops are far from their priors: they are fitted again."""

LARGE_CRACK = 3.0 * USUAL_CRACK
"""Opening drop in a plain fit from which a valve that opens late is tested: three prior deviations [Pa]."""

UNLIKE_CRACKS = 3.0 * 2.0**0.5 * USUAL_CRACK
"""Difference between the opening drops of the two make-up valves from which one may be stuck shut instead: three prior
deviations [Pa]. A valve that opens far later than the other may never open."""

HYPOTHESES = (
    PRESSURE_LATE,
    SPEED_LATE,
    Hypothesis(  # position and pressure lag equally, or the channel is the motor's command
        "speed_early",
        ("speed_lag",),
        ({"speed_lag": 2e-4},),
        EARLY_TRIED,
        "motor_speed_rad_s",
        instead=("speed_lead",),
    ),
    Hypothesis("position_late", ("position_lag",), ({"position_lag": 1e-3},), LATE_TRIED, "position_m"),
    OFFSET,
    PRESSURE_DRIFT,
    ENCODER_ZERO,
    PLAY,
    DELIVERY,
    VOLUME,
    START_LOAD,
    AIR,
    AIR_MIDWAY,
    Hypothesis(
        "relief_low", ("relief_pressure", "relief_conductance"), shares_of_peak=(0.6, 0.85), far=True, lower=True
    ),
    Hypothesis("leakage_growth", ("leakage_growth", "leakage_bend")),
    LEAKAGE_RISE,
    LEAKAGE_STEP,
    LEAKAGE_TURBULENT,
    PUMP_COMPRESSES,
    MAKEUP_BLOCKED,
    Hypothesis(
        "single_rod",
        ("area_difference", "volume_difference", "pilot_share"),
        tuple({"area_difference": differ, "volume_difference": differ, "pilot_share": 1.0} for differ in (-0.15, 0.15)),
        least=LEAST_ROD,
        beside=(BEND,),
    ),
    CHECKS_CRACK,
    *PORTS_DRAIN,
)
"""The order has no meaning: the log decides."""

LIMITS: Mapping[str, tuple[float, float]] = {
    "makeup_opening": (1e2, 1e6),
    "pressure_lag": (0.0, 0.05),
    FILTER_TIME: (5e-4, 0.05),
    "speed_lag": (0.0, 0.05),
    "position_lag": (0.0, 0.05),
    "pressure_offset": (-1e7, 1e7),
    "pressure_drift": (-1e7, 1e7),
    SETTLING: (0.0, MOST_SETTLING),
    "pressure_sides": (-0.1, 0.1),
    "position_zero": (-1.0, 1.0),
    "position_play": (0.0, 2e-3),
    "start_pressure": (-1e7, 1e7),
    "start_level": (-2.5e5, 1e7),
    "air_softness": (0.0, 1e5),
    "air_onset": (0.0, 1.0),
    "air_width": (1e-3, 0.3),
    QUICKNESS: (0.0, QUICKEST),
    "leakage_growth": (-4.0, 4.0),
    "crack_pressure": (-1e5, 2e5),
    "crack_difference": (-5e4, 5e4),
    BEND: (0.0, 1e-3),
    "crack_a": (-2e4, 2e4),
    "crack_b": (-2e4, 2e4),
    "leakage_bend": (-4.0, 4.0),
    "leakage_rise": (-6.0, 6.0),
    "leakage_before": (-0.9999, 50.0),
    "step_at": (0.0, 1.0),
    "leakage_turbulent": (0.0, 1.0),
    "pump_compression": (-3.0, 5.0),
    "step_width": (2e-4, 0.05),
    "area_difference": (-0.6, 0.6),
    "volume_difference": (-0.6, 0.6),
    "pilot_share": (0.0, 10.0),
}
"""Physical limits of values [SI]. A make-up valve that opens within a smaller drop has a corner that neither the
integrator nor a sensor resolves."""

PRIOR_SPREADS = {"chamber_volume": 0.15, "pump_displacement": 0.15}
"""Prior standard deviation of the logarithm of rig file entries [dimensionless]: dead volume is seldom measured; a pump
that delivers less than its displacement is worn."""

LEAST_DELIVERY = 1e-2
"""Relative change of the pump's delivery below which it is not fitted: no rig file is more exact [fraction]."""

LEAST_SHARE, MOST_SHARE = 0.6, 1.25
"""Range of a pump's delivery over its displacement in the rig file, due to wear or rounded entries [fraction]: the
usual uncertainty of displacement and area allows 1.07 (two deviations), and a pump is replaced before it delivers
0.6."""

WORN_SHARE = 0.9
"""Delivery over displacement below which the pump is worn, rather than the rig file rounded [dimensionless]."""
