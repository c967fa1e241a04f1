"""Notes of a fit of a user's own equations."""

from plant.notes import Code


class EquationsCode(Code):
    """Notes on a fit of your own equations: objections to it, and what the logs do not determine."""

    EQUATIONS_EXPLAIN_NOTHING = (
        "the equations predict {channel} no better than its mean does (fit {fit:.1f} %): check units, signs and start "
        "values"
    )
    MISFIT_BEYOND_NOISE = (
        "the residuals of {channel} are {ratio:.2f} times its noise: the equations leave out something that the log "
        "contains"
    )
    MISFIT_CORRELATED = (
        "successive residuals of {channel} have a correlation of {correlation:.2f}: the sensor noise is not white, or "
        "the equations leave something out"
    )
    MISFIT_FOLLOWS_INPUT = (
        "the past of {source} explains {percent:.2g} % of the residuals of {channel}: the equations leave out part of "
        "how {source} acts on {channel}"
    )
    PARAMETER_AT_BOUND = (
        "{parameter} ended at its bound {bound:g}: widen the bound, or the equations do not describe the log"
    )
    STEPS_TOO_LONG = (
        "halving the integration steps moves the solution by {deviations:.2g} standard deviations, and steps shorter "
        "than 1/{steps} of a sample were not tried: log faster, or make the equations less stiff"
    )
    NOT_CONVERGED = "the search stopped after {evaluations} evaluations before it settled: give better start values"
    LIMIT_UNEXPLAINED = (
        "{channel} stays at its {end} value {value:.6g} in {percent:.2g} % of its samples, and the equations miss it "
        "there by {ratio:.3g} times the noise: they leave out an end stop or a clipped sensor"
    )
    OUTPUT_AT_LIMIT = (
        "{channel} stays at its {end} value {value:.6g} in {percent:.2g} % of its samples, and the equations reproduce "
        "this"
    )
    INPUT_AT_LIMIT = (
        "{channel} stays at its {end} value {value:.6g} in {percent:.2g} % of its samples: if it is a command, the "
        "actuator may get less than was commanded"
    )
    PARAMETERS_NOT_TOLD = "the logs cannot separate {names}: fix one of them, or use a drive that tells them apart"
    PARAMETER_NOT_FELT = "the logs do not determine {name}: no output depends on it"
    PARAMETER_POORLY_TOLD = (
        "{name} is known only to ± {percent:.0f} %; its error is correlated most with that of {other} (correlation "
        "{correlation:.3f})"
    )
    STARTS_DISAGREE = (
        "another set of values explains the logs equally well ({parameter} = {value:.4g}): narrow the bounds if you can"
    )
    SAMPLES_MISSING = "{count} of {total} samples of {channel} are missing and were not used"
