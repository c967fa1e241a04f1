"""Score of each condition: fitted circuits compared with the conditions' regions.

Actuators in one condition differ from the nominal one in leakage, flow bias, friction and bulk modulus: a Gaussian
region. The integral of the likelihood over it (Laplace's method: MacKay, Information Theory, 2003, chapter 27) is the
score of the condition. What a log does not determine, such as friction beyond the force on a stuck piston, favours
none.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.between_samples import spread_with_pressure
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import (
    LASTING,
    LEAST_GAIN,
    LEAST_PROMISED_GAIN,
    ROUGH_GAIN,
    STARTS,
    WEAK_PRIOR,
    PointFit,
    fit_freely,
    misfit,
    nominal_runs,
    scales_of,
    with_cost_about,
)
from faults.diagnosis.circuits.friction_shape import bend_covariance, bend_shifts, bent_information
from faults.diagnosis.circuits.model_doubt import information_divisor, lasting_misfit
from faults.diagnosis.circuits.pressure_scale import PRESSURE_SCALE, at_likeliest_scale, spread_without_pressure
from faults.diagnosis.circuits.region_scores import region_scores, scores_in_forces, separations, separations_in_forces
from faults.diagnosis.circuits.rivals import (
    covariance_between_fits,
    fits_from_other_friction,
    is_followed_roughly,
    leaves_only_noise,
    log_likelihood_behind,
)
from plant.arrays import Array

STUCK_TRAVEL = 5.0
"""Travel in presliding displacements below which a piston counts as stuck [dimensionless]."""

_NO_FRICTION = np.array([0.0 if name.startswith("friction") else 1.0 for name in COORDINATES])


@dataclass(frozen=True, eq=False)
class ClassFits:
    """Fits of the circuit model to a log.

    Parameters
    ----------
    best : PointFit
        The circuit that fits best.
    information : ndarray, shape (7, 7)
        Credible information on its coordinates: inverse covariance without a prior.
    nominal : ndarray, shape (9,)
        Misfit of each condition's nominal circuit [dimensionless].
    nominal_scales : ndarray, shape (9, outputs)
        Root mean square of its residuals [m/s, Pa].
    scores : ndarray, shape (9,)
        How well the fitted circuits fit each condition's region: log-likelihoods [dimensionless].
    compute_spread : callable
        Computes `spread`, which needs runs of circuits: most fits are used for their scores only.
    lasting : float
        Divisor of the information for a lasting model error [dimensionless], see `lasting_misfit`; at least 1, and 1
        without pressure.
    bend_shifts : ndarray, shape (7, m)
        Shift of the coordinates by bends of the friction law [dimensionless], see `bend_shifts`.
    unbent_scores : ndarray, shape (9,), optional
        The scores without such bends; `scores` if not given.
    """

    best: PointFit
    information: Array
    nominal: Array
    nominal_scales: Array
    scores: Array
    compute_spread: Callable[[], Array]
    lasting: float
    bend_shifts: Array = field(default_factory=lambda: np.zeros((len(COORDINATES), 1)))
    unbent_scores: Array | None = None

    @cached_property
    def spread(self) -> Array:
        """Covariance of the coordinates for intervals, shape (7, 7) [dimensionless].

        See `faults.diagnosis.circuits.model_doubt`, and without pressure `spread_without_pressure`.
        """
        return self.compute_spread()

    @property
    def one_law_scores(self) -> Array:
        """Scores of parts of a log, or of circuits, that share one friction law, shape (9,)."""
        return self.scores if self.unbent_scores is None else self.unbent_scores

    @property
    def discounted_information(self) -> Array:
        """Information on the coordinates, lasting model error included, shape (7, 7) [dimensionless].

        It decides whether a circuit is between the conditions. Intervals use `spread`, which is narrower if a model
        error persists: it would find more such circuits on the lumped plant, but one more plain log in 150 would be
        falsely unknown.
        """
        return bent_information(self.information / self.lasting, self.bend_shifts)

    @property
    def bent_spread(self) -> Array:
        """Covariance of the coordinates for intervals if the friction law may be bent, shape (7, 7)."""
        return self.spread + bend_covariance(self.information, self.bend_shifts)

    def separations(self, actuator: Actuator) -> Array:
        """Return the separation of each pair of conditions by the log, see `faults.diagnosis.circuits.region_scores`.

        Returns
        -------
        ndarray, shape (9, 9)
            Expected log-likelihood ratios [dimensionless] if the friction law may be bent.
        """
        if not np.any(self.bend_shifts):
            return separations(self.spread, actuator)
        return separations_in_forces(self.best, self.spread + self.bend_shifts @ self.bend_shifts.T, actuator)

    @property
    def covariance(self) -> Array:
        """Covariance of the coordinates under the weak prior, shape (7, 7) [dimensionless]."""
        return np.asarray(np.linalg.inv(self.information + np.linalg.inv(WEAK_PRIOR)), dtype=np.float64)


def fit_classes(
    blocks: Blocks, actuator: Actuator, *, runs: Array | None = None, start: Array | None = None, wanted: float = np.inf
) -> ClassFits:
    """Fit circuits to a log from the nearest conditions, and score all nine.

    Parameters
    ----------
    runs : ndarray, shape (9, n, outputs), optional
        Outputs of the nine nominal circuits [m/s, Pa]; computed if not given.
    start : ndarray, shape (7,), optional
        Coordinates of a nearby circuit [dimensionless]: one search begins there, in place of one per near condition,
        and ends if it gains or promises little.
    wanted : float
        Cost above which a circuit is of no use, see `fit_freely` [dimensionless].

    Returns
    -------
    ClassFits
        The best circuit, and the conditions' scores.
    """
    runs = nominal_runs(blocks, actuator) if runs is None else runs
    errors = np.array([scales_of(blocks, run) for run in runs])
    nominal = np.array([misfit(blocks, run, one) for run, one in zip(runs, errors, strict=True)])
    stuck = is_stuck(blocks, actuator)
    fits = _fits_from_near_conditions(blocks, actuator, nominal, start, wanted)
    if start is None and blocks.pressure is not None and not stuck:
        fits += _fits_from_friction_elsewhere(blocks, actuator, fits)
    known = [credible_information(fit, blocks, stuck=stuck) for fit in fits]
    least = int(np.argmin([fit.cost for fit in fits]))
    worse = log_likelihood_behind(fits, fits[least], blocks)
    straight = [region_scores(fit, information, actuator) for fit, information in zip(fits, known, strict=True)]
    moved, scores = [np.zeros((len(COORDINATES), 1)) for _ in fits], straight
    if blocks.pressure is not None and not stuck:
        moved = [bend_shifts(fit, blocks, actuator) for fit in fits]
        told = [bent_information(information, by) for information, by in zip(known, moved, strict=True)]
        scores = [scores_in_forces(fit, one, actuator) for fit, one in zip(fits, told, strict=True)]
    likeliest = misfit(blocks, fits[least].fitted, fits[least].scales) / LASTING
    held, unbent = (np.max(np.array(one) - worse[:, None], axis=0) - likeliest for one in (scores, straight))
    if blocks.pressure is None:
        # no flow balance tests for another pump or other faults, so only the regions can
        centre, lasting = actuator.conditions[np.argmax(unbent)], 1.0
        best = at_likeliest_scale(fits[least], centre)
        spreading = partial(spread_without_pressure, best, known[least], blocks, centre)
    else:
        best = fits[least]
        lasting = max(1.0, lasting_misfit(best.fitted, blocks))
        seen = _NO_FRICTION if stuck else np.ones(len(COORDINATES))
        among = covariance_between_fits(fits, best, worse)
        spreading = partial(spread_with_pressure, best, blocks, actuator, unbent, seen, among)
    return ClassFits(best, known[least], nominal, errors, held, spreading, lasting, moved[least], unbent)


def _fits_from_near_conditions(
    blocks: Blocks, actuator: Actuator, nominal: Array, start: Array | None, wanted: float
) -> list[PointFit]:
    """Return the circuits found from the conditions whose nominal circuits fit best, or from a start near the first.

    A search from a further condition is left out if a circuit leaves only noise, or if that circuit is as near.
    """
    order = np.argsort(nominal)[: STARTS if start is None else 1]
    near = [int(i) for i in order if nominal[i] <= nominal[order[0]] + len(blocks.velocity)]
    gained, promising = (LEAST_GAIN, LEAST_PROMISED_GAIN) if start is None else (ROUGH_GAIN, LEAST_GAIN)
    fits: list[PointFit] = []
    for name in [list(CONDITIONS)[place] for place in near or [int(order[0])]]:
        if not fits or not leaves_only_noise(blocks, fits[-1]):
            fits.append(fit_freely(blocks, actuator, name, start, gained, wanted, promising))
        elif with_cost_about(blocks, actuator, name, fits[-1]).cost < fits[-1].cost:  # nearer to that circuit
            fits.append(fit_freely(blocks, actuator, name, fits[-1], gained))
    return fits


def _fits_from_friction_elsewhere(blocks: Blocks, actuator: Actuator, fits: list[PointFit]) -> list[PointFit]:
    """Return the circuits found from the best one with other friction, if that follows the log roughly."""
    first = min(fits, key=lambda fit: fit.cost)
    if not is_followed_roughly(blocks, first):
        return []
    nearest = int(np.argmax(region_scores(first, credible_information(first, blocks), actuator)))
    return fits_from_other_friction(blocks, actuator, first, list(CONDITIONS)[nearest])


def is_stuck(blocks: Blocks, actuator: Actuator) -> bool:
    """Return whether the piston only yields on its seals.

    Returns
    -------
    bool
        Whether it moves by no more than a few presliding displacements.
    """
    return blocks.travel < STUCK_TRAVEL * actuator.circuit.presliding_displacement


def credible_information(fit: PointFit, blocks: Blocks, *, stuck: bool = False) -> Array:
    """Return the credible information of a fit: residuals beyond the sensors' noise count as lasting model error.

    Without pressure there is none on `PRESSURE_SCALE`: motion is the same at twice the pressure, with half the leakage
    and twice the friction and bulk modulus, except for inertia, whose effect is below a model's error.

    Parameters
    ----------
    stuck : bool
        Whether the piston sticks: there is then no information on friction, since the seals' stiffness moves it.

    Returns
    -------
    ndarray, shape (7, 7)
        Inverse covariance of the coordinates, without a prior.
    """
    believed = fit.information / information_divisor(fit, blocks)
    if stuck:
        believed = believed * np.outer(_NO_FRICTION, _NO_FRICTION)
    if blocks.pressure is not None:
        return believed
    along = believed @ PRESSURE_SCALE
    curvature = float(PRESSURE_SCALE @ along)
    return believed - np.outer(along, along) / curvature if curvature > 0.0 else believed


def nearest_score(fits: ClassFits, blocks: Blocks, actuator: Actuator) -> float:
    """Return the score of the condition nearest to a log.

    Without pressure, searches from several conditions end at circuits that follow a log about equally well, some within
    a condition and some far from all. A log is outside only if all are, or if those inside explain much less.

    Returns
    -------
    float
        Log-likelihood of the region with the best circuit [dimensionless], 0 at its centre; without pressure the best
        over all circuits, each less its distance from the best fit.
    """
    best = float(np.max(region_scores(fits.best, fits.discounted_information, actuator)))
    if blocks.pressure is not None:
        return best
    return max(best, float(np.max(fits.scores)) + misfit(blocks, fits.best.fitted) / LASTING)
