"""`balanced(log, ...)`: fits of the flow form, balanced by volume, by mass, and by volume in held chambers.

The likeliest of many coarse guesses is followed first, for a run without slopes is cheap. Where it leads to a point
that explains the log, nothing else is searched; else searches begin at leakages and flow biases of all conditions.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from estimation.arrays import IntArray
from estimation.fits.flow.guesses import guesses_about
from estimation.fits.flow.log import DRAIN_START, OPENING_START, carried, outruns_pump
from estimation.fits.flow.other_minimum import FINISHING, Found, completed_form, from_minimum, nearest
from estimation.fits.flow.swept import swept_evenly
from estimation.fits.greybox.descent import Point, descend, remembered
from estimation.fits.greybox.driven import driven_samples
from estimation.fits.greybox.fit import NEAR_ENOUGH, GreyBoxFit, Search, concluded, explained, roughly
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.side_by_side import LANES
from estimation.fits.greybox.spared_steps import sparing_steps, with_steps
from estimation.fits.hypothesis_search.decimation import FEW, LONG_STEP, cost_over_noise, decimated
from estimation.fits.hypothesis_search.fault_guesses import (
    FAULTS_TRIED,
    faulty_coefficient,
    flow_bias_guess,
    leakage_guess,
)
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.models.flow import FLOW_FORM, HELD_FLOW_FORM, MASS_FLOW_FORM, STIFFNESS, reaches_relief, relieving
from estimation.models.greybox import GreyBoxModel
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.spare_processors import each

MAKEUP_TRIED = (1e-9, 1e-13)
"""Make-up conductances of the starts [m^3/(s Pa)]: a circuit with make-up valves, and one without."""

LEAD_START = 1e-5
"""First guess of the motor's lead on the straight line between samples [s]."""

GUESSED_WITHIN = 0.3
"""First radius of a search from the likeliest guess [dimensionless]: half the distance between guesses of leakage."""

LED_WITHIN = 1.0
"""First radius of a search on the whole log [dimensionless]: it begins where the log's beginning or another balance
led. Of longer first steps, up to 30, two thirds were taken back, at three to five evaluations each."""

FAR_OFF, SLIGHT = 3.0, 0.02
"""Half the sum of squares over what noise alone makes of it, from which a search first goes down on a decimated log,
and the share of it that a further step must promise there [dimensionless]."""

SCREENED_SECONDS = 4.0
"""Starts are compared on the beginning of the log, at least so long: it tells a wrong valley from a right one [s]."""

ROUGH_ENOUGH = 0.05
"""Half the sum of squares that a further step must promise while model steps are long [dimensionless]: their errors put
the optimum off by more. With 0.3 logs of a sine, whose valleys are flat, took twice as many short steps after."""

SETTLING = 15
"""The same of a form that no more than long steps explain: it is then asked what is strange [count]."""

UNLIKELY = 36.0
"""Difference of log-likelihood from which a form of the balance counts for nothing beside the other [dimensionless]."""

RIVAL = 2.0 * UNLIKELY
"""The same between searches with long model steps, which have errors [dimensionless]."""


@dataclass(frozen=True, eq=False)
class _Rough:
    """Optimum of one balance with long model steps, and the bounds of its search."""

    problem: Problem
    point: Point
    bounds: tuple[Array, Array]

    @property
    def values(self) -> Mapping[str, float]:
        return {STIFFNESS: 0.0, **self.problem.model.values(self.point.theta)}


def flow_starts(p: EhaParameters, bulk_modulus: float) -> list[dict[str, float]]:
    """Return the starts of searches for the flow form's unknowns.

    Parameters
    ----------
    p : EhaParameters
        The actuator.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].

    Returns
    -------
    list of dict
        Values of the unknowns [SI]; those of the healthy actuator at the first guess come first.
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
            "relief_conductance": p.relief_conductance,
        }
        for leaking, biased in FAULTS_TRIED
        for makeup in MAKEUP_TRIED
        for modulus in moduli
    ]


def balanced(
    log: GreyBoxLog,
    parameters: EhaParameters,
    starts: Sequence[Mapping[str, float]],
    valley: Mapping[str, float] | None = None,
    stiffest: float = np.inf,
) -> Sequence[GreyBoxFit]:
    """Return the fits of the balances that count.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    parameters : EhaParameters
        The actuator.
    starts : sequence of Mapping[str, float]
        Where searches begin, see `flow_starts` [SI].
    valley : Mapping[str, float], optional
        A place in a lower valley, see `lower_minimum`, where searches with short model steps begin as well [SI].
    stiffest : float
        Bulk modulus that counts at most in what noise of motor speed leaves [Pa].

    Returns
    -------
    sequence of GreyBoxFit
        One with volumes that swing at least. Rig slopes and lateness are told of the likeliest, and of the likeliest
        with volumes that swing.
    """
    rough = _rough(log, parameters, starts)
    least = min(one.point.cost for one in rough)
    near = min((one for one in rough if not _held(one.problem)), key=lambda one: one.point.cost)
    likely = [one for one in rough if one is near or one.point.cost < least + RIVAL]
    behind = [one for one in rough if not (_held(one.problem) or one in likely)]
    bent = outruns_pump(log, parameters)
    log = swept_evenly(carried(log, parameters, near.values, stiffest), parameters, near.values)
    first = rough[0] if rough[0] in likely else near  # whose kernel has fewer runs side by side
    steps = sparing_steps(first.problem.on(log), first.point.theta)
    done = each(lambda one: _finished(one, log, steps, bent=bent), likely)
    best, here = min(done, key=_cost), log.stepped(steps)
    if not explained(best[0], best[1]):
        led = (nearest((one.problem.on(here), one.point, one.bounds), best, starts[0]) for one in behind)
        behind = [replace(one, point=point) for one, point in zip(behind, led, strict=True)]
    done += each(lambda one: _finished(one, log, steps, best[1].cost, bent=bent), behind)
    if valley is not None:
        done = each(lambda one: min(one, from_minimum(one[0].model, log, valley, bent=bent), key=_cost), done)
    while sparing := [one for one in _told_of(done) if one[0].log.steps is not log.steps]:
        done = each(lambda one, ending=sparing: _ended(one, log) if one in ending else one, done)
    best, swinging = _told_of(done)
    least = best[1].cost

    def told(one: Found) -> GreyBoxFit:
        problem, point, bounds = one
        counts, asked = point.cost < least + UNLIKELY, one is best or one is swinging
        return concluded(problem, point, least=bounds[0], disturbed=counts, asked=asked, steps=steps)

    return each(told, done)


def _finished(one: _Rough, log: GreyBoxLog, steps: IntArray, wanted: float = np.inf, *, bent: bool) -> Found:
    """Return the optimum with short model steps; a form that needs them to explain its log is completed as well.

    Steps are short where the log says so (``steps``).

    A search that will not come down to the cost ``wanted`` ends early. Make-up valves that must let in more than the
    pump delivers are orifices (``bent``).
    """
    one = replace(one, problem=one.problem.on(log.stepped(steps)))
    if not _plain(one):
        one = replace(one, point=descend(one.problem.at, one.point.theta, SETTLING, one.bounds, wanted=wanted))
        if not _plain(one):
            return one.problem, one.point, one.bounds
    problem, theta, bounds = _completed(one, log, bent=bent)
    return problem, descend(problem.at, theta, FINISHING, bounds, wanted=wanted), bounds


def _ended(one: Found, log: GreyBoxLog) -> Found:
    """Return the end of a search whose last steps use short model steps throughout."""
    problem, point, bounds = one
    ending = with_steps(problem, log.steps)
    ending.take_slopes(problem, point.theta)
    evaluations = FINISHING if explained(problem, point) else 1
    return ending, descend(ending.at, point.theta, evaluations, bounds), bounds


def _told_of(done: Sequence[Found]) -> tuple[Found, Found]:
    """Return the likeliest, and the likeliest with volumes that swing."""
    return min(done, key=_cost), min((one for one in done if not _held(one[0])), key=_cost)


def _cost(one: Found) -> float:
    return one[1].cost


def _held(problem: Problem) -> bool:
    return problem.model.rates is HELD_FLOW_FORM.rates


def _plain(one: _Rough) -> bool:
    """Return whether a form explains a log so well that the last digits matter.

    Elsewhere valves that crack would take up what is strange and hide it: an encoder that was homed at the end stop,
    or a worn pump. Held chambers are the lumped plant's, which has no such valves.
    """
    return not _held(one.problem) and explained(one.problem, one.point)


def _completed(one: _Rough, log: GreyBoxLog, *, bent: bool) -> tuple[Problem, Array, tuple[Array, Array]]:
    """Return the problem with what matters to the last digits alone, where its search begins, and its bounds."""
    problem = FreedProblem.of(completed_form(one.problem.model, bent=bent), one.problem.log)
    theta = np.append(one.point.theta, np.zeros(len(problem.model.unknowns) - len(one.point.theta)))
    lowest, highest = flow_bounds(problem.model, [theta], log)
    known = len(one.point.theta)
    lowest[:known], highest[:known] = one.bounds
    return problem, theta, (lowest, highest)


def _rough(log: GreyBoxLog, parameters: EhaParameters, starts: Sequence[Mapping[str, float]]) -> list[_Rough]:
    """Return the optima of the balances with long model steps.

    A single rod may pump up both chambers, beyond what a balance of volumes follows. If none explains its log, that by
    mass leads, and counts if it comes far lower.
    """
    relieved = reaches_relief(log.measured, parameters.relief_pressure)
    volume, mass, held = (relieving(form) if relieved else form for form in (FLOW_FORM, MASS_FLOW_FORM, HELD_FLOW_FORM))
    rough = _led([volume, mass, held], log, parameters, starts)
    if not parameters.area_difference or any(map(_explains, rough)):
        return rough
    by_mass, by_volume, of_held = _led([mass, volume, held], log, parameters, starts)
    least = min(one.point.cost for one in rough)
    return [by_volume, by_mass, of_held] if by_mass.point.cost < least - RIVAL else rough


def _led(
    forms: Sequence[GreyBoxModel], log: GreyBoxLog, parameters: EhaParameters, starts: Sequence[Mapping[str, float]]
) -> list[_Rough]:
    """Return the optima of the balances with long model steps, each searched from that of the first."""
    afar = log.taken_at(parameters.bulk_modulus)
    begun = FreedProblem.of(forms[0], afar.beginning(_search(afar).screened).coarsened())
    guess, near = _guess(begun, afar, parameters, starts)
    screen = remembered(begun.at)
    if not near:  # in a wrong valley the whole log takes all steps that there are
        first = _searched(forms[0], log, afar, starts, hopeful=True, screen=screen)
        if _explains(first):
            return [first, *_others(forms[1:], log, afar, first)]
    first = _searched(forms[0], log, afar, [guess], alone=True)
    others = _others(forms[1:], log, afar, first, alone=True)
    if _explains(first) or _explains(others[0]):
        return [first, *others]
    first = _searched(forms[0], log, afar, [*starts, first.values], screen=screen)
    return [first, *_others(forms[1:], log, afar, first)]


def _others(
    forms: Sequence[GreyBoxModel], log: GreyBoxLog, afar: GreyBoxLog, first: _Rough, *, alone: bool = False
) -> list[_Rough]:
    """Return the optima of other forms, searched from that of the first, as far as they may count beside it."""
    wanted = first.point.cost + RIVAL
    return each(lambda form: _searched(form, log, afar, [first.values], alone=alone, wanted=wanted), forms)


def _explains(one: _Rough) -> bool:
    return explained(one.problem, one.point)


def _guess(
    problem: FreedProblem, log: GreyBoxLog, parameters: EhaParameters, starts: Sequence[Mapping[str, float]]
) -> tuple[Mapping[str, float], bool]:
    """Return the optimum from the most likely guess about the first start, and whether it explains the log.

    Of the log its beginning is looked at, which the problem holds.
    """
    search = _search(log)
    around = {STIFFNESS: 0.0, **starts[0]}
    guesses = guesses_about(around, problem.model, parameters)
    likeliest = guesses[int(np.argmin(problem.costs(guesses, LANES)))]
    bounds = flow_bounds(problem.model, guesses, log)
    found = descend(problem.at, likeliest, search.evaluations, bounds, search.near_enough, GUESSED_WITHIN)
    return problem.model.values(found.theta), explained(problem, found)


def _search(log: GreyBoxLog) -> Search:
    # where the noise moves with bulk modulus, steps promise less than they give
    near_enough = NEAR_ENOUGH if log.passes_on else ROUGH_ENOUGH
    speed = log.drives[:, FLOW_FORM.drives.index("motor_speed_rad_s")]
    screened = driven_samples(speed, ceil(SCREENED_SECONDS / log.sample_time))
    return Search(screened=screened, near_enough=near_enough, radius=LED_WITHIN)


def _searched(
    form: GreyBoxModel,
    log: GreyBoxLog,
    afar: GreyBoxLog,
    starts: Sequence[Mapping[str, float]],
    *,
    alone: bool = False,
    wanted: float = np.inf,
    hopeful: bool = False,
    screen: Callable[[Array], Point] | None = None,
) -> _Rough:
    """Return the best that is found from starts, at first with noise of position as it is at the rig's bulk modulus."""
    search = _search(log)
    problem = FreedProblem.of(form, afar)
    guesses = [form.theta({STIFFNESS: 0.0, **start}) for start in starts]
    bounds = flow_bounds(form, guesses, afar)
    if alone:
        guesses = [_nearer(problem, guesses[0], bounds, search)]
    if not log.passes_on:
        point = roughly(problem, guesses, search, bounds, wanted, hopeful=hopeful, screen=screen)
        return _Rough(problem, point, bounds)
    point = roughly(problem, guesses, search, bounds, hopeful=hopeful, screen=screen)
    if np.isinf(point.cost):
        return _Rough(problem, point, bounds)
    problem, modulus = problem.on(log), form.values(point.theta)["bulk_modulus"]
    guesses = [form.theta({STIFFNESS: 0.0, **start, "bulk_modulus": modulus}) for start in starts]
    bounds = flow_bounds(form, guesses, log)
    again = [point.theta] if alone else [*guesses, point.theta]
    return _Rough(problem, roughly(problem, again, search, bounds, wanted), bounds)


def _nearer(problem: Problem, guess: Array, bounds: tuple[Array, Array], search: Search) -> Array:
    """Return a guess, or where a search from one that leaves much comes on a decimated log, at a quarter of the cost.

    A relief valve that opens within so long a step makes slopes of chance.
    """
    log, every = problem.log, round(LONG_STEP / problem.log.sample_time)
    if len(log.drives) < FEW or every < 2 or "relief_pressure" in problem.model.unknowns:
        return guess
    at = remembered(problem.on(decimated(log, every)).at)
    if cost_over_noise(log, at(guess).cost) < FAR_OFF:
        return guess
    return descend(at, guess, search.evaluations, bounds, search.near_enough, search.radius, least_share=SLIGHT).theta
