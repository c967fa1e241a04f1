"""Notes of identification."""

from plant.notes import Code


class IdentificationCode(Code):
    """Notes on an identified model, or on the signals that it was identified from."""

    PISTON_RESTS = (
        "the piston sticks: {output!r} rests in {measured:.0%} of the samples in which {input!r} drives it (a "
        "second-order model: {linear:.0%}). Extra poles imitate the pauses, so order {order} is not that of the plant "
        "(fit by order: {fits}): give the order, or drive the piston around a mean speed"
    )
    FEEDBACK = (
        "input {input!r} follows the noise of {output!r} (p = {p_value:.1g}): the data seem to come from a closed loop,"
        " where output error is biased; name the column that drives the loop (--reference), or fit ARMAX or Box-Jenkins"
    )
    FEEDBACK_AT_ONCE = (
        "{output!r} moves against its gain in the very sample in which {input!r} moves (p = {p_value:.1g}): the data "
        "seem to come from a closed loop whose controller computes {input!r} from {output!r} of the same row. Output "
        "error is biased there, and so is every structure without a delay: name the column that drives the loop "
        "(--reference), or fit --structure box-jenkins --delay 1"
    )
    REGULATED = (
        "{output!r}, now and before, tells {input!r} in most samples ({left:.1%} is left of what the past of {input!r} "
        "does not foretell): a controller seems to compute {input!r} from {output!r}. The less its set-point moves, "
        "the more the model is the inverse of the controller, not the plant: log a test signal, or name the column "
        "that drives the loop (--reference), or fit --structure box-jenkins --delay 1. Only if {input!r} is set freely "
        "and {output!r} answers at once and without noise, is the model the plant's"
    )
    SWAPPED = (
        "{input!r} seems to answer {output!r}, not the other way round (a model in that direction leaves {back:.0%} of "
        "the deviation, this one {left:.0%}): exchange --input and --output; if they are right, a controller computes "
        "{input!r} from {output!r}, and --reference is needed with the column that drives the loop"
    )
    INPUT_LOGGED_LATE = (
        "{input!r} seems to be logged late: the model leaves {left:.0%} of the deviation of {output!r}, but only "
        "{ahead:.0%} if {input!r} is moved ahead by {samples} samples. Poles and gain are not the plant's: move the "
        "column"
    )
    TWO_STAGES = (
        "only the part of input {input!r} that {reference} explains is used, {share:.0%} of its power: the rest may be "
        "noise fed back by a closed loop"
    )
    VELOCITY_DIFFERENTIATED = (
        "channel 'velocity_m_s' is absent: it was computed from 'position_m' by central differences, which amplify "
        "noise"
    )
    INPUT_BRIDGED = "input {channel!r} lacks {count} of {total} samples: they were interpolated linearly"
    LOG_INTERPOLATED = (
        "the log was interpolated from {sample_time_s:.4g} s to {wanted_s:.4g} s per sample, which turns a held input "
        "into ramps: judge a model by a log of its own sample time, or fit with --resample"
    )
    INPUT_SPLIT = (
        "input {channel!r} lacks {count} of {total} samples that cannot be interpolated: the log was split "
        "there (experiments: {pieces}, each with its own initial state)"
    )
    OUTPUT_ALONE_FILTERED = (
        "only the output is filtered: the poles come out 20 to 30 % off, and the gain does not roll off (errata E15); "
        "filter input and output alike, or neither"
    )
    UNSTABLE = (
        "the identified {structure} model is unstable (a pole of modulus {modulus:.4f}): it can predict one step "
        "ahead, but cannot simulate"
    )
    NEARLY_CANCEL = (
        "the pole {pole} and the zero {zero} nearly cancel ({deviations:.1f} standard deviations apart): intervals "
        "from the covariance are too narrow; use dc_gain_interval, or a lower order"
    )
    TIME_CONSTANT_BEYOND_RECORD = (
        "the steady gain means nothing: the model of order {order} has a time constant of {time_constant_s:.3g} s, "
        "longer than the longest record or the period of its inputs ({duration_s:.3g} s), and no simpler model was "
        "found"
    )
    SLOW_MODELS_PASSED_OVER = (
        "a simpler model was chosen: {count} others had a time constant longer than the record or the period of its "
        "inputs ({duration_s:.3g} s)"
    )
    INTEGRATES = (
        "the steady gain means nothing: {output!r} integrates its input over the whole record, so the model has a pole "
        "close to 1"
    )
    SLOWER_THAN_PERIOD = (
        "the steady gain comes from the start of the record alone: the model of {output!r} has a time constant of "
        "{time_constant_s:.3g} s, and its inputs repeat themselves after {duration_s:.3g} s"
    )
    SIMPLER_MODEL_TAKEN = (
        "the model of order {order} has a pole and a zero that nearly cancel, or a gain that is not determined; a "
        "model of order {taken} does nearly as well on held-back data and was chosen"
    )
    INPUT_BEYOND_RANGE = (
        "input {channel!r} ranges from {least:.4g} to {greatest:.4g}, but the polynomial model was fitted from "
        "{low:.4g} to {high:.4g}: do not rely on it outside that range ({share:.1%} of the samples); a linear model "
        "(--structure output-error) may do better"
    )
    LINEAR_STANDS_IN = (
        "the linear model of {output!r} was simulated, because these inputs do not determine the nonlinear one. The "
        "nonlinear one is uncertain by {undetermined:.0%} of the output's deviation in the fitted logs; the linear one "
        "errs by {linear:.0%}. Fit a log with inputs like these, or see the nonlinear run with --structure {structure}"
    )
    ERROR_MODELLED = (
        "part of the error of the {structure} model of {output!r} can be predicted by a polynomial of its free run and "
        "the inputs, now and up to {earlier:.3g} s earlier: {left:.0%} of the error on held-back data is left. "
        "Simulations include this polynomial; transfer function, poles and gain do not"
    )
    ERROR_MODEL_LEFT_OUT = (
        "the polynomial that predicts the error of the {structure} model of {output!r} was left out, because these "
        "inputs do not determine it: fit a log with inputs like these too"
    )
    VALIDATED_WORSE = (
        "the model leaves {left:.0%} of the deviation of {output!r} in {logs}, but {held_back:.0%} in blocks of the "
        "fitted logs that were held back. The logs differ in drive, operating point or plant: do not rely on the model "
        "in such logs, or fit logs of both kinds together"
    )
    NO_NONLINEARITY = (
        "neither dead zone nor saturation nor backlash at the input predicts {output!r} better on held-back data: the "
        "linear model was chosen"
    )
    SIGN_NOT_MEASURED = (
        "{output!r} seems to be measured without its sign: the model is linear in the signed output. On held-back data "
        "its absolute value has {left:.0%} of the error of a linear model of the column itself. Log the sign to learn "
        "poles and gain too"
    )
    OUTPUT_CUT_OFF = (
        "{output!r} seems to be cut off at {limits} ({share:.0%} of the samples): the transfer function is that of the "
        "plant ahead of the limit; simulated outputs are limited too"
    )
    OUTPUT_AT_END = (
        "{output!r} stands at {limits} ({share:.0%} of the samples), and the log does not tell whether it is cut off "
        "there: if so, the gain may be too low; check the sensor's range, or fit a log that stays within it"
    )
    OUTPUT_STOPPED = (
        "{output!r} seems to be held by stops at {limits} ({share:.0%} of the samples): the transfer function is that "
        "of the plant between its stops; simulated outputs are limited too"
    )
    UNRELATED = (
        "the inputs explain {output!r} no better than the same inputs in a shuffled order: the output drifts by itself,"
        " and a slow model imitates the drift; do not rely on the model"
    )
    RANDOM_WALK = (
        "{output!r} wanders by itself (random walk or drift, {rmse:.3g} root mean square): the model was fitted to "
        "changes from sample to sample; its offset and the fit of its free run do not hold for other logs"
    )
    WALK_FOLLOWED = (
        "{output!r} wanders by itself (random walk or drift), and {structure} follows this with its poles: do not rely "
        "on poles and gain; for a linear plant use --structure output-error, which is then fitted to changes"
    )
    OFFSETS_DIFFER = (
        "the offset of {output!r} differs from log to log ({above} from their mean): each log was fitted with its own, "
        "and the model keeps their mean, so its level does not hold for other logs"
    )
    TREND = (
        "{output!r} drifts by {slope:.3g} per second, which the inputs do not explain: this trend was fitted too, but "
        "is not part of the model"
    )
    OUTLIERS = (
        "{count} of {total} samples of {output!r} stand out from their neighbours and decide what is fitted: if the "
        "sensor is at fault there, leave their cells empty and identify again"
    )
    DROPS_OUT = (
        "{output!r} leaves its course for exactly {value:.4g} and returns ({count} of {total} samples), and the model "
        "does not follow: if samples were lost there, gain and level are wrong by their share; leave their cells empty "
        "and identify again"
    )
    INPUTS_ALIKE = (
        "input {channel!r} is a linear function of {others}, so how the gain is shared between them means nothing: "
        "leave one out, or log inputs that differ"
    )
    MORE_THAN_NOISE = (
        "the model leaves {left:.0%} of the deviation of {output!r}. Most of this is not white noise, and it follows "
        "the inputs: the plant may be nonlinear, or something else that follows the inputs drives it (less likely: "
        "filtered or held sensor noise). Poles and gain may be those of an approximation; --structure auto tries "
        "nonlinear models"
    )
    NOISE_ASSUMED = (
        "{structure} and output-error give models of {output!r} that differ by more than their uncertainty (p = "
        "{p_value:.1g}): poles and gain of one of them are biased. In open loop it is {structure}, as what it assumes "
        "of the noise does not hold: use output-error. In a closed loop it is output-error. If the order is too low, "
        "it is both"
    )
    MODEL_TOO_SMALL = (
        "the model leaves {left:.0%} of the deviation of {output!r}, and a linear filter of the inputs explains "
        "{explained:.0%} of the variance of that: the model is too small, and its poles and gain are less certain than "
        "their intervals say. Give a higher --order. A sweep drives each frequency only once: a drive that has all "
        "frequencies throughout shows better which order is needed"
    )
    HIGHEST_ORDER_TAKEN = (
        "order {order}, the highest that was compared, leaves {less:.0%} less of {output!r} on blocks held back than "
        "lower ones: a higher order may leave less still, so try --order {more}"
    )
    ANSWERS_LATE = (
        "{output!r} seems to answer {input!r} after {dead_time_s:.4g} s, more than a fifth of the log, which is too "
        "long to be judged (a model with this delay leaves {left:.0%} of the error): try --delay {samples}, or a "
        "longer log"
    )
    NOTHING_ANSWERED = (
        "there is no fit: {logs} has at most {longest} samples in one piece, and the model of {output!r} has a dead "
        "time of {dead_time} samples, so every output answers inputs from before the log"
    )
    NO_FIT = "the model of {output!r} explains no more of it than chance would (fit {fit:.1f} %): do not rely on it"


GAIN_MEANS_NOTHING = frozenset(
    {
        IdentificationCode.INTEGRATES,
        IdentificationCode.TIME_CONSTANT_BEYOND_RECORD,
        IdentificationCode.SLOWER_THAN_PERIOD,
    }
)
"""Notes by which a steady gain must not be used."""

CLOSED_LOOP = frozenset(
    {IdentificationCode.FEEDBACK, IdentificationCode.FEEDBACK_AT_ONCE, IdentificationCode.REGULATED}
)
"""Notes by which a controller answers the output's noise."""

UNRELIABLE = frozenset({IdentificationCode.SWAPPED, IdentificationCode.WALK_FOLLOWED, IdentificationCode.ANSWERS_LATE})
"""Notes by which a model is not to be relied on, whatever else is told of it."""

RAISED_AS_WARNINGS = (
    IdentificationCode.TIME_CONSTANT_BEYOND_RECORD,
    IdentificationCode.NO_FIT,
    IdentificationCode.UNRELATED,
    IdentificationCode.INTEGRATES,
    IdentificationCode.SLOWER_THAN_PERIOD,
    IdentificationCode.SIGN_NOT_MEASURED,
    IdentificationCode.OUTPUT_CUT_OFF,
    IdentificationCode.OUTPUT_STOPPED,
    IdentificationCode.OUTPUT_AT_END,
    IdentificationCode.FEEDBACK,
    IdentificationCode.FEEDBACK_AT_ONCE,
    IdentificationCode.REGULATED,
    IdentificationCode.NOISE_ASSUMED,
    IdentificationCode.SWAPPED,
    IdentificationCode.INPUT_LOGGED_LATE,
    IdentificationCode.INPUTS_ALIKE,
    IdentificationCode.OUTLIERS,
    IdentificationCode.DROPS_OUT,
    IdentificationCode.RANDOM_WALK,
    IdentificationCode.WALK_FOLLOWED,
    IdentificationCode.OFFSETS_DIFFER,
    IdentificationCode.TREND,
    IdentificationCode.ANSWERS_LATE,
)
"""Notes that are raised as warnings too; the others say only what was passed over."""
