"""What a fit is asked beside its values: by how much the rig's parameters move it, and whether a channel comes late."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from estimation.fits.descent import Point
from estimation.fits.greybox_problem import Problem, weighed
from estimation.fits.release import Promise, released
from plant.arrays import Array
from plant.solvers.steps import parameter_names

LATE_NUDGE = 1e-5
"""Time by which a driving channel is brought forward to see what its timing does [s]."""

RIG_NUDGE = 1e-3
"""Relative change of a rig parameter by which the fit's response to it is read off [fraction]."""

RELEASE_NUDGE = 1e-4
"""The same of a parameter that may be freed [fraction]: as small as steps of unknowns, for valves open between larger
ones, and the deviation of a worn pump came out half as large."""


def rig_slopes(problem: Problem, theta: Array) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
    """Return the slopes of the residuals by the logarithms of the rig's parameters.

    Parameters
    ----------
    problem : Problem
        Model and log.
    theta : ndarray, shape (unknowns,)
        The solution [dimensionless].

    Returns
    -------
    tuple of Mapping[str, ndarray of shape (outputs, blocks)]
        By parameter that is uncertain, and by parameter of which it is asked what it promises [dimensionless].
    """
    names, row, log = parameter_names(problem.model.parameters), problem.log.parameters, problem.log
    held = [name for name in names if name not in problem.model.unknowns]
    uncertain = [name for name, relative in log.uncertainties.items() if relative > 0.0 and name in held]
    asked = [name for name in log.released if name in held]
    wanted = [*((name, RIG_NUDGE) for name in uncertain), *((name, RELEASE_NUDGE) for name in asked)]
    if not wanted:
        return {}, {}
    rows = [np.where(np.arange(len(row)) == names.index(name), row * (1.0 + nudge), row) for name, nudge in wanted]
    known, *others = problem.residuals_of(theta, [row, *rows])
    slopes = [(errors - known) / nudge for errors, (_, nudge) in zip(others, wanted, strict=True)]
    by_rig, by_release = slopes[: len(uncertain)], slopes[len(uncertain) :]
    return dict(zip(uncertain, by_rig, strict=True)), dict(zip(asked, by_release, strict=True))


def promises_of_release(
    problem: Problem, point: Point, errors: Array, slopes: Array, shifts: Mapping[str, Array]
) -> Iterator[tuple[str, Promise]]:
    """Yield what each parameter of the rig promises of which it is asked, were it free.

    Parameters
    ----------
    problem : Problem
        Model and log.
    point : Point
        The solution.
    errors : ndarray, shape (outputs, blocks)
        The normalised residuals there [dimensionless].
    slopes : ndarray, shape (outputs * blocks, unknowns)
        Their derivatives [dimensionless].
    shifts : Mapping[str, ndarray of shape (outputs, blocks)]
        By parameter of which it is asked, as `rig_slopes` returns them.

    Yields
    ------
    tuple of str and Promise
        The parameter's name, and its promise.
    """
    unknowns = len(point.theta)
    for name, (deviation, held) in problem.log.released.items():
        if name in shifts:
            columns = np.column_stack([slopes, shifts[name].ravel()])
            _, gradient, gram = weighed(errors, columns)
            gradient[:unknowns], whole = point.gradient, gram + np.tril(gram, -1).T
            whole[np.diag_indices(unknowns)] += problem.prior
            whole[unknowns, unknowns] += deviation**-2.0
            own = [place for place, one in enumerate(problem.model.unknowns) if one not in held]
            yield name, released(gradient, whole, own, [*own, unknowns], unknowns)


def lateness(
    problem: Problem, theta: Array, errors: Array, left: Callable[[Array], Array]
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield by how much each driving channel that is asked seems late, and what it is worth (Rao's score statistic).

    Parameters
    ----------
    problem : Problem
        Model and log.
    theta : ndarray, shape (unknowns,)
        The solution [dimensionless].
    errors : ndarray, shape (outputs * blocks,)
        The normalised residuals there [dimensionless].
    left : callable
        What the unknowns do not take up of a change of the residuals.

    Yields
    ------
    tuple of str and (float, float)
        The channel; by how much it comes late [s], and the gain in log-likelihood [dimensionless].
    """
    log = problem.log
    if not log.timed:
        return
    rough = problem.on(log.coarsened())
    reach = max(1, round(0.5 * log.block / log.sample_time))
    padded = np.pad(log.drives, ((reach, reach), (0, 0)), mode="edge")
    ahead = LATE_NUDGE * (padded[2 * reach :] - padded[: -2 * reach]) / (2 * reach * log.sample_time)
    places = [problem.model.drives.index(channel) for channel in log.timed]
    forward = [np.where(np.arange(log.drives.shape[1]) == place, ahead, 0.0) for place in places]
    known, *shifted = rough.disturbed(theta, [log.drives + one for one in (0.0, *forward)])
    for channel, moved in zip(log.timed, shifted, strict=True):
        free = left((moved - known).ravel() / LATE_NUDGE)
        power = float(free @ free)
        if power > 0.0:
            along = float(free @ errors)
            yield channel, (-along / power, 0.5 * along**2 / power)
