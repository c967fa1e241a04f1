"""`lower_minimum(log, ...)`: a lower minimum of the plain flow form, reached from the values of another explanation."""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np

from estimation.fits.flow.accumulator import first_stiffness
from estimation.fits.flow.wide_valves import opens_wide
from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.problem import Problem
from estimation.fits.greybox.spared_steps import with_steps_where_needed
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.models.completed_flow import CRACKS, completed_flow_form
from estimation.models.flow import HELD_FLOW_FORM, STIFFNESS
from estimation.models.greybox import GreyBoxModel
from estimation.models.inner_circuit import BEND
from plant.arrays import Array
from plant.eha.model import EhaParameters

FINISHING = 60
"""Most evaluations with short model steps [count]. Most searches converge by the tenth. With stiff oil and a large
pump, long model steps end so far off that 15 evaluations left 74 of log-likelihood, and bulk modulus 1.3 % wrong."""

VALLEY_RADIUS = 0.3
"""First trust radius of a search that starts in another valley [dimensionless]."""

DRAIN = "case_leakage"

VANISHING = ("leakage_coefficient", DRAIN, "makeup_opening")
"""What may have vanished in the search with another balance."""

Found: TypeAlias = tuple[Problem, Point, tuple[Array, Array]]
"""A problem, its solution, and the bounds of its search."""


def lower_end(one: Found, other: Found, guesses: Mapping[str, float]) -> Point:
    """Return where a form's search continues: at its own end, or at another form's end if that is lower.

    A wrong balance may drive leakage to zero, and its logarithm does not come back from there. So what may vanish
    starts at its first guess.

    Parameters
    ----------
    one, other : Found
        The ends of both searches.
    guesses : Mapping[str, float]
        First guesses [SI].
    """
    problem, point, bounds = one
    led = {
        STIFFNESS: first_stiffness(problem.log),
        **other[0].model.values(other[1].theta),
        **{name: guesses[name] for name in VANISHING},
    }
    there = problem.at(np.clip(problem.model.theta(led), *bounds))
    return there if there.cost < problem.at(point.theta).cost else point


def lower_minimum(
    log: GreyBoxLog,
    parameters: EhaParameters,
    fit: GreyBoxFit,
    found: Mapping[str, tuple[float, float]],
    wanted: float,
) -> Mapping[str, float] | None:
    """Return a start from which the plain form reaches a lower cost, given a better explanation of the log.

    A form has several minima, depending on when make-up valves open and close. The way out of one may lead through a
    hypothesis that vanishes at the end: a drain of one port that becomes the other's. Or it leads through the first
    guess of the drain: a drain that is too large goes with make-up valves that let in as much, and with a stiffer
    accumulator.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    fit : GreyBoxFit
        The fit of the plain form.
    found : Mapping[str, tuple of float]
        Value and deviation of each parameter of the explanation [SI].
    wanted : float
        The cost to reach [dimensionless].

    Returns
    -------
    Mapping[str, float] or None
        Values of the plain form's unknowns [SI]; None if no lower cost is found, or if the log has gaps. A form that
        was not completed, since its search came nowhere near the log, starts there only if that is nearer, and not if
        the explanation has make-up valves that are orifices: the form would absorb them without a name.
    """
    if log.gaps.size:
        return None
    bent = opens_wide(log, parameters)
    values = {STIFFNESS: first_stiffness(log), BEND: 0.0, **fit.values, **dict.fromkeys(CRACKS, 0.0)}
    values |= {name: value for name, (value, _) in found.items()}
    if CRACKS[0] not in fit.values:
        form = completed_form(fit.model, bent=bent)
        if BEND in found or FreedProblem.of(form, log).at(form.theta(values)).cost >= fit.cost:
            return None
    for start in (values, {**values, DRAIN: log.presumed[DRAIN][0]}):
        _, point, _ = from_minimum(fit.model, log, start, wanted, bent=bent)
        if point.cost < wanted:
            return start
    return None


def from_minimum(
    form: GreyBoxModel, log: GreyBoxLog, valley: Mapping[str, float], wanted: float = np.inf, *, bent: bool
) -> Found:
    """Return the minimum of a completed form, searched from given values, with short model steps where they matter.

    Parameters
    ----------
    form : GreyBoxModel
        The form.
    log : GreyBoxLog
        The log, as the flow form sees it.
    valley : Mapping[str, float]
        The values [SI].
    wanted : float
        A search that will not reach this cost ends early [dimensionless].
    bent : bool
        See `completed_form`.

    Returns
    -------
    Found
        The form's problem, its minimum, and the bounds of the search.
    """
    form = completed_form(form, bent=bent)
    problem = FreedProblem.of(form, log)
    theta = form.theta({STIFFNESS: first_stiffness(log), **valley})
    bounds = flow_bounds(form, [theta], log)
    quick = with_steps_where_needed(problem, theta)
    return quick, descend(quick.at, theta, FINISHING, bounds, radius=VALLEY_RADIUS, wanted=wanted), bounds


def completed_form(form: GreyBoxModel, *, bent: bool) -> GreyBoxModel:
    """Return a form with the parameters that matter to the last digits only; held chambers have no such valves.

    Parameters
    ----------
    form : GreyBoxModel
        The form, completed or not.
    bent : bool
        Whether make-up valves must pass so much flow that they are modelled as orifices.
    """
    known = CRACKS[0] in form.unknowns or form.rates is HELD_FLOW_FORM.rates
    return form if known else completed_flow_form(form, bent=bent)
