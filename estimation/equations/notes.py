"""What a fit of a user's own equations may bring up."""

from plant.notes import Code


class EquationsCode(Code):
    """Notes on a fit of own equations: what speaks against it, what the logs do not tell, what they hold."""

    EQUATIONS_EXPLAIN_NOTHING = (
        "the equations follow {channel} no better than its mean does (fit {fit:.1f} %): check units, signs and starts"
    )
    MISFIT_BEYOND_NOISE = (
        "the residuals of {channel} are {ratio:.2f} times its noise: the log does something that the equations leave "
        "out"
    )
    MISFIT_CORRELATED = (
        "the residuals of {channel} are correlated by {correlation:.2f} from sample to sample: the sensor's noise is "
        "coloured, or the equations leave something out"
    )
    MISFIT_FOLLOWS_INPUT = (
        "{percent:.2g} % of the residuals of {channel} follow from the past of {source}: the equations leave out how "
        "one acts on the other"
    )
    PARAMETER_AT_BOUND = "{parameter} ended at its bound {bound:g}: widen it, or the equations are not the log's"
    STEPS_TOO_LONG = (
        "the solution moves by {deviations:.2g} of its standard deviations when its steps are halved, and shorter ones "
        "than a sample's {steps}th were not tried: log faster, or write the equations less stiff"
    )
    NOT_CONVERGED = "the search ended after {evaluations} evaluations before it settled: better starts are wanted"
    LIMIT_UNEXPLAINED = (
        "{channel} stands at its {end} value {value:.6g} in {percent:.2g} % of its samples, and the equations miss it "
        "there by {ratio:.3g} times the noise: an end stop or a clipped sensor that they leave out"
    )
    OUTPUT_AT_LIMIT = (
        "{channel} stands at its {end} value {value:.6g} in {percent:.2g} % of its samples, and the equations follow "
        "it there"
    )
    INPUT_AT_LIMIT = (
        "{channel} stands at its {end} value {value:.6g} in {percent:.2g} % of its samples: if it is a command, what "
        "acts may be less than what was asked for"
    )
    PARAMETERS_NOT_TOLD = "the logs do not tell {names} apart: fix one, or excite what distinguishes them"
    PARAMETER_NOT_FELT = "the logs do not tell {name}: no output depends on it"
    PARAMETER_POORLY_TOLD = (
        "{name} is known to +- {percent:.0f} % only; its error goes most with that of {other} (correlation "
        "{correlation:.3f})"
    )
    STARTS_DISAGREE = (
        "another set of values explains the logs as well ({parameter} = {value:.4g}): narrow the bounds if you can"
    )
    SAMPLES_MISSING = "{count} of {total} samples of {channel} are missing, and count for nothing"
