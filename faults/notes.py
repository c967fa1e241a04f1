"""Notes of a diagnosis of the gear-pump actuator: objections to a class, undetermined severities, next steps."""

from plant.notes import Code


class AgainstCode(Code):
    """Reasons against all nine conditions."""

    UNEXPLAINED = "the circuit that fits best is off by {percent:.0f} % of the measured {channel} (root mean square)"
    NONE_FITS = (
        "none of the nine conditions fits: the best model is off by {percent:.0f} % of the measured signal (root "
        "mean square); check the rig file and the columns' units"
    )
    PUMP_OFF = (
        "the ratio of pump flow to piston flow differs by {percent:+.0f} % from the rig file: motor speed or position "
        "reads wrong, or the rig file is of another actuator"
    )
    PUMP_DELIVERS_LESS = (
        "a pump that delivers {percent:.0f} % of its displacement explains the log better than any of the nine "
        "conditions: it is worn, or displacement or piston area in the rig file is wrong"
    )
    MAKEUP_STUCK = (
        "a make-up valve of chamber {side} that is stuck shut explains the log better than any of the nine conditions"
    )
    MAKEUP_LEAKS = "a make-up valve that leaks explains the log better than any of the nine conditions"
    RELIEF_EARLY = (
        "a relief valve that opens early, so that the pump's flow escapes under load, explains the log better than any "
        "of the nine conditions"
    )
    STUCK_OR_LEAKS = (
        "the piston moves by only {moved_m:.2g|mm} mm, while the pump turns enough for {pumped_m:.3g|mm} mm: without "
        "differential_pressure_pa the log does not tell whether the piston is stuck or leakage takes all that is pumped"
    )
    ROD_BLOCKED = (
        "the piston moves by only {moved_m:.2g|mm} mm at a differential pressure of {held_pa:.3g|bar} bar, while major "
        "friction yields at {yields_pa:.2g|bar} bar: rod or piston is blocked, the piston is at its stop, or a sensor "
        "or its unit is wrong"
    )
    SPEED_BIAS = "motor speed reads wrong by {bias_rad_s:+.3g|rpm} rpm"
    LOAD_UNTOLD = (
        "{load} on the rod that is not in the rig file would explain the log: if there is one, enter {entry} "
        "(about {value:.2g} {unit})"
    )
    LOAD_OR_OFFSET = (
        "motor speed reads wrong by {bias_rad_s:+.3g|rpm} rpm, or there is {load} on the rod that is not in the rig "
        "file ({entry} of about {value:.2g} {unit}): without differential_pressure_pa the log does not tell which"
    )
    LOAD_VARIES = (
        "the load on the rod changes over the log: its force varies by about {force_n:.2g} N (root mean square), and "
        "the nine conditions have no load"
    )
    FRICTION_VARIES = (
        "friction is intermittent: at times, most at {at_s:.3g} s, {force_n:.2g} N more than usual hold the piston "
        "back, whichever way it slides; in each of the nine conditions friction stays the same"
    )
    GRIPS_ONE_WAY = (
        "at times, most at {at_s:.3g} s, {force_n:.2g} N more than usual hold the piston back, always while it slides "
        "the same way: friction is intermittent, or a load comes and goes, and the nine conditions have neither"
    )
    PRESSURE_BIAS = "differential pressure reads wrong by {bias_pa:+.3g|bar} bar"
    OIL_SOFT = "the oil's bulk modulus is {share:.2f} times that in the rig file: air in the oil, or a soft hose"
    OIL_STIFF = "the oil's bulk modulus is {share:.2f} times that in the rig file: another oil, or a wrong rig file"
    OIL_SOFTENS = (
        "at about {at_s:.1f} s the oil's bulk modulus fell to {share:.2f} of what it was before: air got in, which is "
        "none of the nine conditions"
    )
    OUTSIDE_CONDITIONS = (
        "the log fits none of the nine conditions, and nothing between them: leakage is {leakage:.3g} and friction "
        "{friction:.3g} (0 is none, 1 is minor, 2 is major or more), but {part} is {ratio:.2g} times what it should be "
        "at these levels"
    )
    BETWEEN_CONDITIONS = (
        "the fault lies between the nine conditions: to the nearest quarter, leakage {leakage:.3g} and friction "
        "{friction:.3g}, where 0 is none, 1 is minor and 2 is major; a sensor with a wrong gain would look the same"
    )


class ClassCode(Code):
    """Notes on a diagnosis as a whole."""

    FRICTION_NOT_VISIBLE = (
        "the log does not show friction: the piston hardly moves, so any friction that holds it fits equally well"
    )
    BULK_MODULUS_NOT_VISIBLE = "this drive does not show bulk modulus"
    ONE_SCALE = (
        "without pressure, leakage and friction are known only up to one common factor; the intervals include the "
        "spread of this factor among actuators of one kind"
    )
    LEAKAGE_AND_BIAS_ALIKE = "the log does not separate leakage coefficient and flow bias (a constant loss of the pump)"
    VELOCITY_LOST_TOLD = "the velocity lost is known all the same: {percent:z.1f} % ({low:z.1f} to {high:z.1f})"
    STUCK_NOT_TOLD = (
        "a make-up valve that is stuck shut but never had to open leaves no trace; this fault, which is not one of "
        "the nine conditions, keeps a probability of {percent:.0f} %"
    )
    OIL_STIFFER_CLASS = (
        "the circuit that fits has {ratio:.2g} times the bulk modulus in the rig file (another oil, or a wrong rig "
        "file); the conditions were compared at that value"
    )
    NOT_EXCLUDED = (
        "without differential_pressure_pa, other faults explain the log about as well and are not excluded: {faults}; "
        "{condition}"
    )
    VELOCITY_CONTRADICTED = (
        "{channel} and the slope of position_m differ by {difference_m_s:.2g|mm/s} mm/s; motor speed and pressure "
        "agree with position_m, so {channel} is wrong: it was not used, check its sensor"
    )
    BALANCE_REFUSED = (
        "bulk modulus is refused, but the class stands: a circuit follows velocity to {velocity_percent:.2g} % and "
        "pressure to {pressure_percent:.2g} %, and no worn pump, low relief valve or faulty make-up valve explains the "
        "log better"
    )
    WEAR_NOT_TOLD = (
        "the log does not tell a worn pump from a sound one: with a probability of {percent:.2g} %, the pump delivers "
        "less than {limit:.0f} % of its displacement, which is none of the nine conditions"
    )
    MODELS_DIVERGED = "the models of all conditions diverged; check units and rig file"
    CHANNEL_ZERO = "no class: every sample of {channels} is 0; check the column, or log again while the piston moves"
    MODELS_ALIKE = "no class: the models of all conditions move alike under this drive; drive the actuator in steps"
    NO_CIRCUIT = "no circuit can be fitted with this rig file, so there are scores but no probabilities: {reason}"
    VOLUME_FOR_STROKE = (
        "chamber_volume in the rig file has no room for the stroke: it must be at least {percent:.0f} % larger, and "
        "the circuits were fitted with that; measure chamber_volume and stroke"
    )
    NO_PROBABILITIES = "no class: {reason}"
    LOAD_ON_ROD = (
        "a constant load of {force_n:.0f} N ({low:.0f} to {high:.0f} N) holds the rod back, or differential_pressure_pa"
        " reads {pressure_pa:.3g|bar} bar too much: the force balance cannot separate the two"
    )
    SPRING_ON_ROD = (
        "a spring of {value:.0f} N/m ({low:.0f} to {high:.0f} N/m) acts on the rod; the rig file says {rig:.0f} N/m"
    )
    MASS_ON_ROD = "the moving mass is {value:.3g} kg ({low:.3g} to {high:.3g} kg); the rig file says {rig:.3g} kg"
    END_STOP = "the piston ran into a stop {reach_mm:.0f} mm from where the log begins; the fit includes the stop"
    HEALTHY_OF_THE_PAPER = (
        "the rig file has the pump or piston of your actuator, but still the leakage and friction of the paper's: "
        "class and severities are counted from these, so enter those of your healthy actuator"
    )
    MAKEUP_TOO_SMALL = (
        "the sides of a single rod take different flows; by the rig file, the difference needs {drop_pa:.2g|bar} bar "
        "across the make-up valves at rated speed, but the inner circuit has {has_pa:.2g|bar} bar: leave "
        "makeup_conductance out, or enter that of your valves"
    )
    PRESSURE_ABSENT_CLASS = (
        "without differential_pressure_pa, friction shows only in velocity: classes are usually told apart less clearly"
    )


class AdviceCode(Code):
    """Advice on what to do or measure next."""

    CHECK_SENSOR = "check the sensor and the wiring of {channels}, then log again"
    MEND_SENSOR = "check the sensor and the wiring of {channel}: this log was judged without it"
    MEND_COLUMNS = (
        "correct the sign, unit or name of {channels} under [columns] in the rig file, or with --columns, then read "
        "the same log again"
    )
    CHECK_LOGGER = "check the logger and its wiring, then log again while the motor turns and the piston moves"
    LOG_EVERY_ROW = "switch off dead band and compression of the logger for {channels}, then log again"
    CHECK_RIG = (
        "compare the rig file with the actuator (geometry, pump, relief valve, healthy leakage and friction) and check "
        "the scale of each sensor, then diagnose this log again"
    )
    STOP_LEAKAGE = "stop, and check pump and piston seal before the next run: leakage grew during this log"
    CHECK_PUMP = "measure the pump's flow at low pressure; compare displacement and piston area with the rig file"
    INSPECT_BORE = "inspect the bore and the piston seal near position {at_mm:.3g} mm"
    INSPECT_PUMP = "inspect the teeth and the side plates of the pump"
    FREE_PISTON = "check whether rod or piston is blocked, then log again while the piston moves"
    HOLD_LOAD = "log again without the load on the rod, or with one that is constant"
    FREE_ROD = "find what holds the piston back at times: a bent rod, a load from the side, dirt, or a torn seal"
    CHECK_INLET = "check the pump's inlet: accumulator pressure, suction line, strainer, oil temperature"
    CHECK_VALVES = "check the seats of relief and check valves, and the piston seal"
    CHECK_MAKEUP = "check the make-up valve of chamber {side}: poppet, seat and spring"
    CHECK_RELIEF = "check setting and seat of the relief valve; compare the setting with the rig file"
    FIND_AIR = "bleed the circuit and find where air gets in: rod seal, fittings, bladder of the accumulator"
    BLEED = (
        "bulk modulus is {percent:.0f} % below that of the healthy actuator: bleed the circuit and find where air gets "
        "in; if there is no air, correct chamber_volume in the rig file to {volume:.3g} m^3"
    )
    CORRECT_VOLUME = (
        "correct chamber_volume in the rig file from {written:.3g} to {volume:.3g} m^3, then diagnose this log again"
    )
    GIVE_TWO_SIDES = (
        "give two piston areas and two chamber volumes in the rig file, then diagnose this log again: the actuator "
        "looks like a single rod"
    )
    CORRECT_VOLUME_OR_OIL = (
        "bulk modulus is {ratio:.2g} times that in the rig file: if the oil is stiffer, enter its bulk_modulus there, "
        "else correct chamber_volume from {written:.3g} to {volume:.3g} m^3; then diagnose this log again"
    )
    FIT_DOUBTED = "the model does not follow this log: check units, signs and the rig file first"
    LOG_UNFILTERED = (
        "log {channel} as its sensor gives it, without a filter in logger or script (filtfilt, low-pass, spline), then "
        "diagnose again; so far the log neither confirms nor refutes a class"
    )
    LOG_PRESSURE = "log differential pressure: leakage and friction are then known several times better"
    MOVE_PISTON = "use steps that move the piston: this log cannot show friction"
    MORE_SPEEDS = (
        "hold two or more motor speeds, each for half a second (this log: {speeds}): leakage and flow bias (a constant "
        "loss of the pump) can then be told apart"
    )
    LOG_FASTER = (
        "log at 1 kHz: with a sample every {step_ms:.3g} ms, many sound actuators have no verdict, or an unsure one"
    )
    LOG_LONGER = (
        "log 10 s or more of steps at several speeds: this log of {duration_s:.3g} s leaves more than one condition "
        "possible"
    )
    CONDITIONS_OPEN = "log again with larger steps: this log leaves more than one condition possible"
    CLOSER_SPEEDS = (
        "also log slower speeds: with {speeds} speeds, leakage and flow bias (a constant loss of the pump) still look "
        "alike"
    )
    DRAW_OIL = "use a drive that draws oil into chamber {side}: this log does not show whether its make-up valve opens"
    NOTHING = "no other log is needed: this one is conclusive"
