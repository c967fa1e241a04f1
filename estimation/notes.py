"""What checks, fits and filters of the gear-pump actuator may bring up."""

from plant.notes import Code


class SensorCode(Code):
    """Notes on the sensors of a log."""

    SENSOR_FROZE = (
        "{channel} repeats {value:.6g} from {begin_s:.3g} s for {length_s:.3g} s while the others move: "
        "the sensor froze"
    )
    SENSOR_CONSTANT = "{channel} is {value:g} Pa throughout: the sensor is dead, or not connected"
    SENSOR_NOISE_ONLY = (
        "{channel} shows {noise:.3g} Pa of noise and nothing else while the motor turns: the sensor is dead"
    )
    SENSOR_CLIPPED = (
        "{channel} is at the end of its range, {levels} Pa, in {percent:.2g} % of its samples; they are left out"
    )
    OUTLIERS_LEFT_OUT = "{channel} stands out grossly in {count} of {total} samples; they are left out"
    SENSORS_DISAGREE = (
        "velocity_m_s and the slope of position_m differ by {difference_m_s:.2g} m/s: one of the two sensors is wrong"
    )


class ChannelCode(Code):
    """Notes on channels whose sign, unit or name is wrong: the log is another's than it says, and nothing follows."""

    CHANNEL_REVERSED = (
        "{channel} counts the other way: its correlation with what it should follow is {correlation:.2f} beside "
        "{against}; give the column with a minus before its unit (--columns CHANNEL=NAME:-UNIT)"
    )
    CHANNELS_SWAPPED = (
        "{channel} and {other} are swapped: the second one's slope is the first (correlation {correlation:.2f}); "
        "name the columns (--columns CHANNEL=NAME)"
    )
    CHANNEL_UNIT = (
        "{channel} reads {factor:.3g} times what {against} asks for, which looks like {slip}; "
        "give the column's unit (--columns CHANNEL=NAME:UNIT)"
    )


class GuessCode(Code):
    """Why a column of a strange log may be a channel; columns count from 1."""

    CALLED_SO = "it is called so"
    DATES = "it holds dates or times of the day"
    UNIT_FITS = "{unit} is a unit of it"
    UNIT_GUESSED = "no unit is given, and in {unit} it has the usual size: check it"
    INCREASES = "it increases by {step:.6g} from row to row"
    HAS_SLOPE = "its slope is column {column} (correlation {correlation:.3f})"
    IS_SLOPE = "it is the slope of column {column} (correlation {correlation:.3f})"
    FOLLOWS = "it goes with the motion of column {column} (correlation {correlation:.2f})"
    IS_DIFFERENCE = "it is the difference of columns {one} and {other}"


class EstimateCode(Code):
    """Notes on an estimate of bulk modulus: what speaks against it, or what it lacks."""

    NOT_DETERMINED = (
        "the coefficients are not separately determined by this record (a pole cancels a zero, or the order is too "
        "high): the covariance is a lower bound"
    )
    BOUND_TOO_WIDE = "the Cramér-Rao bound is {percent:.0f} % of the value, over 3 %: not observable"
    KNOWN_AS_THE_RIG = (
        "{quantity} is known only as well as the rig's {entry}, which makes {percent:.0f} % of its total variance"
    )
    DIVERGED = "the estimate stopped being finite; check units, rig parameters and the form"
    PRESSURE_RESIDUALS_LARGE = (
        "the pressure residuals are {ratio:.1f} times larger than the sensor's noise: "
        "the log does something that the flow balance does not know"
    )
    PRESSURE_RESIDUALS_CORRELATED = (
        "neighbouring pressure residuals are correlated by {correlation:.2f}: "
        "the log does something that the flow balance does not know"
    )
    CHANNEL_LATE = (
        "{channel} comes {milliseconds:.1f} ms {when} for the flow balance: "
        "a lag or delay of a sensor or of its filter, which is not corrected for"
    )
    POSITION_RESIDUALS_LARGE = (
        "the position residuals are {ratio:.2f} times larger than the sensors' noise: "
        "neither structure of friction explains how the piston starts and stops, and bulk modulus may be far off"
    )
    FRICTION_LAWS_DISAGREE = (
        "two structures of friction explain the log alike and put bulk modulus at {least_pa:.3g} and {most_pa:.3g} Pa"
    )
    FORCES_ON_ANY_SCALE = (
        "position alone does not hold the scale of forces: bulk modulus between {least_pa:.3g} and {most_pa:.3g} Pa "
        "explains the log, with friction in proportion"
    )
    INNOVATIONS_LARGE = (
        "the residuals of {channel} are {ratio:.1f} times larger than the filter expects (NIS {nis:.1f}, "
        "1 is expected): model and log disagree, and the interval is too narrow"
    )
    INNOVATIONS_FOLLOW_DRIVE = (
        "the residuals of {channel} hold {excess:.3g} times the power of white noise near {frequency_hz:.3g} Hz, where "
        "the drive is: the model does not answer it as the log does, and the interval is up to {narrow:.2g} times too "
        "narrow"
    )
    INNOVATIONS_BESIDE_DRIVE = (
        "the residuals of {channel} hold {excess:.3g} times the power of white noise near {frequency_hz:.3g} Hz, "
        "beside the drive: a friction, a valve or a pick-up that the model does not know, and the interval is up to "
        "{narrow:.2g} times too narrow"
    )
    ESTIMATE_WANDERS = (
        "{state} moved between stretches of the log {ratio:.0f} times as far as its interval allows: they disagree "
        "about it, and the interval is too narrow"
    )
    NOT_SETTLED = "{state} still moved by {moved:.3g} over the last fifth of the log: it has not settled"
    AT_PHYSICAL_BOUND = "{state} ended at its physical bound ({value:.3g} {unit})"
    PRESSURE_ABSENT = (
        "without differential_pressure_pa the estimate rests on how the piston starts, stops and rings, so on a "
        "friction model that is right, which no foreign bench grants; while the piston sticks nothing is left "
        "(errata E13)"
    )
    PRESSURE_UNUSED = (
        "the acceleration form does not use differential_pressure_pa, and breaks down at reversals (errata E9)"
    )


class RigCode(Code):
    """Notes on a rig, its oil or its logger that differ from what the rig file says, and explain the log."""

    PRESSURE_LATE = (
        "differential_pressure_pa comes {late_ms:.2f} +- {half_width_ms:.2f} ms late: lag or delay of its sensor; "
        "it was brought forward"
    )
    PRESSURE_OFFSET = (
        "differential_pressure_pa reads {offset_pa:.4g} +- {half_width_pa:.2g} Pa too much; the offset was taken off"
    )
    ENCODER_ZERO = (
        "position_m reads {zero_mm:.1f} +- {half_width_mm:.1f} mm in the middle of the stroke; it was shifted"
    )
    AREA_TO_DISPLACEMENT = (
        "pump displacement over piston area is {percent:.2f} +- {half_width:.2f} % of what the rig file says: one of "
        "the two is wrong, and the log does not tell which"
    )
    PUMP_WORN = (
        "the pump delivers {percent:.1f} +- {half_width:.1f} % of its displacement: it is worn, or displacement or "
        "piston area in the rig file is wrong"
    )
    VOLUME_DIFFERS = "the chambers hold {percent:.0f} +- {half_width:.0f} % of the volume that the rig file says"
    STARTS_UNDER_LOAD = (
        "the log begins under a differential pressure of {pressure_pa:.3g} Pa, a load of {force_n:.3g} N"
    )
    AIR_ENTRAINED = (
        "the oil holds {percent:.2g} +- {half_width:.2g} % of air at atmospheric pressure; bulk modulus is stated at "
        "{stated_pa:.3g} Pa absolute, and is {liquid_pa:.3g} Pa without the air"
    )
    AIR_ENTERS = (
        "air gets into the oil after {percent_of_log:.0f} % of the log: {percent:.2g} +- {half_width:.2g} % at "
        "atmospheric pressure"
    )
    RELIEF_LOW = (
        "the relief valve opens at {setting_pa:.3g} +- {half_width_pa:.2g} Pa, the rig file says {rig_pa:.3g} Pa: it "
        "is set low, or leaks"
    )
    LEAKAGE_GROWS = (
        "leakage grows over the log by a factor of {factor:.2f}, from {first:.3g} to {last:.3g} m^3/(s Pa): more than "
        "warming oil explains"
    )
    LEAKAGE_DRIFTS = (
        "leakage changes over the log by a factor of {factor:.2f}, from {first:.3g} to {last:.3g} m^3/(s Pa), as when "
        "the oil warms or cools; the condition is that at the end"
    )
    MAKEUP_BLOCKED = "the make-up valve of chamber {side} feeds next to nothing: it is stuck shut"
    PORT_DRAINS = (
        "chamber {side} loses {drain:.3g} m^3/(s Pa) to the inner circuit: its make-up valve leaks or is stuck open"
    )
    OIL_STIFFER = (
        "bulk modulus is {ratio:.3g} times that of the rig file; the conditions are compared around the measured one"
    )
    OIL_SOFTER = (
        "bulk modulus is {ratio:.2g} of that in the rig file: air in the oil, or a soft hose; the conditions are "
        "compared around the measured one"
    )
    CHECKS_CRACK = (
        "the make-up valves open {crack_pa:.3g} +- {half_width_pa:.2g} Pa below the rig file's accumulator pressure"
    )
    EXPLAINED_OTHERWISE = "{count} other explanation(s) fit the log about as well; the interval holds them"
