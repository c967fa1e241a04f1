"""Model error of a fitted circuit: the uncertainty of severities when pressure is logged.

A circuit fitted to a log has the seals, make-up valves, mass and accumulator of the rig file, and a judged share of its
leakage in the pump. If the real ones differ, the fitted parameters absorb the difference. So they are nuisance unknowns
for one linear step, each with a judged spread. What the log leaves open of them widens the intervals, and so does what
it says of them, because the fit did not go that way (consider covariance: Tapley, Schutz and Born, Statistical Orbit
Determination, 2004, chapter 6). The file may also be right about all of them: both cases count, in proportion to their
likelihood. Residuals beyond sensor noise are the error of a wrong model, which a longer log does not average away; that
is counted here, once, and where it occurs. Noise of a position does not persist. An encoder's steps are no model error
either: what they add to one block they subtract from the next. See decision 251.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks, root_mean_square
from faults.diagnosis.circuits.circuit_runs import COLUMN, TOLERANCES, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import WEAK_PRIOR, PointFit, least_scales
from plant.arrays import Array

_CASE = "pump_case_leakage"
"""The case drain draws oil from both sides, so that make-up valves open more. Its effect is not symmetric, so finite
differences are taken in both directions."""

SELDOM_KNOWN: Mapping[str, float] = MappingProxyType(
    {
        "presliding_damping": 0.53,
        "makeup_opening": 0.93,
        "moving_mass": 0.15,
        "accumulator_pressure": 0.23,
        _CASE: 0.03,
        "pump_crossport_leakage": 0.26,
    }
)
"""Judged standard deviations: of logarithms, and of the pump's two leakages as shares of the whole [dimensionless]."""

NUDGE = 0.05
"""Finite-difference step in logarithms and shares [dimensionless]."""

_STEPS: Mapping[str, float] = MappingProxyType({"pump_crossport_leakage": -NUDGE, _CASE: SELDOM_KNOWN[_CASE]})
"""Steps of shares: the cylinder leaks the rest."""

RIGHT_SHARE = 0.25
"""Share of the rig files that are right about all of `SELDOM_KNOWN` [fraction], judged."""

NOISE_ALONE = 1.1
"""Root mean square residual over the sensors' noise up to which residuals are noise alone [dimensionless]: the noise is
known to a twentieth, and a log of 1000 blocks determines the size of residuals no better."""

STRUCTURAL_FACTOR = 100.0
"""Factor on the variance for residuals beyond sensor noise [dimensionless]: they persist, and do not follow the
derivatives."""

LOOKS = 10.0
"""Number of independent looks that a log gives at a wrong model's error, however long it is [dimensionless]."""

AVERAGED_BLOCKS = 10
"""Blocks over which residuals are averaged to find a lasting error, and on either side of a block within which a wrong
model's error has the same size [dimensionless]: a tenth of a second."""


def information_divisor(fit: PointFit, blocks: Blocks) -> float:
    """Return the divisor of a fit's information for residuals beyond sensor noise.

    Returns
    -------
    float
        Factor [dimensionless], 1 for noise alone.
    """
    unexplained = float(np.max(1.0 - (blocks.noise / fit.scales) ** 2))
    return 1.0 + STRUCTURAL_FACTOR * max(unexplained, 0.0)


def seldom_known_spreads(actuator: Actuator) -> Array:
    """Return the prior deviations of an actuator's seldom known parameters.

    Returns
    -------
    ndarray, shape (m,)
        Standard deviations of `SELDOM_KNOWN`, and of the relative force on its rod if it was found from a log.
    """
    spreads = list(SELDOM_KNOWN.values())
    if actuator.load_doubt > 0.0:
        spreads.append(actuator.load_doubt / max(abs(actuator.circuit.load_force), actuator.load_doubt))
    return np.array(spreads)


def seldom_known_slopes(fit: PointFit, blocks: Blocks, actuator: Actuator) -> Array:
    """Return the derivatives of the outputs by `SELDOM_KNOWN` and rod force, from one run of circuits side by side.

    Returns
    -------
    ndarray, shape (m, n, outputs)
        Derivatives with respect to logarithms and shares, in the order of `seldom_known_spreads` [m/s, Pa].
    """
    (row,) = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    leakage, case = row[COLUMN["leakage_coefficient"]], row[COLUMN[_CASE]]
    steps = [(name, _STEPS.get(name, NUDGE)) for name in SELDOM_KNOWN]
    if actuator.load_doubt > 0.0:
        steps.append(("load_force", NUDGE))
    unknowns = len(steps)
    if case > 0.0:
        steps.append((_CASE, -min(SELDOM_KNOWN[_CASE], case / leakage)))
    rows = np.tile(row, (1 + len(steps), 1))  # circuits run side by side share the errors of the solver's steps
    for nudged, (name, step) in zip(rows[1:], steps, strict=True):
        at = COLUMN[name]
        if name == "load_force":
            nudged[at] += step * max(abs(row[at]), actuator.load_doubt)
        elif name in _STEPS:
            nudged[at] += step * leakage
        else:
            nudged[at] *= np.exp(step)
    runs = predicted_outputs(blocks, rows)
    slopes = (runs[1:] - runs[0]) / np.array([step for _, step in steps])[:, None, None]
    if case > 0.0:
        at = list(SELDOM_KNOWN).index(_CASE)
        slopes[at] = 0.5 * (slopes[at] + slopes[-1])
    return slopes[:unknowns]


def lasting_power(left: Array) -> Array:
    """Return the power of residuals averaged over `AVERAGED_BLOCKS` blocks, as white noise of one block would have it.

    Parameters
    ----------
    left : ndarray, shape (n, outputs)
        Residuals [m/s, Pa]; NaN where unknown.

    Returns
    -------
    ndarray, shape (outputs,)
        For white noise its mean square, for a lasting error `AVERAGED_BLOCKS` times that [m^2/s^2, Pa^2].
    """
    size = min(AVERAGED_BLOCKS, len(left))
    parts = left[: len(left) // size * size].reshape(-1, size, left.shape[1])
    there = np.sum(np.isfinite(parts), axis=(0, 1))
    return np.asarray(np.sum(np.nansum(parts, axis=1) ** 2, axis=0) / np.maximum(there, 1), dtype=np.float64)


def lasting_misfit(fitted: Array, blocks: Blocks) -> float:
    """Return the excess of a model's residual over 0.1 s above white sensor noise.

    Parameters
    ----------
    fitted : ndarray, shape (n, outputs)
        Outputs of the model [m/s, Pa].

    Returns
    -------
    float
        Ratio of root mean squares, the largest of the outputs [dimensionless]: 1 or less for noise alone.
    """
    power = lasting_power((blocks.outputs - fitted)[blocks.first :])
    return float(np.max(np.sqrt(power) / least_scales(blocks)))


def residuals_of(fit: PointFit, blocks: Blocks) -> Array:
    """Return the residuals of a fit on the blocks that count, shape (n, outputs) [m/s, Pa]; NaN where unknown."""
    return (blocks.outputs - fit.fitted)[blocks.first :]


def residual_power(left: Array, blocks: Blocks) -> Array:
    """Return the mean square of a fit's residuals.

    A search counts no residual below `class_fit.LEAST_SCALE` of the signal. Here that would be a model error, of which
    a log may show that there is none: 10 kHz average the sensors' noise to a third of it.

    Parameters
    ----------
    left : ndarray, shape (n, outputs)
        As `residuals_of` returns it.

    Returns
    -------
    ndarray, shape (outputs,)
        At least the noise, and the error allowed in runs of a circuit [m^2/s^2, Pa^2].
    """
    return np.maximum(root_mean_square(left), np.maximum(blocks.noise, TOLERANCES["tolerance"] * blocks.rms)) ** 2


def noise_power(left: Array, blocks: Blocks) -> Array:
    """Return the power of the sensors' noise; that of a position is at least as large as residuals show it.

    Encoder steps act as known noise while a piston crosses many of them from sample to sample. At low speed they do not
    average. Both give neighbouring blocks opposite errors, which a wrong model does not: for differences of white noise
    the covariance of neighbours is minus half of the variance.

    Parameters
    ----------
    left : ndarray, shape (n, outputs)
        Residuals, as from `residuals_of`.

    Returns
    -------
    ndarray, shape (outputs,)
        Mean squares [m^2/s^2, Pa^2].
    """
    noise = blocks.noise**2
    beside = left[1:, 0] * left[:-1, 0]
    if blocks.differenced and np.any(known := np.isfinite(beside)):
        noise[0] = max(noise[0], -2.0 * float(np.mean(beside[known])))
    return noise


def model_error(left: Array, blocks: Blocks) -> Array:
    """Return the variance of a fit's residuals beyond sensor noise.

    It is the excess over the noise, within the accuracy of that, in the blocks or in their averages: a lasting error
    shows in the averages if noise hides it in a block.

    Parameters
    ----------
    left : ndarray, shape (n, outputs)
        Residuals, as from `residuals_of`.

    Returns
    -------
    ndarray, shape (outputs,)
        Zero for noise alone [m^2/s^2, Pa^2].
    """
    power = residual_power(left, blocks)
    beyond = power - NOISE_ALONE**2 * noise_power(left, blocks)
    lasting = (lasting_power(left) - (NOISE_ALONE * blocks.noise) ** 2) / AVERAGED_BLOCKS
    return np.asarray(np.clip(np.maximum(beyond, lasting), 0.0, power), dtype=np.float64)


def local_variance(left: Array, seen: NDArray[np.bool_]) -> Array:
    """Return the local variance of residuals around each block, over that of the whole log.

    Parameters
    ----------
    left : ndarray, shape (n, outputs)
        Residuals [m/s, Pa], 0 where unknown.
    seen : ndarray, shape (n, outputs)
        Which are known.

    Returns
    -------
    ndarray, shape (n, outputs)
        Mean squares over `AVERAGED_BLOCKS` on either side, over that of all [dimensionless]; 1 for zero residuals.
    """
    sums = np.concatenate([np.zeros((1, 2 * left.shape[1])), np.cumsum(np.hstack([left**2, seen]), axis=0)])
    at = np.arange(len(left))
    within = sums[np.minimum(at + AVERAGED_BLOCKS + 1, len(left))] - sums[np.maximum(at - AVERAGED_BLOCKS, 0)]
    power, counts = np.hsplit(within, 2)
    whole = np.sum(left**2, axis=0) / np.maximum(np.sum(seen, axis=0), 1)
    local = power / np.maximum(counts, 1.0)
    return np.where(whole > 0.0, local / np.where(whole > 0.0, whole, 1.0), 1.0)


def noise_reduction(slopes: Array, seen: NDArray[np.bool_]) -> Array:
    """Return the reduction of a position's noise in a fit against white noise of its velocity.

    Mean velocity over a block is a difference of two positions. The error of the position between two blocks counts in
    both, with opposite signs: neighbours have a correlation of -1/2, and nothing persists.

    Parameters
    ----------
    slopes : ndarray, shape (m, n)
        Response of velocity to fitted and nuisance unknowns, over its deviation [dimensionless].
    seen : ndarray, shape (n,)
        Which blocks are known.

    Returns
    -------
    ndarray, shape (m, m)
        To be subtracted from the second moment of the pulls [dimensionless].
    """
    beside = (slopes[:, 1:] * (seen[1:] & seen[:-1])) @ slopes[:, :-1].T
    return np.asarray(0.5 * (beside + beside.T), dtype=np.float64)


def error_moment(
    fit: PointFit,
    seldom: Array,
    blocks: Blocks,
    centres: Array,
    odds: Array,
    seen: Array,
    spreads: Array,
) -> Array:
    """Return the second moment of a fit's error in its coordinates.

    Parameters
    ----------
    fit : PointFit
        The fit.
    seldom : ndarray, shape (m, n, outputs)
        Response of the outputs to the nuisance unknowns, see `seldom_known_slopes`.
    blocks : Blocks
        Its log, with pressure.
    centres : ndarray, shape (conditions, 7)
        Coordinates of the conditions about which the weak prior may be centred.
    odds : ndarray, shape (conditions,)
        Log-likelihoods of the conditions [dimensionless], up to a constant.
    seen : ndarray, shape (7,)
        1 for what the log can determine, 0 for what it cannot, such as friction of a piston that sticks.
    spreads : ndarray, shape (m,)
        Standard deviations of the nuisance unknowns, see `seldom_known_spreads`.

    Returns
    -------
    ndarray, shape (7, 7)
        Covariance, plus the squares of the steps that prior and log suggest [dimensionless].
    """
    known, left = len(fit.coordinates), residuals_of(fit, blocks)
    there = np.where(blocks.valid, left, 0.0)
    power, lasts = residual_power(left, blocks), model_error(left, blocks) * blocks.counts / LOOKS
    weight = np.sqrt(power + lasts)
    slopes = np.concatenate([fit.slopes * seen[:, None, None], seldom])[:, blocks.first :]
    slopes = np.where(blocks.valid, slopes / weight, 0.0)
    errs = np.sqrt(power + lasts * local_variance(there, blocks.valid)) / weight
    told, erring = (part @ part.T for part in (one.reshape(len(slopes), -1) for one in (slopes, slopes * errs)))
    if blocks.differenced and not np.any(lasts):
        erring = erring - noise_reduction(slopes[..., 0] * (blocks.noise[0] / power[0] ** 0.5), blocks.valid[:, 0])
    prior = np.zeros((len(slopes), len(slopes)))
    prior[:known, :known] = np.linalg.inv(WEAK_PRIOR)
    prior[known:, known:] = np.diag(spreads**-2.0)
    pulls = (slopes.reshape(len(slopes), -1) @ (there / weight).ravel())[:, None]
    pulls = pulls + prior[:, :known] @ (centres - fit.coordinates).T
    whole = np.arange(len(slopes))
    right = np.delete(whole, slice(known, known + len(SELDOM_KNOWN)))  # the force on the rod is unknown in either case
    shares = np.exp(odds - np.max(odds))
    shares /= np.sum(shares)
    evidence, found = list[float](), list[Array]()
    for free in (right, whole):
        its = np.ix_(free, free)
        covariance = np.linalg.inv((told + prior)[its])
        steps, likeliest = covariance @ pulls[free], int(np.argmax(odds))
        volumes = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(prior[its])[1]
        evidence.append(0.5 * float(pulls[free, likeliest] @ steps[:, likeliest] + volumes))
        spread = (covariance @ (erring + prior)[its] @ covariance)[:known, :known]
        found.append(spread + (steps[:known] * shares) @ steps[:known].T)
    odds_right = RIGHT_SHARE / (1.0 - RIGHT_SHARE) * np.exp(min(evidence[0] - evidence[1], 700.0))
    share = odds_right / (1.0 + odds_right)
    return np.asarray(share * found[0] + (1.0 - share) * found[1], dtype=np.float64)
