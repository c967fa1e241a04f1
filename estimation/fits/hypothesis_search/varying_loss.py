"""`varying_loss(log, ...)`: a loss that varies with a measured signal and explains a log that no hypothesis explains.

The regressor of the loss is computed from the log, given its place and width (`loss_regressors`); its size is one more
unknown of the flow form. The predicted gains of some seventy regressors are computed side by side. The best of each
kind is searched: Gauss-Newton steps of its place and width alternate with descents of all unknowns. See decision 288.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from estimation.finding import NORMAL_95
from estimation.fits.flow.accumulator import first_stiffness
from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.fit import Asked, GreyBoxFit, fit_at_solution
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.spared_steps import LAST_EVALUATIONS, with_steps_where_needed
from estimation.fits.hypotheses import WORN_SHARE
from estimation.fits.hypothesis_search.coarse_search import vanished_values
from estimation.fits.hypothesis_search.final_fits import EQUAL_DISTANCE, is_hopeless
from estimation.fits.hypothesis_search.loss_regressors import (
    ONE_WAY,
    WEAR,
    LossRegressor,
    LossSignals,
    loss_signals,
    shifted_regressor,
)
from estimation.fits.hypothesis_search.wide_log import widened_log
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import FLOW_FORM, STIFFNESS, form_with_relief, reaches_relief
from estimation.models.losing_flow import LOSING_FLOW_FORM, LOSS_SIZE
from estimation.notes import RigCode
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.notes import Note

NUDGE = 0.05
"""Units of a loss for the finite difference of the residuals [dimensionless]."""

TRIED, SHIFTED = 3, 12
"""Kinds that are searched, those of largest predicted gain, and how often each regressor is moved at most [count]."""

MOST_GAIN_RATIO = 10.0
"""Largest factor by which the actual gain of a loss may exceed the predicted one [dimensionless]; judged: it may be far
from zero."""

ONE_WAY_TRIED = 2.0
"""Size at which the search for a loss in one direction begins whatever the prediction [units of a loss]."""

SETTLING, MOVING, FINISHING = 20, 5, 40
"""Evaluations of the model in a descent with long steps, after a regressor was moved, and with short steps [count]."""

BELIEVED_GAIN = 50.0
"""Gain in log-likelihood from which a loss is believed [dimensionless]: the best of some seventy regressors gains 8 by
chance, and a log that gains less than 50 has another fault."""

SHORTEST = 0.1
"""Least share of a step by which a regressor is moved [fraction]."""

ROUGH_ENOUGH = 0.05
"""Half the sum of squares that a further step must promise while model steps are long [dimensionless]: their errors are
larger."""

MOST_COST_BEHIND = 3.0
"""Cost after a first search over that of the best start, from which a regressor is not moved [dimensionless]."""

SETTLED, SLIGHT = 0.5, 1e-4
"""Gain, and share of the cost, below which a regressor is no longer moved [dimensionless]."""


class VaryingLoss(NamedTuple):
    """A varying loss that explains a log.

    Parameters
    ----------
    course : LossRegressor
        What it depends on [SI].
    size, std : float
        Its size and standard deviation [units of `LossSignals.of`].
    fit : GreyBoxFit
        The fit with it.
    opened : float
        Relative standard deviation of bulk modulus due to the place and width of the loss [fraction].
    measured : LossSignals
        The signals from which its regressor is computed.
    """

    course: LossRegressor
    size: float
    std: float
    fit: GreyBoxFit
    opened: float
    measured: LossSignals


def varying_loss(
    log: GreyBoxLog,
    parameters: EhaParameters,
    starts: Sequence[Mapping[str, float]],
    explains: Callable[[GreyBoxFit], bool],
    wanted: float,
    largest: float,
) -> VaryingLoss | None:
    """Return the varying loss that explains a log; None if none does.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it; its speed has no gaps.
    starts : sequence of Mapping[str, float]
        Where searches begin; regressors are compared at the first, where the plain form ended [SI].
    explains : callable
        ``explains(fit)``: whether a fit explains the log.
    wanted : float
        Cost of the best fit without a loss [dimensionless].
    largest : float
        Largest mean squared residual of a fit that explains the log [dimensionless].

    Returns
    -------
    VaryingLoss or None
        The likeliest of those that explain the log.
    """
    search = _Search(log, parameters)
    found: list[VaryingLoss] = []
    for course, size in search.promising_regressors(starts[0], largest):
        ended = search.best_of_searches(course, [{**one, LOSS_SIZE: size} for one in starts])
        if is_hopeless(log, ended[1].cost):
            continue
        loss = search.concluded(*ended)
        least = 1.0 - WORN_SHARE if course.kind == WEAR else 0.0
        if loss.size > least and explains(loss.fit) and loss.fit.cost < wanted - BELIEVED_GAIN:
            found.append(loss)
    best = min(found, key=lambda one: one.fit.cost, default=None)
    # with another flow bias, a pump that fills badly from a low speed on looks like a worn one
    worn = [one for one in found if one.course.kind == WEAR and best and one.fit.cost < best.fit.cost + EQUAL_DISTANCE]
    return worn[0] if worn else best


def loss_notes(loss: VaryingLoss) -> tuple[Note, ...]:
    """Return the note that names a loss; none for one that may be zero and only led the search to a lower minimum.

    Returns
    -------
    tuple of Note
        With its place, or its limit, and its size.
    """
    return (_loss_note(loss),) if loss.size > NORMAL_95 * loss.std else ()


def _loss_note(loss: VaryingLoss) -> Note:
    course, measured = loss.course, loss.measured
    factor = 1.0 + loss.size * measured.leakage / loss.fit.values["leakage_coefficient"]
    match course.kind:
        case "bore":
            return RigCode.BORE_LEAKS.note(at_mm=1e3 * course.at, width_mm=1e3 * course.width, factor=factor)
        case "tooth":
            return RigCode.TOOTH_LEAKS.note(factor=factor)
        case "wear":
            return RigCode.PUMP_WORN.note(percent=100.0 * (1.0 - loss.size), half_width=100.0 * NORMAL_95 * loss.std)
        case "filling":
            fastest = float(np.max(np.abs(measured.speed)))
            share = 100.0 * float(np.max(np.abs(measured.of(course)))) / (measured.displacement * fastest)
            return RigCode.PUMP_STARVES.note(
                from_rad_s=course.at,
                fastest_rad_s=fastest,
                percent=loss.size * share,
                half_width=NORMAL_95 * loss.std * share,
            )
        case "lifting":
            highest = float(np.max(np.abs(measured.pressure)))
            lost = loss.size * float(np.max(np.abs(measured.of(course))))
            factor = 1.0 + lost / (loss.fit.values["leakage_coefficient"] * highest)
            return RigCode.LEAKAGE_LIFTS.note(from_pa=course.at, highest_pa=highest, factor=factor)
        case _:
            return RigCode.LEAKS_ONE_WAY.note(side="A" if course.at > 0.0 else "B", factor=factor)


class _Search:
    """The search for a loss in one log."""

    def __init__(self, log: GreyBoxLog, parameters: EhaParameters) -> None:
        relieved = reaches_relief(log.measured, parameters.relief_pressure)
        self._form = form_with_relief(LOSING_FLOW_FORM) if relieved else LOSING_FLOW_FORM
        self._measured, self._log, self._wide = loss_signals(log, parameters), log, widened_log(log, parameters)

    def promising_regressors(self, start: Mapping[str, float], largest: float) -> list[tuple[LossRegressor, float]]:
        """Return the best regressor of each kind and its size, the largest predicted gain first."""
        problem = self._problem(None, coarse=True)
        theta = self._theta(problem, {**start, LOSS_SIZE: 0.0})
        theta = descend(problem.at, theta, SETTLING, self._bounds(problem, theta)).theta
        errors, slopes = problem.linearised(theta)
        place, asked = problem.model.unknowns.index(LOSS_SIZE), self._measured.regressors_tried()
        base, _ = np.linalg.qr(np.delete(slopes, place, axis=1))
        nudged = theta.copy()
        nudged[place] = NUDGE
        drives = (self._log_with_loss(self._measured.of(one)).drives for one in asked)
        columns = np.stack([(one - errors).ravel() / NUDGE for one in problem.disturbed(nudged, drives)], axis=-1)
        free = columns - base @ (base.T @ columns)
        power, along = np.einsum("ij,ij->j", free, free), -(errors.ravel() @ free)
        size = along / np.maximum(power, np.finfo(float).tiny)
        gain = np.where(size > 0.0, 0.5 * along * size, 0.0)
        needed = 0.5 * (float(np.sum(errors**2)) - largest * np.count_nonzero(errors))
        best: dict[str, int] = {}
        for i in np.argsort(-gain).tolist():
            best.setdefault(asked[i].kind, i)
        found = [
            (asked[i], float(size[i])) for i in best.values() if gain[i] > 0.0 and MOST_GAIN_RATIO * gain[i] > needed
        ]
        found = [*found[:TRIED], *(one for one in found[TRIED:] if one[0].kind == WEAR)]
        if all(course.kind != ONE_WAY for course, _ in found):  # slopes at no loss say little about a large one
            return [*found, *((course, ONE_WAY_TRIED) for course in asked if course.kind == ONE_WAY)]
        return found

    def best_of_searches(
        self, course: LossRegressor, starts: Sequence[Mapping[str, float]]
    ) -> tuple[LossRegressor, Point]:
        """Return the result of the best of several searches for a varying loss."""
        best, *others = starts
        found = self._search_with_retry(course, best)
        for start in others:
            found = min(
                found,
                self._search_with_retry(course, start, MOST_COST_BEHIND * found[1].cost),
                key=lambda one: one[1].cost,
            )
        return found

    def _search_with_retry(
        self, course: LossRegressor, start: Mapping[str, float], hopeless: float = np.inf
    ) -> tuple[LossRegressor, Point]:
        """Return the result of a search for a varying loss; values that vanished by mistake are tried once more."""
        course, best = self._search_with_shifts(course, start, hopeless)
        values = self._problem(None, coarse=True).model.values(best.theta)
        if lost := vanished_values(self._wide, values):
            again = self._search_with_shifts(course, {**values, **lost}, hopeless)
            return min((course, best), again, key=lambda one: one[1].cost)
        return course, best

    def _search_with_shifts(
        self, course: LossRegressor, start: Mapping[str, float], hopeless: float
    ) -> tuple[LossRegressor, Point]:
        """Return the result of a search that shifts the regressor between descents, as long as this helps."""
        problem = self._problem(course, coarse=True)
        theta = self._theta(problem, start)
        bounds = self._bounds(problem, theta)
        best = descend(problem.at, theta, SETTLING, bounds, ROUGH_ENOUGH)
        for _ in range(SHIFTED if course.free and best.cost < hopeless else 0):
            step = self._step(problem, best.theta, course)
            share, further = 1.0, None
            while further is None and share > SHORTEST:
                there = shifted_regressor(course, step, share)
                tried = self._problem(there, coarse=True)
                point = descend(tried.at, best.theta, MOVING, bounds, ROUGH_ENOUGH, wanted=best.cost)
                further, share = (there, tried, point) if point.cost < best.cost else None, 0.5 * share
            if further is None:
                break
            gained = best.cost - further[2].cost
            course, problem, best = further
            if gained < max(SETTLED, SLIGHT * best.cost):
                break
        return course, best

    def concluded(self, course: LossRegressor, point: Point) -> VaryingLoss:
        """Return a loss with its fit by short model steps."""
        problem = self._problem(course, coarse=False)
        bounds = self._bounds(problem, point.theta)
        quick = with_steps_where_needed(problem, point.theta)
        near = descend(quick.at, point.theta, FINISHING, bounds)
        ended = near if quick is problem else descend(problem.at, near.theta, LAST_EVALUATIONS, bounds)
        fit = fit_at_solution(problem, ended, least=bounds[0], asked=Asked(warned=False))
        opened = 0.0
        if answers := self._responses(problem, ended.theta, course):
            by = np.linalg.lstsq(fit.slopes, np.column_stack(answers), rcond=None)[0]
            free = np.column_stack(answers) - fit.slopes @ by
            along = by[problem.model.unknowns.index("bulk_modulus")]
            opened = float(np.sqrt(along @ np.linalg.pinv(free.T @ free, hermitian=True) @ along))
        return VaryingLoss(course, fit.values[LOSS_SIZE], fit.std[LOSS_SIZE], fit, opened, self._measured)

    def _responses(self, problem: FreedProblem, theta: Array, course: LossRegressor) -> list[Array]:
        """Return the response of residuals to a unit shift of each fitted field of a regressor."""
        small = self._measured.field_steps(course)
        if not small:
            return []
        there = [shifted_regressor(course, {name: step}, 1.0) for name, step in small.items()]
        drives = [self._log_with_loss(self._measured.of(one)).drives for one in there]
        known, *answers = problem.disturbed(theta, [problem.log.drives, *drives])
        return [(one - known).ravel() / step for one, step in zip(answers, small.values(), strict=True)]

    def _step(self, problem: FreedProblem, theta: Array, course: LossRegressor) -> dict[str, float]:
        """Return the Gauss-Newton step of a regressor, with all other unknowns free."""
        errors, slopes = problem.linearised(theta)
        columns = np.column_stack([slopes, *self._responses(problem, theta, course)])
        scale = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
        solved = np.linalg.lstsq(columns / scale, -errors.ravel(), rcond=1e-9)[0] / scale
        return dict(zip(course.free, solved[slopes.shape[1] :].tolist(), strict=True))

    def _problem(self, course: LossRegressor | None, *, coarse: bool) -> FreedProblem:
        log = self._log_with_loss(np.zeros(len(self._log.drives)) if course is None else self._measured.of(course))
        return FreedProblem.of(self._form, log.coarsened() if coarse else log)

    def _log_with_loss(self, loss: Array) -> GreyBoxLog:
        """Return the log with a loss beside its drives."""
        plain = len(FLOW_FORM.drives)
        drives = np.column_stack([self._log.drives[:, :plain], loss])
        parameters = np.append(self._log.parameters, 0.0)
        return replace(self._log, drives=drives, drive_std=(*self._log.drive_std, 0.0), parameters=parameters)

    def _theta(self, problem: FreedProblem, values: Mapping[str, float]) -> Array:
        return problem.model.theta({STIFFNESS: first_stiffness(self._log), **dict.fromkeys(CRACKS, 0.0), **values})

    def _bounds(self, problem: FreedProblem, theta: Array) -> tuple[Array, Array]:
        lowest, highest = flow_bounds(problem.model, [theta], problem.log)
        lowest[problem.model.unknowns.index(LOSS_SIZE)] = 0.0
        return lowest, highest
