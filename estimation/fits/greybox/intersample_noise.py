"""`likeliest_noise(problem, theta, course)`: size of the intersample uncertainty of a slow log."""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.fits.greybox.intersample_doubt import IntersampleDoubt, responses_to_speed
from estimation.fits.greybox.problem import Problem

SHARES = np.array([0.5, 0.7, 1.0, 1.4])
"""Variances of the pressure noise that are tried, over that read from the log [fraction]: in a slow log the latter
includes some of the actuator's motion."""

UNCERTAINTIES_TRIED = np.array([0.0, *np.geomspace(0.005, 0.28, 7)])
"""Uncertainties of the pumped volume that are tried, over the largest effect of a turn of the speed [fraction]: a speed
that jumps at an unknown time has ``12^-1/2``."""

LONGEST = 5000
"""Blocks of a log's beginning on which it is determined [count]."""

BLOCKS_AT_ONCE = 64
"""Blocks whose products are summed at a time [count]."""

LEAST_INFORMATION = 1e-9
"""Squared length of a combination of unit columns below which it has no information [dimensionless]: rounding is about
1e-15."""


def likeliest_noise(problem: Problem, theta: Array, course: IntersampleDoubt) -> tuple[float, float, float]:
    """Return the likeliest lasting and returning parts of the uncertainty, with any of `SHARES` of the pressure noise.

    In a log that the form does not explain, the error may not leak off: whether it does is tested too.

    Parameters
    ----------
    problem : Problem
        The problem.
    theta : ndarray, shape (unknowns,)
        Its solution [dimensionless].
    course : IntersampleDoubt
        Its turns are used, and what leakage keeps.

    Returns
    -------
    tuple of float
        Lasting part, returning part, and what is kept, see `IntersampleDoubt` [fraction].
    """
    log, unit = problem.log, replace(course, staying=1.0, passing=1.0)
    (noise,) = log.noise
    still = problem.on(replace(log, course=None, noise=(replace(noise, walk=0.0),)))
    samples, block = len(log.measured), max(1, round(log.block / log.sample_time))
    left, freed = _without_offset(still, theta, LONGEST)
    level = noise.variance / block
    walk, beside = np.append(0.0, unit.walk(samples, block)), unit.beside(samples, block)
    tried = [
        (*restricted_likelihood_noise(left * level**0.5, freed, level, walk, beside, one**block), one)
        for one in (course.kept, 1.0)
    ]
    staying, passing, _, kept = min(tried, key=lambda one: one[2])
    return staying, passing, kept


def restricted_likelihood_noise(
    left: Array, freed: Array, level: float, walk: Array, beside: Array, kept: float = 1.0
) -> tuple[float, float, float]:
    """Return the likeliest noise of residuals from which a fit has removed what its unknowns could absorb.

    A log under steps has some twenty turns, and ten unknowns absorb half of them. The likelihood of the residuals alone
    would count those as quiet; the restricted likelihood corrects for this (Patterson and Thompson 1971, Biometrika
    58).

    Parameters
    ----------
    left : ndarray, shape (blocks,)
        Residuals, 0 where missing [Pa].
    freed : ndarray, shape (blocks, columns)
        What was removed from them: orthonormal columns [dimensionless].
    level : float
        Variance of the pressure's noise in a block [Pa squared].
    walk, beside : ndarray, shape (blocks,)
        Variance gained up to each block, and variance that returns, each at its full size [Pa squared].
    kept : float
        What remains of the lasting part by the next block [fraction].

    Returns
    -------
    tuple of float
        Lasting and returning part, see `IntersampleDoubt` [fraction], and twice the negative log-likelihood, up to a
        constant.
    """
    share, staying, passing = (
        one.ravel() for one in np.meshgrid(SHARES, UNCERTAINTIES_TRIED, UNCERTAINTIES_TRIED, indexing="ij")
    )
    white, walks, passes = share * level, staying**2, passing**2
    values = np.column_stack([left, freed])
    mean, spread, cost = np.zeros((len(white), values.shape[1])), np.zeros_like(white), np.zeros_like(white)
    whitened, together = list[Array](), np.zeros((len(white), values.shape[1], values.shape[1]))
    for value, gained, there in zip(values, walk.tolist(), beside.tolist(), strict=False):
        spread = kept**2 * spread + walks * gained
        mean *= kept
        if value[0] == 0.0:  # missing
            continue
        total = spread + white + passes * there
        innovation = (value - mean) / np.sqrt(total)[:, None]
        cost += np.minimum(innovation[:, 0] ** 2, 9.0) + np.log(total)
        whitened.append(innovation)
        if len(whitened) == BLOCKS_AT_ONCE:
            together += _column_products(whitened)
        mean += (spread / np.sqrt(total))[:, None] * innovation
        spread -= spread / total * spread
    if whitened:
        together += _column_products(whitened)
    known, pulled = together[:, 1:, 1:], together[:, 1:, 0]
    cost += np.linalg.slogdet(known)[1] - np.sum(pulled * np.linalg.solve(known, pulled[..., None])[..., 0], axis=1)
    at = int(np.argmin(cost))
    return float(staying[at]), float(passing[at]), float(cost[at])


def _column_products(whitened: list[Array]) -> Array:
    """Return sums of products of whitened columns, shape (noises, columns, columns), and reset them."""
    parts = np.stack(whitened, axis=1)
    whitened.clear()
    return np.asarray(parts.transpose(0, 2, 1) @ parts, dtype=np.float64)


def _without_offset(problem: Problem, theta: Array, most: int) -> tuple[Array, Array]:
    """Return residuals of the first blocks without the effects of an offset of motor speed and of the unknowns.

    An offset leaves a lasting pressure error. A random walk would absorb it, and no offset would be found. Also
    returned is what was removed, as orthonormal columns.
    """
    errors, slopes = problem.linearised(theta)
    columns = np.column_stack([responses_to_speed(problem, theta, [np.ones(len(problem.log.drives))]), slopes])
    errors, columns = errors.ravel()[:most], columns[:most]
    sizes = np.linalg.norm(columns, axis=0)
    columns = columns[:, sizes > 0.0] / sizes[sizes > 0.0]
    squares, ways_out = np.linalg.eigh(columns.T @ columns)
    told = squares > LEAST_INFORMATION
    basis = columns @ (ways_out[:, told] / np.sqrt(squares[told]))  # exactly zero for a missing block
    return errors - basis @ (basis.T @ errors), basis
