"""`fit_motion(record, parameters, ...) -> FormFit`: bulk modulus, leakage and friction of a log without pressure."""

from collections.abc import Mapping

import numpy as np

from estimation.fits.flow.log import DRAIN_START
from estimation.fits.flow.search import LEAD_START
from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.fit import GreyBoxFit, fit_at_solution
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.fault_guesses import (
    FAULTS_TRIED,
    faulty_coefficient,
    flow_bias_guess,
    leakage_guess,
)
from estimation.fits.hypothesis_search.form_fit import FormFit, likelihood_mean, with_structure
from estimation.fits.motion.chatter import without_chatter
from estimation.fits.motion.force_scale import Way, bulk_modulus, disagree, is_short, optimum_on_other_scales
from estimation.fits.motion.log import motion_log
from estimation.fits.motion.noise_annealing import RETURNING
from estimation.fits.motion.search import (
    ENOUGH,
    EXPLAINED,
    FINISHING,
    HOPELESS,
    NEAR_ENOUGH,
    NEARING,
    SLIGHT_SHARE,
    WAYS,
    MotionSearch,
    SearchResult,
    explained_cost,
    rough_problem,
    search_results,
)
from estimation.fits.motion.weakly_held import LARGEST_UNSEEN_SHIFT, is_far_too_weak, unseen_shift
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.motion import MOTION_FORMS
from estimation.notes import EstimateCode
from estimation.trust.consistency import MISMATCH_NIS
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record
from plant.notes import Note

MOTION_CHANNELS = ("position_m",)
"""Channels that the motion form needs beside motor speed."""

FRICTION_TRIED = ((1.0, 1.0, 1.0), (18.0, -3.5, 1.15), (68.0, 8.7, 1.25))
"""Friction coefficients a_1, a_2, a_3 of the starts, as multiples of the healthy paper rig's: the spread of Table 4."""

YIELD_START = 2e-5
"""First guess of the deflection at which seals slide [m]; the literature on presliding has tens of micrometres."""

DAMPING_START = 100.0
"""First guess of the bristle's damping [N s/m]; small beside the oil's."""

STRUCTURE = 0.005
"""Relative standard deviation of bulk modulus due to the unknown friction law. On the foreign bench, whose presliding
law is another one, noise alone explains a tenth to a half of the errors. Judged from that one bench [fraction]."""

UNLIKELY = 72.0
"""Difference of log-likelihood from which a structure has no weight beside the other [dimensionless]."""

SPARED_NIS, SPARED_SHARE = 0.5 * MISMATCH_NIS, 0.03
"""Mean squared normalised residual, and share of the motion, up to which the residuals of a log rule out no class
[dimensionless, fraction]: half of the limit."""

BEGINNING_SHARE = 0.2
"""Share of these that holds for the beginning of a log [fraction]: the rest may fit less well."""

NEARLY_EXPLAINED = 1.1
"""Cost on a beginning over that of an explained one, up to which other scales of forces are still searched
[dimensionless]: a local minimum near that of an explained log, some percent away in bulk modulus."""

EQUAL_DIFFERENCE = 5.0
"""Difference of log-likelihood up to which two structures explain a log equally well [dimensionless]."""


def fit_motion(
    record: Record,
    parameters: EhaParameters,
    bulk_modulus: float,
    uncertainties: Mapping[str, float] | None = None,
    variances: Mapping[str, float] | None = None,
) -> FormFit:
    """Fit the motion form to a log with either structure of friction, and weight the two.

    Parameters
    ----------
    record : Record
        The log, with position; it begins at rest.
    parameters : EhaParameters
        Geometry, pump and mass are taken from it; leakage, flow bias and friction are first guesses.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the actuator's parameters [fraction]; none by default.
    variances : Mapping[str, float], optional
        Measurement variance of motor speed [rad^2/s^2] by its name; determined from the log if not given.

    Returns
    -------
    FormFit
        Value, deviations, and objections.

    Raises
    ------
    LogError
        If position is missing.
    """
    if "position_m" not in record:
        raise LogError("the motion form needs position_m; the log has no position_m")
    noise = (variances or measurement_variances(record, ("motor_speed_rad_s",)))["motor_speed_rad_s"]
    log = motion_log(record, parameters, uncertainties or {}, noise)
    starts = _starts(parameters, max(bulk_modulus, 1e-2 * parameters.bulk_modulus))
    ended = search_results([MotionSearch.of(form, log, starts) for form in MOTION_FORMS])
    found, spared = _result_of_searches(ended, log, sparing=True)
    if spared and not found.reasons:  # bulk modulus is determined after all, so other scales are searched too
        found, _ = _result_of_searches(ended, log, sparing=False)
    return found


def _result_of_searches(ended: list[SearchResult], log: GreyBoxLog, *, sparing: bool) -> tuple[FormFit, bool]:
    """Return the result of a log's finished searches, and whether that on other scales was skipped."""
    fits, others, spared = _fitted(ended, sparing=sparing)
    best = min(fits, key=lambda fit: fit.cost)
    found = likelihood_mean(fits)
    value, std = found["bulk_modulus"]
    apart = max((abs(float(np.log(other / value))) for other in others), default=0.0)
    bound = float(np.hypot(std / value, apart))
    moved = unseen_shift(best.chi_square[0], len(log.measured)) * std / value
    believed = with_structure(found, float(np.linalg.norm([STRUCTURE, apart, moved])))
    reasons = _objections(fits, best, others, share_of_motion(best.chi_square[0], log))
    if not reasons and not np.isfinite(moved):
        reasons = (EstimateCode.NOT_HELD.note(),)
    elif not reasons and moved > LARGEST_UNSEEN_SHIFT:
        reasons = (EstimateCode.WEAKLY_HELD.note(percent=100.0 * moved, noise_percent=100.0 * std / value),)
    return FormFit(believed, bound, best.chi_square[0], reasons, best.rig_slopes), spared


def share_of_motion(chi_square: float, log: GreyBoxLog) -> float:
    """Return the size of the residuals over that of the motion, within the time after which drift hides a residual.

    Noise of measured speed is a random walk of position: what is older than ``sqrt(variance / walk)`` is forgotten. The
    ratio of residuals to encoder noise would measure how fine the encoder is, not how wrong the model.

    Parameters
    ----------
    chi_square : float
        Mean squared normalised residual of a fit [dimensionless].

    Returns
    -------
    float
        Root mean square over that of the motion [fraction]; infinite if nothing moves.
    """
    (noise,), position = log.noise, log.measured[:, 0]
    kept = np.sqrt(noise.variance / max(noise.walk * log.sample_time, np.finfo(float).tiny))
    samples = int(np.clip(kept, 1, len(position) // 2))
    steps = position[samples:] - position[:-samples]
    moved = float(np.sqrt(np.nanmean(steps**2))) if np.any(np.isfinite(steps)) else 0.0
    return float(np.sqrt(chi_square * noise.variance)) / moved if moved > 0.0 else float("inf")


def _starts(p: EhaParameters, bulk_modulus: float) -> list[dict[str, float]]:
    healthy = EhaParameters()
    leakage, bias = leakage_guess(p), flow_bias_guess(p)
    quadratic = p.friction_quadratic or healthy.friction_quadratic
    coulomb = p.friction_coulomb or healthy.friction_coulomb
    return [
        {
            "bulk_modulus": bulk_modulus,
            "leakage_coefficient": faulty_coefficient(p, "leakage_coefficient", leakage, leaking),
            "flow_bias": faulty_coefficient(p, "flow_bias", bias, biased),
            "makeup_conductance": p.makeup_conductance or healthy.makeup_conductance,
            "case_leakage": DRAIN_START * leakage,
            "speed_lead": LEAD_START,
            "friction_quadratic": faulty_coefficient(p, "friction_quadratic", quadratic, a1),
            "friction_linear": faulty_coefficient(p, "friction_linear", p.friction_linear, a2),
            "friction_coulomb": faulty_coefficient(p, "friction_coulomb", coulomb, a3),
            "bristle_stiffness": faulty_coefficient(p, "friction_coulomb", coulomb, a3) / YIELD_START,
            "bristle_damping": DAMPING_START,
        }
        for leaking, biased in FAULTS_TRIED
        for a1, a2, a3 in FRICTION_TRIED
    ]


def _fitted(ended: list[SearchResult], *, sparing: bool = False) -> tuple[list[GreyBoxFit], list[float], bool]:
    """Return the fits of both structures to the whole log, other bulk moduli that explain it, and what was skipped.

    Other scales are searched if the final fit explains the log, even if no earlier search did. They may be skipped if
    the log determines bulk modulus far too weakly; that is judged again at the end.
    """
    first, second = sorted(ended, key=lambda one: (not one.explains, one.point.cost))
    search, best, reached, others = first.search, first.point, first.point, list[float]()
    part, whole, bounds = search.part, search.whole, search.bounds
    if not first.explains:
        wanted = _wanted_cost(part, best, BEGINNING_SHARE)
        best = reached = descend(part.at, best.theta, FINISHING, bounds, wanted=wanted, least_share=SLIGHT_SHARE)
    asked = best.cost < explained_cost(part)
    spared = sparing and asked and is_far_too_weak(part, best, whole)
    if spared:
        others = [bulk_modulus(part, best)]
    elif best.cost < NEARLY_EXPLAINED * explained_cost(part):
        best, others = _rescaled(part, best, search)
        asked = best.cost < explained_cost(part)
    hopeful = asked and not disagree([bulk_modulus(part, best), *others])
    if hopeful:
        best = descend(whole.at, best.theta, FINISHING, bounds)
    elif first.explains or best is not reached or len(part.log.measured) < len(whole.log.measured):
        wanted = _wanted_cost(whole, best)
        best = descend(whole.at, best.theta, FINISHING, bounds, wanted=wanted, least_share=SLIGHT_SHARE)
    if not asked and best.cost < explained_cost(whole):
        best, others = _rescaled(whole, best, search)
    told = _is_determined(whole, best, others)
    if told and not hopeful:
        best = descend(whole.at, best.theta, FINISHING, bounds)
    if told and not spared and (finer := without_chatter(whole, best.theta)) is not whole:
        whole, best = finer, descend(finer.at, best.theta, RETURNING, bounds)
        told = _is_determined(whole, best, others)
    return [fit_at_solution(whole, best), *_rival_fits(second, whole, best, told=told)], others, spared


def _is_determined(problem: FreedProblem, best: Point, others: list[float]) -> bool:
    """Return whether a point explains a log, and no other bulk modulus does [Pa]."""
    return best.cost < explained_cost(problem) and not disagree([bulk_modulus(problem, best), *others])


def _wanted_cost(problem: FreedProblem, begun: Point, share: float = 1.0) -> float:
    """Return the cost that a search from a point must reach to be worth while.

    If the point's residuals are so small that they rule out no class, only an explanation of the log would matter.
    Otherwise, and in short logs, any improvement counts.
    """
    samples = len(problem.log.measured)
    chi_square = 2.0 * problem.at(begun.theta).cost / samples  # the search begins here and reuses this run
    spared = chi_square < share * SPARED_NIS or share_of_motion(chi_square, problem.log) < share * SPARED_SHARE
    return explained_cost(problem) if spared and not is_short(problem.log) else np.inf


def _rival_fits(second: SearchResult, whole: FreedProblem, best: Point, *, told: bool) -> list[GreyBoxFit]:
    """Return the fit of the other structure of friction to the whole log; None if it cannot matter."""
    own = second.search.whole
    whole = own if whole.log is own.log else own.on(whole.log)  # the same model steps, so that costs are comparable
    bounds, thetas = second.search.bounds, [best.theta, second.point.theta]
    costs, wanted = whole.costs(thetas), explained_cost(whole)
    begun = thetas[int(np.argmin(costs))]
    if told:
        point = descend(whole.at, begun, NEARING, bounds, wanted=best.cost + UNLIKELY)
    elif best.cost < wanted or float(np.min(costs)) > max(best.cost, HOPELESS * wanted):
        return []
    else:
        point = descend(whole.at, begun, NEARING, bounds, wanted=wanted, least_share=SLIGHT_SHARE)
        if point.cost < wanted:
            point = descend(whole.at, point.theta, FINISHING, bounds)
    return [fit_at_solution(whole, point)]


def _rescaled(problem: FreedProblem, best: Point, search: MotionSearch) -> tuple[Point, list[float]]:
    """Return the best optimum of forces on other scales, and other bulk moduli that explain the log."""
    coarse = rough_problem(problem, WAYS[0][1])
    way = Way(coarse, NEARING, NEAR_ENOUGH, FINISHING, ENOUGH, search.bounds, explained_cost(problem))
    return optimum_on_other_scales(problem, best, way)


def _objections(fits: list[GreyBoxFit], best: GreyBoxFit, others: list[float], share: float) -> tuple[Note, ...]:
    reasons: list[Note] = []
    if best.chi_square[0] > EXPLAINED:
        large = {"ratio": best.chi_square[0] ** 0.5, "motion_percent": 100.0 * share}
        reasons.append(EstimateCode.POSITION_RESIDUALS_LARGE.note(**large))
    values = [fit.values["bulk_modulus"] for fit in fits if fit.cost < best.cost + EQUAL_DIFFERENCE]
    if disagree(values):
        reasons.append(EstimateCode.FRICTION_LAWS_DISAGREE.note(least_pa=min(values), most_pa=max(values)))
    scales = [*others, best.values["bulk_modulus"]]
    if disagree(scales):
        reasons.append(EstimateCode.FORCES_ON_ANY_SCALE.note(least_pa=min(scales), most_pa=max(scales)))
    return tuple(reasons)
