"""`balance_fits(log, ...)`: fits of the flow form, balanced by volume, by mass, and by volume in held chambers."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.arrays import IntArray
from estimation.fits.flow.accumulator import first_stiffness
from estimation.fits.flow.log import DRAIN_START, OPENING_START, STIFFEST_OIL
from estimation.fits.flow.other_minimum import FINISHING, Found, completed_form, from_minimum, lower_end
from estimation.fits.flow.rough_search import RIVAL_COST, UNLIKELY, RoughOptimum, rough_optima
from estimation.fits.flow.swept import with_first_fit
from estimation.fits.flow.wide_valves import opens_wide
from estimation.fits.greybox.chance import largest_chi_square
from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.drive_noise import effect_of_drive_noise
from estimation.fits.greybox.fit import Asked, GreyBoxFit, explains_log, fit_at_solution
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.spared_steps import steps_where_needed, with_steps
from estimation.fits.hypothesis_search.fault_guesses import (
    FAULTS_TRIED,
    faulty_coefficient,
    flow_bias_guess,
    leakage_guess,
)
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import HELD_FLOW_FORM, STIFFNESS
from estimation.models.inner_circuit import BEND
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.spare_processors import map_cases

MAKEUP_TRIED = (1e-9, 1e-13)
"""Make-up conductances of the starts [m^3/(s Pa)]: a circuit with make-up valves, and one without."""

LEAD_START = 1e-5
"""First guess of the motor's lead on the straight line between samples [s]."""

ONE_SIDED = 0.5
"""Mean differential pressure over its root mean square, from which a second minimum of the drain is looked for
[fraction]; judged. In 12 logs under a constant load it is 0.62 to 1, in 48 without one at most 0.4."""

LESS_DRAINED, APART = 0.05, 0.5
"""Drain at which the search for a second minimum begins, over the first, and how far apart the logarithms of two drains
must be [fraction, dimensionless]; judged. From a minimum with 14 times the drain, the right one was found in this way.
A drain that the log determines less well than that has one flat minimum: in seven such logs the deviation was 1, as
presumed, in five under a constant load at most 0.14."""

RELIEF_RISE = 0.05
"""Least pressure rise above its setting at which a relief valve passes the rated flow where searches begin [fraction]:
valves need 0.05 to 0.2. The default slope would be a corner of 0.0004 in small rigs."""

NEAR = 0.2
"""Change of a balance's residuals up to which the last short step of a search is computed from slopes and not run
[dimensionless], see `FreedProblem`: 0.02 in log-likelihood."""

COMPLETED, TOO_FAR = 10.0, 150.0
"""Gain of short model steps and cracking valves up to which they hardly matter, and distance from a balance that leaves
only noise, from which another balance is dropped [log-likelihood]. In one of 100 logs such a balance gained 180, and
the likeliest gained 43. If the likeliest gained less than 10, others gained at most 86."""

VALVES = ("makeup_conductance", "makeup_opening", *CRACKS, BEND, STIFFNESS)
"""Parameters that all balances share to the last digits; oil and losses compensate for the differences of the
balances."""

NO_SLOPES = np.zeros(0), np.zeros((0, 0))
"""Gradient and Hessian of a point of which only the cost is known."""

NO_VALUES: Mapping[str, float] = {}
"""Values of a search that no other leads."""

SETTLING = 15
"""Evaluations with short model steps of a form that does not explain its log, before hypotheses are tested [count]."""

CLOSE_COST = 0.75
"""Cost per residual (0.5 for noise alone) below which such a search continues to its end [dimensionless]; judged. The
search for a single rod was stopped at 0.65 on its way to 0.47, and passed its gate there."""


def flow_starts(p: EhaParameters, bulk_modulus: float) -> list[dict[str, float]]:
    """Return the starts of searches for the flow form's unknowns.

    Parameters
    ----------
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].

    Returns
    -------
    list of dict
        Values of the unknowns [SI]; the healthy actuator at the first guess of bulk modulus comes first.
    """
    leakage, bias = leakage_guess(p), flow_bias_guess(p)
    moduli = sorted({bulk_modulus, p.bulk_modulus})
    return [
        {
            "bulk_modulus": modulus,
            "leakage_coefficient": faulty_coefficient(p, "leakage_coefficient", leakage, leaking),
            "flow_bias": faulty_coefficient(p, "flow_bias", bias, biased),
            "makeup_conductance": makeup,
            "makeup_opening": OPENING_START,
            "case_leakage": DRAIN_START * leakage,
            "speed_lead": LEAD_START,
            "relief_pressure": p.relief_pressure,
            "relief_conductance": min(p.relief_conductance, p.rated_flow / (RELIEF_RISE * p.relief_pressure)),
        }
        for leaking, biased in FAULTS_TRIED
        for makeup in MAKEUP_TRIED
        for modulus in moduli
    ]


def balance_fits(
    log: GreyBoxLog,
    parameters: EhaParameters,
    starts: Sequence[Mapping[str, float]],
    valley: Mapping[str, float] | None = None,
    stiffest: float = STIFFEST_OIL,
) -> Sequence[GreyBoxFit]:
    """Return the fits of the balances that count.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    starts : sequence of Mapping[str, float]
        Where searches begin, see `flow_starts` [SI].
    valley : Mapping[str, float], optional
        A place near a lower minimum, see `lower_minimum`, at which searches with short model steps begin as well [SI].
    stiffest : float
        Largest bulk modulus for which the effect of motor speed noise is computed [Pa].

    Returns
    -------
    sequence of GreyBoxFit
        At least one has varying volumes. Rig slopes and lateness are determined for the likeliest fit, and for the
        likeliest with varying volumes.
    """
    rough = rough_optima(log, parameters, starts)
    least = min(one.point.cost for one in rough)
    near = min((one for one in rough if not _holds_volumes(one.problem)), key=lambda one: one.point.cost)
    likely = [one for one in rough if one is near or one.point.cost < least + RIVAL_COST]
    behind = [one for one in rough if not (_holds_volumes(one.problem) or one in likely)]
    bent = opens_wide(log, parameters)
    log = with_first_fit(log, parameters, near.values, stiffest)
    first = rough[0] if rough[0] in likely else near  # its kernel has fewer runs side by side
    steps = steps_where_needed(first.problem.on(log), first.point.theta)
    # the balance by mass leads, since it has had an accumulator from the start
    leader = min(likely, key=lambda one: STIFFNESS not in one.problem.model.unknowns)
    lead = _final_optimum(leader, log, steps, bent=bent)
    valves = _valve_values(lead)
    done = map_cases(
        lambda one: lead if one is leader else _final_optimum(one, log, steps, led=valves, bent=bent), likely
    )
    best, here = min(done, key=_cost), log.stepped(steps)
    if not explains_log(best[0], best[1]):
        led = (lower_end((one.problem.on(here), one.point, one.bounds), best, starts[0]) for one in behind)
        behind = [replace(one, point=point) for one, point in zip(behind, led, strict=True)]
    elif least - best[1].cost < COMPLETED and _is_noise(best):
        behind = [one for one in behind if one.point.cost < best[1].cost + TOO_FAR]
    done += map_cases(lambda one: _final_optimum(one, log, steps, best[1].cost, bent=bent), behind)
    if valley is not None:
        done = map_cases(lambda one: min(one, from_minimum(one[0].model, log, valley, bent=bent), key=_cost), done)
    if _one_sided(log):
        done = [found for minima in map_cases(_with_less_drain, done) for found in minima]
    return _reported_fits(done, log, steps)


def refitted_balances(
    log: GreyBoxLog, parameters: EhaParameters, fits: Sequence[GreyBoxFit], stiffest: float = STIFFEST_OIL
) -> Sequence[GreyBoxFit]:
    """Return the fits of a log that differs little from one already fitted, started from those fits.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    fits : sequence of GreyBoxFit
        The fits of the other log, as from `balance_fits`.
    stiffest : float
        Largest bulk modulus for which the effect of motor speed noise is computed [Pa].
    """
    near = likeliest_swinging(fits)
    log = with_first_fit(log, parameters, near.values, stiffest)
    steps = log.steps if near.steps is None else near.steps
    bent = opens_wide(log, parameters)

    def led(fit: GreyBoxFit) -> Found:
        ended, bounds = Point(fit.theta, fit.cost, *NO_SLOPES), flow_bounds(fit.model, [fit.theta], log)
        return _final_optimum(RoughOptimum(FreedProblem.of(fit.model, log), ended, bounds), log, steps, bent=bent)

    return _reported_fits(map_cases(led, fits), log, steps)


def likeliest_swinging(fits: Sequence[GreyBoxFit]) -> GreyBoxFit:
    """Return the likeliest of the fits with varying volumes."""
    return min((fit for fit in fits if fit.model.rates is not HELD_FLOW_FORM.rates), key=lambda fit: fit.cost)


def _reported_fits(done: Sequence[Found], log: GreyBoxLog, steps: IntArray) -> Sequence[GreyBoxFit]:
    """Return the fits at the minima of the balances; those that are reported have short model steps throughout."""
    done = _ended_where_reported(done, log)
    best, swinging = _reported_minima(done)
    least = best[1].cost

    counting = [one for one in done if one[1].cost < least + UNLIKELY]
    shaken = _effect_of_drive_noise(best) if len(counting) > 1 else None

    def told(one: Found) -> GreyBoxFit:
        problem, point, bounds = one
        asked = Asked(disturbed=one in counting, beside=one is best or one is swinging)
        return fit_at_solution(problem, point, least=bounds[0], asked=asked, steps=steps, moved_by_noise=shaken)

    return map_cases(told, done)


def _is_noise(one: Found) -> bool:
    """Return whether the residuals at a minimum are no larger than noise by chance."""
    problem, point, _ = one
    return 2.0 * point.cost < largest_chi_square(problem.blocks, 1.0) * problem.blocks


def _effect_of_drive_noise(one: Found) -> Array | None:
    """Return the effect of drive noise on the residuals of the likeliest balance, which the others share."""
    log = one[0].log
    noisy = any(spread > 0.0 for spread in log.drive_std) and not log.passes_on
    return effect_of_drive_noise(one[0], one[1].theta) if noisy else None


def _final_optimum(
    one: RoughOptimum,
    log: GreyBoxLog,
    steps: IntArray,
    wanted: float = np.inf,
    *,
    led: Mapping[str, float] = NO_VALUES,
    bent: bool,
) -> Found:
    """Return the optimum with short model steps (``steps``); a form that explains its log is completed as well.

    A search that will not reach the cost ``wanted`` ends early. A completed form begins with the valves and the
    accumulator of another fit (``led``), since the search for these takes longest. Make-up valves that must pass much
    flow are orifices (``bent``).
    """
    one = replace(one, problem=one.problem.on(log.stepped(steps)))
    if not _explains_to_last_digits(one):
        settled = descend(one.problem.at, one.point.theta, SETTLING, one.bounds, wanted=wanted)
        if settled.cost < CLOSE_COST * one.problem.blocks:
            settled = descend(one.problem.at, settled.theta, FINISHING, one.bounds, wanted=wanted)
        one = replace(one, point=settled)
        if not _explains_to_last_digits(one):
            return one.problem, one.point, one.bounds
    problem, theta, bounds = _completed_problem(one, log, led, bent=bent)
    problem.near = NEAR if steps is not log.steps else 0.0
    return problem, descend(problem.at, theta, FINISHING, bounds, wanted=wanted), bounds


def _ended_where_reported(done: Sequence[Found], log: GreyBoxLog) -> list[Found]:
    """Return minima; those that are reported have short model steps throughout."""
    done = list(done)
    while sparing := [one for one in _reported_minima(done) if one[0].log.steps is not log.steps]:
        done = map_cases(lambda one, ending=sparing: _end_with_short_steps(one, log) if one in ending else one, done)
    return done


def _end_with_short_steps(one: Found, log: GreyBoxLog) -> Found:
    """Return the end of a search whose last steps have short model steps throughout."""
    problem, point, bounds = one
    ending = with_steps(problem, log.steps)
    evaluations = FINISHING if explains_log(problem, point) else 1
    return ending, descend(ending.at, point.theta, evaluations, bounds), bounds


def _valve_values(lead: Found) -> Mapping[str, float]:
    """Return valves and accumulator of a form that explains its log [SI]; nothing otherwise."""
    if _holds_volumes(lead[0]) or not explains_log(lead[0], lead[1]):
        return NO_VALUES
    values = lead[0].model.values(lead[1].theta)
    return {name: values[name] for name in VALVES if name in values}


def _one_sided(log: GreyBoxLog) -> bool:
    """Return whether one side of the piston holds a load nearly all the time."""
    pressure = log.measured[np.isfinite(log.measured[:, 0]), 0]
    return bool(abs(float(np.mean(pressure))) > ONE_SIDED * float(np.mean(pressure**2)) ** 0.5)


def _with_less_drain(one: Found) -> list[Found]:
    """Return a minimum, and a second one with less drain if it exists and is likely enough.

    Under a load the low side is shut in. Its drain shows almost only in the time at which its make-up valve opens, and
    the likelihood has a minimum for each hold in which that may be: one was 11 deviations of leakage off.
    """
    problem, point, bounds = one
    place = problem.model.unknowns.index("case_leakage")  # fitted as a logarithm
    along = (np.arange(len(point.theta)) == place).astype(float)
    variance = np.linalg.lstsq(point.gram, along)[0][place]
    if CRACKS[0] not in problem.model.unknowns or variance > APART**2:
        return [one]
    start = point.theta + np.log(LESS_DRAINED) * along
    other = descend(problem.at, np.clip(start, *bounds), FINISHING, bounds, wanted=point.cost + UNLIKELY)
    apart = abs(other.theta[place] - point.theta[place]) > APART
    return [one, (problem, other, bounds)] if apart and other.cost < point.cost + UNLIKELY else [one]


def _reported_minima(done: Sequence[Found]) -> tuple[Found, Found]:
    """Return the likeliest minimum, and the likeliest with varying volumes."""
    return min(done, key=_cost), min((one for one in done if not _holds_volumes(one[0])), key=_cost)


def _cost(one: Found) -> float:
    return one[1].cost


def _holds_volumes(problem: Problem) -> bool:
    return problem.model.rates is HELD_FLOW_FORM.rates


def _explains_to_last_digits(one: RoughOptimum) -> bool:
    """Return whether a form explains a log so well that the last digits matter.

    Otherwise cracking valves would absorb and hide another effect: an encoder homed at the end stop, or a worn pump.
    Held chambers belong to the lumped plant, which has no such valves.
    """
    return not _holds_volumes(one.problem) and explains_log(one.problem, one.point)


def _completed_problem(
    one: RoughOptimum, log: GreyBoxLog, led: Mapping[str, float], *, bent: bool
) -> tuple[FreedProblem, Array, tuple[Array, Array]]:
    """Return the problem with parameters that matter to the last digits only, where its search starts, and bounds."""
    problem = FreedProblem.of(completed_form(one.problem.model, bent=bent), one.problem.log)
    known, fresh = len(one.point.theta), {STIFFNESS: first_stiffness(log), BEND: 0.0, **dict.fromkeys(CRACKS, 0.0)}
    begun = problem.model.theta({**fresh, **one.values, **led})
    theta = np.append(one.point.theta, begun[known:])
    lowest, highest = flow_bounds(problem.model, [theta], log)
    lowest[:known], highest[:known] = one.bounds
    return problem, np.clip(begun, lowest, highest) if led else theta, (lowest, highest)
