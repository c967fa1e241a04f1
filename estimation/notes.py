"""Notes of checks, fits and filters of the gear-pump actuator."""

from plant.notes import Code


class SensorCode(Code):
    """Notes on the sensors of a log."""

    SENSOR_FROZE = "{channel} froze for {length_s:.3g} s, from {begin_s:.3g} s on, while other channels moved"
    SENSOR_CONSTANT = "{channel} is {value:.4g|bar} bar throughout: the sensor is dead or not connected"
    SENSOR_NOISE_ONLY = "{channel} shows only noise ({noise:.3g|bar} bar) while the motor turns: the sensor is dead"
    SENSOR_CLIPPED = (
        "{channel} is at the end of its range ({levels} {unit}) in {percent:.2g} % of its samples; they were left out"
    )
    HUM = "{channel} contains a hum of {amplitude_pa:.3g|bar} bar at {frequency_hz:.4g} Hz; it was removed"
    HELD = (
        "{channel} has a new sample only every {milliseconds:.3g} ms and repeats it for {rows} rows; the repeated "
        "values were left out"
    )
    SPEED_HELD = (
        "{channel} has a new sample only every {milliseconds:.3g} ms and repeats it for {rows} rows; the pump's flow "
        "in between is not known, so only the rows of new samples were used: log the speed in every row"
    )
    BRIDGED = (
        "{channel} has a new sample only every {milliseconds:.3g} ms and was interpolated linearly in between; one row "
        "in {rows} was used"
    )
    DROPOUT = (
        "the logger missed {rows} rows (places: {count}): all channels repeat their last sample, and then {channel} "
        "jumps; the repeated rows were left out"
    )
    SENT_TWICE = (
        "the logger wrote {rows} rows a second time, under later times (places: {count}); the copies were left out"
    )
    HELD_ALONE = (
        "{channel} repeats its last value for {seconds:.3g} s in all while other channels go on (places: {count}, the "
        "first at {begin_s:.3g} s); the repeated values were left out"
    )
    ROWS_LOST = (
        "{jumped} jump from one row to the next at {where} s, farther than piston and oil can go: the logger lost rows "
        "there, although its times go on; only {begin_s:.4g} to {end_s:.4g} s of the log was used"
    )
    POSITION_REZEROED = (
        "{channel} steps by {step:.4g|mm} mm at {at_s:.4g} s while everything else goes on as before: its zero was "
        "reset, or rows were lost in steady motion; the step was subtracted"
    )
    PRESSURE_REZEROED = (
        "{channel} steps at {where} s (by {step:.3g|bar} bar), which no flow explains, while position goes on as "
        "before: its zero was reset; only {begin_s:.4g} to {end_s:.4g} s of the log was used"
    )
    FILTERED = (
        "{channel} was filtered or averaged before it was logged: its noise is correlated over {rows} rows, so one "
        "sample in {rows} was used"
    )
    OUTLIERS_LEFT_OUT = "{channel} has gross outliers in {count} of {total} samples; they were left out"
    SENSORS_DISAGREE = "velocity_m_s and the slope of position_m differ by {difference_m_s:.2g|mm/s} mm/s: one is wrong"
    VELOCITY_LATE = (
        "{channel} comes {late_ms:.2g} ms later than the slope of position_m: it was filtered, or derived from "
        "position with a delay; it was not used"
    )
    VELOCITY_OFFSET = (
        "{channel} reads {offset_m_s:.2g|mm/s} mm/s too much, compared with position_m; the offset was subtracted"
    )


class ChannelCode(Code):
    """Notes on channels whose sign, unit or name is wrong: correct the columns, then read the log again."""

    CHANNEL_REVERSED = (
        "the sign of {channel} is wrong: its correlation with {against} is {correlation:.2f}; give the column "
        "with a minus before its unit (NAME:-UNIT under [columns] in the rig file, or --columns CHANNEL=NAME:-UNIT)"
    )
    SPEED_UNSIGNED = "{channel} is never negative, but the piston goes both ways alike: log the speed with its sign"
    CHANNELS_SWAPPED = (
        "{channel} and {other} are swapped: the slope of the second is the first (correlation {correlation:.2f}); "
        "correct the names of the columns (under [columns] in the rig file, or --columns CHANNEL=NAME)"
    )
    CHANNEL_UNIT = (
        "{channel}: the values are {factor:.3g} times what {against} would give, which looks like {slip}; give the "
        "column's unit (NAME:UNIT under [columns] in the rig file, or --columns CHANNEL=NAME:UNIT)"
    )
    CHANNEL_MISREAD = (
        "{channel} looks like {slip}: with that set right, the log fits the rig; correct the column's unit (NAME:UNIT "
        "under [columns] in the rig file, or --columns CHANNEL=NAME:UNIT)"
    )
    NO_SUCH_OIL = (
        "{channel}: bulk modulus seems {ratio:.2g} times that in the rig file, and oils differ by far less: a unit or "
        "sign of pressure or motor speed is wrong, or bulk_modulus in the rig file"
    )
    UNIT_CHANGES = (
        "{channel}: from {begin_s:.3g} s on, noise is about {factor:.3g} times what it was, as when the column's unit "
        "changes within the log; cut the log there, and read each part by itself"
    )
    NOTHING_CHANGES = (
        "{channel}: no value changes although the motor turns: the logger repeats one row, or no sensor is connected"
    )


class EstimateCode(Code):
    """Notes on an estimate of bulk modulus: objections to it, or what it lacks."""

    NOT_DETERMINED = (
        "this record does not determine the coefficients separately (a pole cancels a zero, or the order is too high): "
        "the true uncertainty is larger than the covariance"
    )
    BOUND_TOO_WIDE = (
        "this log determines bulk modulus to {percent:.1f} % at best (Cramér-Rao bound; 3 % is allowed): log larger "
        "steps, at 1 kHz or more"
    )
    KNOWN_AS_THE_RIG = (
        "measure {entry}, and list it under measured in the rig file: its uncertainty there causes {percent:.0f} % of "
        "the variance of {quantity!w} with rig error"
    )
    STIFFER_THAN_RIG = (
        "bulk modulus is {ratio:.2g} times that in the rig file: if the oil is stiffer, enter its bulk_modulus there, "
        "else correct chamber_volume from {written:.3g} to {volume:.3g} m^3, or the unit of differential_pressure_pa"
    )
    SOFTER_THAN_RIG = (
        "bulk modulus is {ratio:.2g} times that in the rig file: there is air in the oil or a soft hose, or "
        "chamber_volume is {volume:.3g} m^3 and not {written:.3g} m^3"
    )
    DIVERGED = "the estimate became infinite or not a number: check units, the rig file and --form"
    PRESSURE_RESIDUALS_LARGE = (
        "the flow balance does not explain the log: the pressure residuals are {ratio:.1f} times the sensor's noise"
    )
    PRESSURE_RESIDUALS_SMALL = (
        "pressure fits {ratio:.1f} times more closely than the noise of position_m allows: the fit is not believed"
    )
    PRESSURE_RESIDUALS_CORRELATED = (
        "the flow balance leaves something out: what it misses of the pressure is more than noise (correlation of "
        "successive residuals {correlation:.2f}, noise alone: 0)"
    )
    PRESSURE_SMOOTHED = "{channel} was smoothed (filtfilt, low-pass): without its noise, no fit can be checked"
    SEARCH_ENDED = "the search for what explains the log became too long and was ended: use a shorter part of the log"
    CHANNEL_LATE = (
        "{channel} is {milliseconds:.1f} ms too {when} for the flow balance: a sensor or its filter lags, and this was "
        "not corrected"
    )
    PLAY_LEFT = (
        "the piston moves while position_m stands still, as with about {play_um:.1g} um of play (backlash), and the "
        "fit could not correct this: bulk modulus may be several percent too low"
    )
    RIG_CONTRADICTED = (
        "the piston moves as if the pump delivered about {percent:.0f} % of its displacement: check pump displacement "
        "and piston area in the rig file, and unit and scale of motor speed and position"
    )
    TEETH_LEFT = (
        "the pressure residuals follow the shaft angle, as with a flow ripple of {percent:.0f} % from the pump's teeth "
        "({teeth} per turn), and the fit could not correct this: bulk modulus may be a percent too low"
    )
    POSITION_RESIDUALS_LARGE = (
        "the position residuals are {ratio:.2f} times the sensors' noise ({motion_percent:.2g} % of the motion): "
        "neither friction model explains how the piston starts and stops, and bulk modulus may be far off"
    )
    FRICTION_LAWS_DISAGREE = (
        "two friction models explain the log equally well, but put bulk modulus at {least_pa:.3g|MPa} and at "
        "{most_pa:.3g|MPa} MPa; log differential pressure"
    )
    FORCES_ON_ANY_SCALE = (
        "position alone does not fix the scale of the forces: any bulk modulus from {least_pa:.3g|MPa} to "
        "{most_pa:.3g|MPa} MPa explains the log, with friction in proportion; log differential pressure"
    )
    NOT_HELD = "position alone does not determine bulk modulus: any value fits the motion; log differential pressure"
    WEAKLY_HELD = (
        "position alone determines bulk modulus only weakly: noise gives it a standard deviation of "
        "{noise_percent:.2g} %, and a misfit too small to detect may move it by {percent:.0f} %; log pressure"
    )
    INNOVATIONS_LARGE = (
        "the residuals of {channel} are {ratio:.1f} times as large as the filter expects (normalised innovation "
        "squared {nis:.1f}, expected 1): model and log disagree, and the interval is too narrow"
    )
    INNOVATIONS_FOLLOW_DRIVE = (
        "the residuals of {channel} have {excess:.3g} times the power of white noise between {least_hz:.4g} and "
        "{most_hz:.4g} Hz, where the drive has power too: the model answers the drive differently from the log, and "
        "the interval is up to {narrow:.2g} times too narrow"
    )
    INNOVATIONS_BESIDE_DRIVE = (
        "the residuals of {channel} have {excess:.3g} times the power of white noise between {least_hz:.4g} and "
        "{most_hz:.4g} Hz, where the drive has almost none: the model leaves out a friction, a valve, a sensor's drift "
        "or electrical interference, and the interval is up to {narrow:.2g} times too narrow"
    )
    ESTIMATE_WANDERS = (
        "estimates of {state} from different parts of the log differ by {ratio:.0f} times what the interval allows: "
        "the interval is too narrow"
    )
    NOT_SETTLED = (
        "{state} still changed by {moved:.3g} {unit} over the last fifth of the log: the estimate has not settled"
    )
    AT_PHYSICAL_BOUND = "{state} ended at its physical limit ({value:.3g} {unit})"
    PUMP_AND_PISTON_REST = "neither pump nor piston moves noticeably in this log: bulk modulus is not observable"
    POSITION_CONSTANT = "{channel} never changes: the sensor is dead, or the piston stands still; find out which"
    PISTON_STANDS_STILL = (
        "the piston moves by only {moved_m:.2g|mm} mm, while the pump turns enough for {pumped_m:.3g|mm} mm: it is "
        "stuck, or all that is pumped leaks or is compressed; no motion confirms the units of motor speed and pressure"
    )
    STILL_AND_FOREIGN = (
        "bulk modulus seems {ratio:.2g} times that in the rig file, but while the piston stands still, such oil cannot "
        "be told from a wrong unit of motor speed or pressure"
    )
    PRESSURE_ABSENT = (
        "without differential_pressure_pa the estimate depends on the friction model, which may be wrong for your "
        "actuator; while the piston sticks, the log says nothing about the oil (errata E13)"
    )
    PRESSURE_UNUSED = "the acceleration form does not use differential_pressure_pa, and fails at reversals (errata E9)"


class RigCode(Code):
    """Notes on a rig, its oil or its logger that differ from what the rig file says, and explain the log."""

    PRESSURE_LATE = (
        "differential_pressure_pa is {late_ms:.2f} ± {half_width_ms:.2f} ms late (lag or delay of its sensor); this "
        "was corrected"
    )
    INPUT_LATE = (
        "{channel} is {late_ms:.2f} ± {half_width_ms:.2f} ms late (lag or delay of its sensor or filter); this was "
        "corrected"
    )
    INPUT_EARLY = (
        "{channel} is {early_ms:.2f} ± {half_width_ms:.2f} ms ahead of position and pressure (a command in place of a "
        "measurement, or a delay of both sensors); this was corrected"
    )
    PRESSURE_OFFSET = (
        "differential_pressure_pa reads {offset_pa:.4g|bar} ± {half_width_pa:.2g|bar} bar too much; the offset was "
        "subtracted"
    )
    PRESSURE_DRIFTS = (
        "pressure's offset drifts by {drift_pa:.4g|bar} ± {half_width_pa:.2g|bar} bar over the log; it was subtracted"
    )
    PRESSURE_SIDES = "the chamber gauges differ in gain by {percent:z.2f} ± {half_width:.2g} %; the fit includes this"
    ENCODER_ZERO = (
        "position_m reads {zero_mm:.1f} ± {half_width_mm:.2g} mm at mid-stroke; it was shifted to zero there. If its "
        "zero is right, chamber {side} holds {more:.2g|L} L more than the other (a hose)"
    )
    POSITION_PLAY = "position_m follows the piston with about {play_um:.1g} um of play (backlash); it was corrected"
    PLAY_NOT_EXCLUDED = (
        "the piston moves a little while position_m stands still, by chance or because of about {play_um:.1g} um of "
        "play (backlash): the interval of bulk modulus includes its effect"
    )
    AREA_TO_DISPLACEMENT = (
        "the ratio of pump displacement to piston area is {percent:.1f} ± {half_width:.2g} % of that in the rig file: "
        "one of the two is wrong, or (below 100 %) the pump is worn, and the log does not show which"
    )
    PUMP_WORN = (
        "the pump delivers {percent:.1f} ± {half_width:.2g} % of its displacement: it is worn, or displacement or "
        "piston area in the rig file is wrong"
    )
    PUMP_RIPPLES = "the pump's {teeth} teeth make its flow ripple by {percent:.1f} ± {half_width:.2g} % (in the fit)"
    MAKEUP_BENDS = (
        "make-up valves act as orifices: at {drop_pa:.2g|bar} bar they pass half as much per bar; the fit includes this"
    )
    PARTLY_EXPLAINED = "a hint only: {causes} would explain {explained:.0f} % of what the flow balance does not"
    GAS_CONTRADICTED = (
        "the accumulator holds at {limit} {ratio:.2g} times the gas in the rig file, or its charge pressure is another"
    )
    MAKEUP_UNSEEN = "the make-up valve of chamber {side} never opened: this log does not show whether it is stuck shut"
    SPEED_OFFSET = (
        "motor_speed_rad_s reads {offset_rad_s:.3g|rpm} ± {half_width:.2g|rpm} rpm too much; the offset was subtracted"
    )
    WEAR_NOT_EXCLUDED = (
        "pump wear is not excluded: at these speeds a pump that delivers up to {percent:.0f} % less would look like "
        "leakage, and bulk modulus would be too low by the same share"
    )
    SINGLE_ROD = (
        "looks like a single rod, so give two areas and volumes: side B has {percent:.1f} ± {half_width:.2g} % of the "
        "area of side A (rig file: {rig_percent:.1f} %) and {volume_percent:.0f} % of its volume (rig file: "
        "{rig_volume_percent:.0f} %), pilot_share is {pilot_share:.2g} (rig file: {rig_pilot_share:.2g})"
    )
    AREAS_VAGUE = "the ratio of the piston's areas is known to ± {percent:.0f} % only: give two areas in the rig file"
    VOLUME_UNLIKELY = (
        "{percent:.0f} ± {half_width:.2g} % of the rig file's chamber_volume fits a little better, with a bulk modulus "
        "{modulus_percent:+.0f} % away; the file makes that unlikely, the interval reaches it: measure chamber_volume"
    )
    VOLUME_DIFFERS = "the chamber volume is {percent:.1f} ± {half_width:.2g} % of that in the rig file"
    STARTS_UNDER_LOAD = (
        "the log begins at a differential pressure of {pressure_pa:.3g|bar} bar, its lower chamber {level_pa:.3g|bar} "
        "bar above the accumulator: the piston moves, or friction or a load of {force_n:.3g} N holds it"
    )
    AIR_ENTRAINED = (
        "the oil contains {percent:.2g} ± {half_width:.2g} % of air at atmospheric pressure; bulk modulus is given at "
        "{stated_pa:.3g|bar} bar absolute, and would be {liquid_pa:.3g|MPa} MPa without the air"
    )
    AIR_ENTERS = (
        "air enters the oil after {percent_of_log:.0f} % of the log: {percent:.2g} ± {half_width:.2g} % at "
        "atmospheric pressure"
    )
    RELIEF_LOW = (
        "the relief valve opens at {setting_pa:.3g|bar} ± {half_width_pa:.2g|bar} bar instead of the {rig_pa:.3g|bar} "
        "bar in the rig file: it is set too low, or leaks"
    )
    LEAKAGE_GROWS = "leakage grows by a factor of {factor:.3g} over the log: more than warming oil explains"
    LEAKAGE_STEPS = (
        "leakage changes from {first:.3g|L/(min bar)} to {last:.3g|L/(min bar)} L/(min bar) after {percent_of_log:.3g} "
        "% of the log; the change takes {within_percent:.2g} % of it"
    )
    LEAKAGE_DRIFTS = (
        "leakage changes by a factor of {factor:.2f} over the log, from {first:.3g|L/(min bar)} to {last:.3g|L/(min "
        "bar)} L/(min bar), as when the oil warms or cools; severities are those at the end; the condition was judged "
        "with the oil of the beginning, the middle and the end"
    )
    MAKEUP_BLOCKED = "the make-up valve of chamber {side} lets almost no oil in: it is stuck shut"
    PORT_DRAINS = (
        "chamber {side} loses {drain:.3g|L/(min bar)} L/(min bar) to the inner circuit: its make-up valve leaks or is "
        "stuck open"
    )
    PORTS_DRAIN_APART = (
        "no fault: chamber A loses {drain_a:.2g|L/(min bar)} and chamber B {drain_b:.2g|L/(min bar)} L/(min bar) to "
        "the inner circuit; the case drain of a sound pump takes up to {sound:.2g|L/(min bar)} L/(min bar)"
    )
    OIL_STIFFER = (
        "bulk modulus is {ratio:.3g} times that in the rig file; the conditions were compared at the measured value"
    )
    OIL_SOFTER = (
        "bulk modulus is {ratio:.2g} times that in the rig file: air in the oil, or a soft hose; the conditions were "
        "compared at the measured value"
    )
    LEAKAGE_TURBULENT = (
        "{percent:.0f} ± {half_width:.2g} % of the leakage at {at_pa:.3g|bar} bar is turbulent (it grows with the "
        "square root of pressure), as at a worn edge or scratch; leakage is given at that pressure"
    )
    PRESSURE_TAPPED = "pressure rises with motor speed: it may be tapped at the pump, before a hose; this was corrected"
    PUMP_COMPRESSES = (
        "the pump is filled at the pressure of its inlet and then compresses its oil, so it delivers less: by "
        "{share:.2g} ± {half_width:.2g} times the compression of the oil; the fit includes this"
    )
    BORE_LEAKS = (
        "near position {at_mm:.3g} mm, within about {width_mm:.2g} mm, leakage is {factor:.2g} times as large as "
        "elsewhere: the bore may be scored or worn there; the fit includes this"
    )
    TOOTH_LEAKS = (
        "once in each turn of the pump, leakage rises to {factor:.2g} times its usual value: one tooth of the pump may "
        "be worn or chipped; the fit includes this"
    )
    PUMP_STARVES = (
        "above a motor speed of {from_rad_s:.3g|rpm} rpm the pump delivers less than its displacement ({percent:.1f} ± "
        "{half_width:.1g} % less at {fastest_rad_s:.3g|rpm} rpm): it fills badly (low inlet pressure, blocked suction "
        "line, cold oil); the fit includes this"
    )
    LEAKAGE_LIFTS = (
        "above a differential pressure of {from_pa:.3g|bar} bar, leakage grows faster than pressure ({factor:.2g} "
        "times the usual at {highest_pa:.3g|bar} bar): a seal lifts or a valve opens; the fit includes this"
    )
    LEAKS_ONE_WAY = (
        "leakage is {factor:.2g} times as large while chamber {side} is loaded: a relief or check valve of that side "
        "may leak; the fit includes this"
    )
    CHECKS_CRACK = (
        "the make-up valves open {crack_pa:.3g|bar} ± {half_width_pa:.2g|bar} bar below the rig file's accumulator "
        "pressure (mean of both); chamber {side}'s opens {later_pa:.3g|bar} ± {later_half_width_pa:.2g|bar} bar lower"
    )
    EXPLAINED_OTHERWISE = "the log is explained about as well by {causes}; the interval includes this"
