"""What identification may bring up."""

from plant.notes import Code


class IdentificationCode(Code):
    """Notes on an identified model, or on the signals that it was identified from."""

    PISTON_RESTS = (
        "{output!r} rests in {measured:.0%} of the samples in which {input!r} drives it, a second-order model in "
        "{linear:.0%}: it sticks, and further poles imitate the wait, so order {order} is not the plant's. The fits by "
        "order are {fits}: give the order, or drive the piston around a mean that keeps it moving"
    )
    FEEDBACK = (
        "input {input!r} follows the noise of {output!r} (p = {p_value:.1g}): the data seem to come from a closed loop,"
        " where output error is biased; fit ARMAX or Box-Jenkins"
    )
    VELOCITY_DIFFERENTIATED = (
        "channel 'velocity_m_s' is absent: it is differentiated from 'position_m' by central differences, which "
        "amplifies its noise"
    )
    INPUT_BRIDGED = "input {channel!r} misses {count} of {total} samples: they are bridged by straight lines"
    INPUT_SPLIT = (
        "input {channel!r} misses {count} of {total} samples, and no line stands for them: the log is taken as "
        "{pieces} experiments, each with its own beginning"
    )
    OUTPUT_ALONE_FILTERED = (
        "only the output is filtered: poles come out 20-30 % off and the gain does not roll off (errata E15); filter "
        "input and output alike, or neither"
    )
    UNSTABLE = (
        "the identified {structure} model is unstable (a pole of modulus {modulus:.4f}): it predicts one step ahead, "
        "and does not simulate"
    )
    NEARLY_CANCEL = (
        "the pole {pole} and the zero {zero} nearly cancel ({deviations:.1f} standard deviations apart): intervals "
        "from the covariance cover too little; use dc_gain_interval, or a lower order"
    )
    TIME_CONSTANT_BEYOND_RECORD = (
        "the model of order {order} has a time constant of {time_constant_s:.3g} s and the longest record lasts "
        "{duration_s:.3g} s: no simpler model was to be had, and its steady gain means nothing"
    )
    SLOW_MODELS_PASSED_OVER = (
        "{count} models with a time constant beyond the record of {duration_s:.3g} s are passed over for a simpler one"
    )
    INTEGRATES = (
        "{output!r} integrates its input over the whole record: the model has a pole next to one, so its steady gain "
        "means nothing"
    )
    SIMPLER_MODEL_TAKEN = (
        "in the model of order {order} a pole and a zero nearly cancel, or its gain is not determined; one of order "
        "{taken} does nearly as well on what was held back, and is taken"
    )
    INPUT_BEYOND_RANGE = (
        "input {channel!r} goes from {least:.4g} to {greatest:.4g}, the polynomial model was fitted to {low:.4g} to "
        "{high:.4g}: in {share:.1%} of the samples its products say nothing, and a linear model (--structure "
        "output-error) may follow better"
    )
    NO_NONLINEARITY = (
        "neither dead zone nor saturation nor backlash at the input explains {output!r} better on what was held back "
        "than none: the linear model is taken"
    )
    NO_FIT = (
        "the model of {output!r} explains no more of it than chance would (fit {fit:.1f} %): nothing that it says "
        "is to be believed"
    )
