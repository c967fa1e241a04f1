"""What a diagnosis of the gear-pump actuator may bring up: against a class, what is not told, what to do next."""

from plant.notes import Code


class AgainstCode(Code):
    """What speaks against a log being in any of the nine conditions."""

    UNEXPLAINED = "the best circuit leaves {percent:.0f} % of the {channel} unexplained"
    NONE_FITS = (
        "none of the nine fits: the best leaves {percent:.0f} % of the signal unexplained; check the rig file and the "
        "columns' units"
    )
    PUMP_OFF = (
        "the pump's flow against the piston's is {percent:+.0f} % off the rig file: motor speed or position reads "
        "wrong, or it is another actuator"
    )
    SPEED_BIAS = "motor speed reads {bias_rad_s:+.3g} rad/s off"
    PRESSURE_BIAS = "differential pressure reads {bias_pa:+.3g} Pa off"
    OIL_SOFT = "the oil's bulk modulus is {share:.2f} of the rig's: air in it, or a soft hose"
    OIL_STIFF = "the oil's bulk modulus is {share:.2f} of the rig's: another oil, or a wrong rig file"
    OUTSIDE_CONDITIONS = "the actuator that fits is in none of the nine conditions, nor between them"
    BETWEEN_CONDITIONS = (
        "between the nine conditions: leakage {leakage:.2f} and friction {friction:.2f} where 1 is minor and 2 major; "
        "a fault of another size, or a sensor with a wrong gain"
    )


class ClassCode(Code):
    """Notes on a diagnosis as a whole."""

    FRICTION_NOT_VISIBLE = (
        "friction is not visible: the piston hardly moves, so any friction beyond what holds it fits alike"
    )
    BULK_MODULUS_NOT_VISIBLE = "bulk modulus is not visible under this drive"
    ONE_SCALE = (
        "without pressure leakage and friction share one scale, beyond which they are not told apart but by how alike "
        "actuators of one kind are"
    )
    LEAKAGE_AND_BIAS_ALIKE = "leakage coefficient and flow bias are not told apart"
    VELOCITY_LOST_TOLD = "the velocity lost, {percent:z.1f} % ({low:z.1f} to {high:z.1f}), is what the log determines"
    MODELS_DIVERGED = "no condition's model stayed finite; check units and rig"
    MODELS_ALIKE = "no class: under this drive the models move alike; drive the actuator, at best with steps"
    NO_CIRCUIT = "no circuit fits around this rig, so there are scores but no probabilities: {reason}"
    NO_PROBABILITIES = "no probabilities: {reason}"
    LOAD_ON_ROD = (
        "a constant load of {force_n:.3g} N holds the rod back, or differential_pressure_pa reads {pressure_pa:.3g} Pa "
        "too much: the force balance does not tell the two apart"
    )
    END_STOP = "the piston ran into a stop {reach_mm:.0f} mm from where the log begins; the circuit was fitted with it"
    PRESSURE_ABSENT_CLASS = (
        "without differential_pressure_pa friction shows in velocity alone: margins are smaller as a rule"
    )


class AdviceCode(Code):
    """What to do or to measure next."""

    CHECK_SENSOR = "check the sensor of {channels} and its wiring, then log again"
    MEND_COLUMNS = "correct the sign, unit or name of {channels} with --columns, then read the same log again"
    CHECK_RIG = "compare the rig file with the actuator (geometry, pump, relief setting), then log again"
    STOP_LEAKAGE = "stop, and check pump and piston seal before the next run: leakage grew within this log"
    CHECK_PUMP = "measure the pump's flow against low pressure; compare displacement and piston area in the rig file"
    CHECK_MAKEUP = "check the make-up valve of chamber {side}: poppet, seat and spring"
    CHECK_RELIEF = "check setting and seat of the relief valve; compare its setting in the rig file"
    FIND_AIR = "bleed the circuit, and find where air gets in: rod seal, fittings, bladder of the accumulator"
    FIT_DOUBTED = "the model does not follow this log: check units, signs and the rig file first"
    LOG_PRESSURE = "log differential pressure: it narrows leakage and friction several times"
    MOVE_PISTON = "drive steps that move the piston: this log cannot show friction"
    MORE_SPEEDS = (
        "hold two or more motor speeds (hydrostate simulate --drive steps): this log holds {speeds}, which leaves two "
        "causes"
    )
    LOG_LONGER = (
        "log steps of 10 s or more at several speeds: this log of {duration_s:.3g} s leaves more than one condition "
        "open"
    )
    CONDITIONS_OPEN = "log again with larger steps: this log leaves more than one condition open"
    CLOSER_SPEEDS = "log slower speeds too: at {speeds} speeds leakage and flow bias still look alike"
    NOTHING = "no further measurement is needed: this log decides"
