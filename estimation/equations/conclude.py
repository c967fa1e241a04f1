"""Reliability of a fit of a user's equations: covariance, parameters that the logs do not determine, failed checks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr
from scipy.special import stdtrit

from estimation.arrays import Array
from estimation.equations.notes import EquationsCode
from estimation.equations.problem import Problem, spread
from estimation.equations.search import LARGEST_SHIFT, MOST_STEPS, Solution, noise_of
from estimation.equations.stops import standing_ends
from estimation.finding import Finding, Gate, Outcome, Quantity
from estimation.identification.fit.covariances import spread_of_fit
from estimation.identification.fit.residual_tests import cross_correlation_test
from plant.errors import HydrostateError
from plant.notes import Note

LEAST_SINGULAR_VALUE = 1e-6
"""Singular value of the scaled sensitivities, over the largest, below which a direction is not determined
[fraction]."""

UNDETERMINED_SHARE = 1e-3
"""Share of an unknown in such a direction above which the unknown is not determined either [fraction]."""

POOR_DEVIATION = 0.5
"""Relative deviation above which an unknown is called poorly determined [fraction]."""

CHANCE_FACTOR = 3.0
"""Explained variance, relative to what as many unknowns explain of white noise, up to which nothing counts as explained
[dimensionless]."""

LARGEST_MISFIT = 1.2
"""Residuals over given noise above which the equations miss something [dimensionless]."""

LARGEST_CORRELATION = 0.2
"""Correlation of neighbouring residuals above which they are not noise [dimensionless]."""

FOLLOWED, SURE = 0.01, 1e-3
"""Share of the residuals that an input's past explains [fraction] and its significance [probability], which together
count against the equations."""

MOST_TESTED = 20_000
"""Samples of a log on which this is tested."""

MISSED, LEAST = 3.0, 1e-3
"""Residuals at a limit, over the noise, above which the equations do not include the limit [dimensionless], and the
least noise that counts, over the channel's spread [fraction]."""

EQUAL_LIKELIHOOD = 2.0
"""Difference of log-likelihood up to which two solutions explain the logs equally well [dimensionless]."""

DISTINCT_DEVIATIONS = 3.0
"""Standard deviations above which two solutions differ."""


@dataclass(frozen=True, eq=False)
class Covariance:
    """Standard deviations and correlations of the unknowns, and which of them are not determined.

    Parameters
    ----------
    std : ndarray, shape (unknowns,)
        Standard deviations in the coordinates of the search; infinite if not determined [dimensionless].
    correlation : ndarray, shape (unknowns, unknowns)
        Correlations; NaN if not determined.
    condition : float
        Condition number of the sensitivities, each scaled to one [dimensionless].
    groups : tuple of tuple of int
        Indices of unknowns that the logs cannot separate; a group of one has no effect at all.
    """

    std: Array
    correlation: Array
    condition: float
    groups: tuple[tuple[int, ...], ...]


def covariance_of(problem: Problem, theta: Array) -> Covariance:
    """Return the covariance of the unknowns, allowing for coloured residuals, and which are not determined.

    Parameters
    ----------
    problem : Problem
        The problem, with more samples than unknowns.
    theta : ndarray, shape (unknowns,)
        The solution [dimensionless].
    """
    slopes = problem.slopes(theta)
    errors = np.concatenate([one.ravel() for one in problem.residuals(theta)])
    size = np.linalg.norm(slopes, axis=0)
    felt = np.flatnonzero(size > 0.0)
    groups = [(int(j),) for j in np.flatnonzero(size == 0.0)]
    _, values, directions = np.linalg.svd(slopes[:, felt] / size[felt], full_matrices=False)
    lost = values < LEAST_SINGULAR_VALUE * values[0]
    touched = felt[np.any(np.abs(directions[lost]) > UNDETERMINED_SHARE, axis=0)]
    groups += [
        tuple(int(felt[j]) for j in np.flatnonzero(np.abs(one) > UNDETERMINED_SHARE)) for one in directions[lost]
    ]
    order = qr(slopes[:, felt] / size[felt], mode="r", pivoting=True)[1][: int(np.count_nonzero(~lost))]
    kept = felt[np.sort(order)]
    std, correlation = np.full(len(theta), np.inf), np.full((len(theta), len(theta)), np.nan)
    spread_of = _spread(problem, slopes[:, kept], errors)
    variance = np.diag(spread_of)
    known = np.sqrt(np.where(variance > 0.0, variance, np.inf))
    std[kept] = known
    correlation[np.ix_(kept, kept)] = spread_of / np.outer(known, known)
    std[touched] = np.inf
    correlation[touched] = correlation[:, touched] = np.nan
    condition = float(values[0] / values[-1]) if values[-1] > 0.0 and not len(touched) else np.inf
    return Covariance(std, correlation, condition, tuple(dict.fromkeys(groups)))


def _spread(problem: Problem, slopes: Array, errors: Array) -> Array:
    """Return the covariance of unknowns that the logs tell apart; the noise of each output has a colour of its own."""
    sizes = [part.measured.shape[1] for part in problem.parts for _ in part.measured]
    begins = np.concatenate([[0], np.cumsum(sizes)])
    outputs = len(problem.parts[0].measured)
    # rows are laid log by log, and output by output within a log
    blocks = [k * outputs + output for output in range(outputs) for k in range(len(problem.parts))]
    order = np.concatenate([np.arange(begins[k], begins[k + 1]) for k in blocks])
    used = np.concatenate([np.isfinite(part.measured).ravel() for part in problem.parts])[order]
    bounds = np.concatenate([[0], np.cumsum([sizes[k] for k in blocks])]).astype(np.int64)
    return spread_of_fit(slopes[order], np.where(used, errors[order], 0.0), used, bounds, outputs).taken


def concluded_finding(solution: Solution, given: Array) -> tuple[Finding, Covariance]:
    """Return the finding of a solution, and its covariance.

    Parameters
    ----------
    given : ndarray, shape (outputs,)
        Given noise; NaN if it was estimated from the residuals [units of the outputs].

    Returns
    -------
    tuple of Finding and Covariance
        Quantities are the parameters, and the fitted initial states.
    """
    problem, theta = solution.problem, solution.point.theta
    found = covariance_of(problem, theta)
    residuals = problem.residuals(theta)
    samples = int(np.count_nonzero(~np.isnan(np.concatenate([part.measured.ravel() for part in problem.parts]))))
    chance = 100.0 * (1.0 - np.sqrt(max(1.0 - CHANCE_FACTOR * len(theta) / samples, 0.0)))
    empty = [_no_fit_note(problem, i, fit) for i, fit in enumerate(fits_of(problem, theta)) if not fit > chance]
    limits, held = _limits(problem, residuals)
    reasons = (
        *empty,
        *(() if empty else _misfits(problem, theta, residuals, given)),
        *_at_bounds(problem, theta),
        *_convergence_notes(solution),
        *limits,
    )
    quantities = _quantities(problem, theta, found, samples)
    told = [one for one in problem.equations.parameters if quantities[one].value is not None]
    outcome = Outcome.MISMATCH if empty else Outcome.OK if told else Outcome.NOT_OBSERVABLE
    finding = Finding(
        actuator="equations",
        outcome=outcome,
        quantities=quantities,
        gate=Gate(not reasons, tuple(reasons)),
        channels=(*problem.equations.inputs, *problem.equations.outputs),
        notes=(*held, *_missing_sample_notes(problem), *_other_solution_notes(solution, found)),
        not_told=_undetermined_notes(problem, theta, found),
    )
    return finding, found


def fits_of(problem: Problem, theta: Array) -> list[float]:
    """Return the fit of each output.

    Parameters
    ----------
    theta : ndarray, shape (unknowns,)
        The solution [dimensionless].

    Returns
    -------
    list of float
        One for each output: 100 is perfect, 0 is as good as its mean [percent].
    """
    typical = spread(problem.parts)
    size = [float(np.sqrt(np.mean(row**2))) for row in problem.errors(theta)]
    return [
        100.0 * (1.0 - one / float(whole)) if whole > 0.0 else np.nan for one, whole in zip(size, typical, strict=True)
    ]


def _no_fit_note(problem: Problem, place: int, fit: float) -> Note:
    return EquationsCode.EQUATIONS_EXPLAIN_NOTHING.note(channel=list(problem.equations.outputs)[place], fit=fit)


def _quantities(problem: Problem, theta: Array, found: Covariance, samples: int) -> dict[str, Quantity]:
    values, free = problem.values(theta), max(samples - len(theta), 1)
    reach, rows = float(stdtrit(free, 0.975)), dict[str, Quantity]()
    for j, (name, one) in enumerate(zip(problem.names, problem.unknowns, strict=True)):
        unit, std = one.unit if name in problem.equations.parameters else _unit(problem, name), float(found.std[j])
        low, high = (theta[j] + side * reach * std for side in (-1.0, 1.0))
        with np.errstate(over="ignore"):
            ends = (np.exp(low), np.exp(high)) if one.logarithmic else (low * one.size, high * one.size)
        if not np.isfinite(ends).all():
            rows[name] = Quantity(None, unit)
            continue
        by_theta = values[j] if one.logarithmic else one.size
        rows[name] = Quantity(float(values[j]), unit, (float(ends[0]), float(ends[1])), float(by_theta * std))
    return rows


def _unit(problem: Problem, name: str) -> str:
    return problem.equations.states[name.removeprefix("initial ").partition(" of log ")[0]]


def _misfits(problem: Problem, theta: Array, residuals: Sequence[Array], given: Array) -> list[Note]:
    """Return notes on residuals that differ from sensor noise."""
    notes: list[Note] = []
    slopes = np.split(problem.slopes(theta), np.cumsum([one.size for one in residuals])[:-1])
    for i, channel in enumerate(problem.equations.outputs):
        rows = [one[i] for one in residuals]
        seen = [np.isfinite(part.measured[i]) for part in problem.parts]
        power = sum(float(row @ row) for row in rows)
        count = sum(int(np.count_nonzero(one)) for one in seen)
        ratio = (power / count) ** 0.5
        if np.isfinite(given[i]) and ratio > LARGEST_MISFIT:
            notes.append(EquationsCode.MISFIT_BEYOND_NOISE.note(channel=channel, ratio=ratio))
        neighbours = sum(float(row[1:] @ row[:-1]) for row in rows) / max(power, np.finfo(float).tiny)
        if abs(neighbours) > max(LARGEST_CORRELATION, 4.0 / count**0.5):
            notes.append(EquationsCode.MISFIT_CORRELATED.note(channel=channel, correlation=neighbours))
        for j, source in enumerate(problem.equations.inputs):
            shares = [
                _explained_share(
                    np.where(kept, row, np.nan), part.inputs[:, j], slope.reshape(len(one), len(row), -1)[i]
                )
                for row, kept, part, slope, one in zip(rows, seen, problem.parts, slopes, residuals, strict=True)
            ]
            if max(shares) > FOLLOWED:
                notes.append(
                    EquationsCode.MISFIT_FOLLOWS_INPUT.note(channel=channel, source=source, percent=100.0 * max(shares))
                )
    return notes


def _explained_share(residual: Array, source: Array, slopes: Array) -> float:
    """Return the share of a residual that the past of an input explains; 0 if chance would [fraction]."""
    part = slice(0, MOST_TESTED)
    if np.ptp(source[part]) == 0.0:
        return 0.0
    moving = np.any(slopes[part] != 0.0, axis=0)
    try:
        test = cross_correlation_test(residual[part], source[part], jacobian=slopes[part][:, moving])
    except HydrostateError:  # too few samples to say anything
        return 0.0
    return test.statistic / np.count_nonzero(np.isfinite(residual[part])) if test.p_value < SURE else 0.0


def _at_bounds(problem: Problem, theta: Array) -> list[Note]:
    notes: list[Note] = []
    low, high = problem.bounds
    for j, (name, one) in enumerate(zip(problem.names, problem.unknowns, strict=True)):
        for place, bound in zip((low[j], high[j]), one.bounds, strict=True):
            if np.isfinite(place) and abs(theta[j] - place) <= 1e-9 * max(1.0, abs(place)):
                notes.append(EquationsCode.PARAMETER_AT_BOUND.note(parameter=name, bound=bound))
    return notes


def _convergence_notes(solution: Solution) -> list[Note]:
    notes: list[Note] = []
    if solution.moved > LARGEST_SHIFT:
        notes.append(EquationsCode.STEPS_TOO_LONG.note(deviations=solution.moved, steps=2 * MOST_STEPS))
    if solution.evaluations:
        notes.append(EquationsCode.NOT_CONVERGED.note(evaluations=solution.evaluations))
    return notes


def _limits(problem: Problem, residuals: Sequence[Array]) -> tuple[list[Note], list[Note]]:
    """Return limits that the equations do not follow, and those that need only be mentioned."""
    against, known = list[Note](), list[Note]()
    noise, typical = noise_of(problem.parts), spread(problem.parts)
    for i, channel in enumerate(problem.equations.outputs):
        for one in standing_ends([part.measured[i] for part in problem.parts], float(noise[i])):
            errors, there = np.concatenate([row[i] for row in residuals]), np.concatenate(one.where)
            ratio = float(np.sqrt(np.mean(errors[there] ** 2)) * problem.noise[i] / max(noise[i], LEAST * typical[i]))
            value, percent = one.value, 100.0 * one.share
            if ratio > MISSED:
                against.append(
                    EquationsCode.LIMIT_UNEXPLAINED.note(
                        channel=channel, end=one.end, value=value, percent=percent, ratio=ratio
                    )
                )
            else:
                known.append(
                    EquationsCode.OUTPUT_AT_LIMIT.note(channel=channel, end=one.end, value=value, percent=percent)
                )
    for j, channel in enumerate(problem.equations.inputs):
        for one in standing_ends([part.inputs[:, j] for part in problem.parts], 0.0):
            value, percent = one.value, 100.0 * one.share
            known.append(EquationsCode.INPUT_AT_LIMIT.note(channel=channel, end=one.end, value=value, percent=percent))
    return against, known


def _missing_sample_notes(problem: Problem) -> list[Note]:
    notes: list[Note] = []
    for i, channel in enumerate(problem.equations.outputs):
        rows = np.concatenate([part.measured[i] for part in problem.parts])
        lost = int(np.count_nonzero(np.isnan(rows)))
        if lost:
            notes.append(EquationsCode.SAMPLES_MISSING.note(channel=channel, count=lost, total=len(rows)))
    return notes


def _undetermined_notes(problem: Problem, theta: Array, found: Covariance) -> tuple[Note, ...]:
    """Return the unknowns that the logs do not determine, or determine poorly."""
    notes, names = list[Note](), problem.names
    for group in found.groups:
        alike = ", ".join(names[j] for j in group)
        if len(group) > 1:
            notes.append(EquationsCode.PARAMETERS_NOT_TOLD.note(names=alike))
        else:
            notes.append(EquationsCode.PARAMETER_NOT_FELT.note(name=alike))
    values = problem.values(theta)
    for j, name in enumerate(problem.equations.parameters):
        one, std = problem.unknowns[j], found.std[j]
        share = std if one.logarithmic else std * one.size / max(abs(values[j]), one.size)
        if np.isfinite(std) and share > POOR_DEVIATION:
            others = np.where(np.arange(len(names)) == j, 0.0, np.nan_to_num(found.correlation[j]))
            other = int(np.argmax(np.abs(others)))
            correlation = float(others[other])
            notes.append(
                EquationsCode.PARAMETER_POORLY_TOLD.note(
                    name=name, percent=100.0 * share, other=names[other], correlation=correlation
                )
            )
    return tuple(notes)


def _other_solution_notes(solution: Solution, found: Covariance) -> list[Note]:
    """Return a solution from another start that explains the logs equally well but lies elsewhere."""
    problem, best = solution.problem, solution.point
    for other in solution.others:
        away = np.abs(other - best.theta) / np.where(np.isfinite(found.std), found.std, np.inf)
        if away.max() > DISTINCT_DEVIATIONS and problem.at(other).cost < best.cost + EQUAL_LIKELIHOOD:
            j = int(np.argmax(away))
            value = float(problem.values(other)[j])
            return [EquationsCode.STARTS_DISAGREE.note(parameter=problem.names[j], value=value)]
    return []
