"""Output-error fit of a grey-box model: several starts, exact sensitivities, residual tests and covariance.

The variance of an estimate has three parts: noise of the outputs, noise of the driving channels, and the uncertainty of
the rig's own parameters. The last two follow from the fit's linear response to them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter

import numpy as np

from estimation.arrays import IntArray
from estimation.fits.greybox.chance import largest_chi_square
from estimation.fits.greybox.descent import Point, descend
from estimation.fits.greybox.deviations import Information, covariance_of, information, prior_precision
from estimation.fits.greybox.lateness import Delays, late_and_play, residuals_and_changes
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.noise_shift import noise_shift
from estimation.fits.greybox.play import NO_PLAY, ShownPlay
from estimation.fits.greybox.problem import Problem, search_bounds
from estimation.fits.greybox.pump_ripple import NO_OFFSET, ShownOffset, ShownRipple, shown_ripple
from estimation.fits.greybox.rig_response import responses_to_rig
from estimation.fits.greybox.small_pump_ripple import NO_SHIFTS, small_pump_ripple
from estimation.fits.greybox.spared_steps import with_steps
from estimation.models.greybox import GreyBoxModel
from plant.arrays import Array
from plant.spare_processors import map_cases

LEAST_EFFECT = 1.0
"""Standard deviations of one sample by which a unit change of an unknown must move the prediction; otherwise it has no
effect."""

SCREENED_SAMPLES = 200_000
"""Length above which starts are compared on the beginning of a log."""

BEGINNING_RATIO = 8
"""Ratio of successive beginnings of a long log on which the fit approaches the optimum."""

NEAR_ENOUGH = 0.01
"""Half the sum of squares that a further step must promise while model steps are long [dimensionless]."""


@dataclass(frozen=True, eq=False)
class GreyBoxFit:
    """Result of a grey-box fit.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    theta : ndarray, shape (unknowns,)
        The fitted coordinates.
    values : Mapping[str, float]
        The unknowns in SI.
    std : Mapping[str, float]
        Standard deviation of each due to noise alone, in SI; infinite if the log does not determine it.
    cost : float
        Half the sum of squared normalised residuals, outliers counted linearly [dimensionless].
    chi_square : tuple of float
        Mean squared normalised residual of each output; 1 if the model explains the log [dimensionless].
    autocorrelation : tuple of float
        Correlation of neighbouring normalised residuals; 0 if the model explains the log [dimensionless].
    rig_slopes : Mapping[str, Mapping[str, float]]
        By uncertain entry of the rig: change of each unknown, in SI, per relative change of the entry.
    late : Mapping[str, tuple of float]
        By channel whose timing is tested: its apparent delay [s], and what removing it does to first order: the gain in
        log-likelihood [dimensionless], and the change of bulk modulus [fraction].
    play : ShownPlay
        What the residuals show of an encoder's play, if a fit tests for it.
    slopes : ndarray, shape (outputs * blocks, unknowns)
        Derivatives of the normalised residuals there [dimensionless].
    covariance : ndarray, shape (unknowns, unknowns)
        Covariance of the fitted coordinates due to noise alone, with the prior; infinite variances for undetermined
        unknowns [dimensionless].
    teeth : Mapping[int, ShownRipple]
        What the residuals show of the pump's ripple, by tooth count, if a fit tests for it.
    speed_offset : ShownOffset
        What they show of an offset of the logged speed, likewise.
    small_teeth : tuple of Mapping[str, float]
        By how much ripple that is not fitted moves each coordinate, and adds to its variance [dimensionless].
    noise_shift : tuple of Mapping[str, float]
        The same for noise of motor speed [dimensionless], see `noise_shift`.
    seen : float
        Number of residuals of the first output; infinite if they are not counted [count].
    steps : ndarray of int, shape (n,), optional
        Fewer model steps than the log's that are equally exact near the solution, see `steps_where_needed` [count].
    """

    model: GreyBoxModel
    theta: Array
    values: Mapping[str, float]
    std: Mapping[str, float]
    cost: float
    chi_square: tuple[float, ...]
    autocorrelation: tuple[float, ...]
    rig_slopes: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])
    late: Delays = field(default_factory=dict[str, tuple[float, float, float]])
    play: ShownPlay = NO_PLAY
    slopes: Array = field(default_factory=lambda: np.empty((0, 0)))
    covariance: Array = field(default_factory=lambda: np.empty((0, 0)))
    teeth: Mapping[int, ShownRipple] = field(default_factory=dict[int, ShownRipple])
    speed_offset: ShownOffset = NO_OFFSET
    small_teeth: tuple[Mapping[str, float], Mapping[str, float]] = NO_SHIFTS
    noise_shift: tuple[Mapping[str, float], Mapping[str, float]] = NO_SHIFTS
    seen: float = np.inf
    steps: IntArray | None = None


@dataclass(frozen=True)
class Search:
    """Options of the search for the best of several starts.

    Parameters
    ----------
    screened : int
        Length above which starts are compared on the beginning of a log [samples].
    screening : int
        Evaluations of the model per start.
    finalists : int
        Starts that are searched further.
    evaluations : int
        Most evaluations of the model per finalist.
    near_enough : float
        Half the sum of squares that a further step must promise [dimensionless].
    """

    screened: int = SCREENED_SAMPLES
    screening: int = 12
    finalists: int = 2
    evaluations: int = 40
    near_enough: float = NEAR_ENOUGH


DEFAULT_SEARCH = Search()
"""Sufficient for a few unknowns whose effects are separate."""


def fit_greybox(
    model: GreyBoxModel,
    log: GreyBoxLog,
    *,
    starts: Sequence[Mapping[str, float]],
    search: Search = DEFAULT_SEARCH,
) -> GreyBoxFit:
    """Fit the unknowns of any model to a log, from several starts, and return the best.

    Parameters
    ----------
    log : GreyBoxLog
        The log, see `estimation.fits.greybox.log.greybox_log`.
    starts : sequence of Mapping[str, float]
        First guesses of the unknowns in SI.
    search : Search
        Options of the search.
    """
    problem, guesses = Problem(model, log), [model.theta(start) for start in starts]
    bounds = search_bounds(model, guesses, {})
    near = coarse_optimum(problem, guesses, search, bounds)
    return fit_at_solution(problem, descend(problem.at, near.theta, search.evaluations, bounds))


def coarse_optimum(
    problem: Problem,
    guesses: Sequence[Array],
    search: Search,
    bounds: tuple[Array, Array],
    wanted: float = np.inf,
    *,
    hopeful: bool = False,
    screen: Callable[[Array], Point] | None = None,
) -> Point:
    """Return the lowest cost from several starts, with one model step per sample.

    Parameters
    ----------
    problem : Problem
        Model and log.
    guesses : sequence of ndarray, shape (unknowns,)
        The starts [dimensionless].
    search : Search
        Options of the search.
    bounds : tuple of ndarray, shape (unknowns,)
        Lowest and highest coordinates [dimensionless].
    wanted : float
        Cost above which the result is of no use [dimensionless], see `estimation.fits.greybox.descent.descend`.
    hopeful : bool
        Whether several starts are followed only if one explains the beginning; else the cost is infinite.
    screen : callable, optional
        The misfit on the beginning of a log that is longer, if another search has asked for some of it.

    Returns
    -------
    Point
        The best point, with its cost at those model steps.
    """
    log = problem.log.coarsened()
    whole = problem.on(log)

    def descended(guess: Array, samples: int, evaluations: int) -> Point:
        if samples < len(log.measured):
            at = screen if screen and samples == search.screened else problem.on(log.beginning(samples)).at
            return descend(at, guess, evaluations, bounds, search.near_enough)
        return descend(whole.at, guess, evaluations, bounds, search.near_enough, wanted=wanted)

    if len(guesses) > 1:
        screened = map_cases(lambda guess: descended(guess, search.screened, search.screening), guesses)
        likely = sorted(screened, key=attrgetter("cost"))[: search.finalists]
        if hopeful and not explains_log(problem.on(log.beginning(search.screened)), likely[0]):
            return replace(likely[0], cost=np.inf)
        guesses = [point.theta for point in likely]
    points: list[Point] = []
    for guess in guesses:
        length = BEGINNING_RATIO * search.screened
        while length < len(log.measured):  # ever longer beginnings, so that the whole log takes few steps
            guess, length = descended(guess, length, search.evaluations).theta, BEGINNING_RATIO * length
        points.append(descended(guess, len(log.measured), search.evaluations))
        if explains_log(whole, points[-1]):
            break
    return min(points, key=attrgetter("cost"))


def explains_log(problem: Problem, point: Point) -> bool:
    """Return whether a point of the search explains a log so well that no other finalist need be tried."""
    return 2.0 * point.cost < largest_chi_square(problem.blocks) * problem.blocks


@dataclass(frozen=True)
class Asked:
    """What a fit is asked beside its unknowns.

    Parameters
    ----------
    disturbed : bool
        Whether the deviations include drive noise.
    beside : bool
        Whether such a fit also includes the response to the rig's uncertainties and the timing of drives.
    warned : bool
        Whether to warn if unknowns are not separately determined; otherwise their deviations are infinite.
    """

    disturbed: bool = True
    beside: bool = True
    warned: bool = True


ASKED = Asked()
"""Everything."""


def fit_at_solution(
    problem: Problem,
    point: Point,
    *,
    least: Array | None = None,
    asked: Asked = ASKED,
    steps: IntArray | None = None,
    moved_by_noise: Array | None = None,
) -> GreyBoxFit:
    """Return the result at a solution, with its standard deviations.

    Parameters
    ----------
    problem : Problem
        The problem.
    point : Point
        Its solution.
    least : ndarray, shape (unknowns,), optional
        Lowest coordinates of its search, see `estimation.fits.greybox.sign_constraints` [dimensionless].
    asked : Asked
        What is told beside the unknowns.
    steps : ndarray of int, shape (n,), optional
        See `GreyBoxFit`; responses to the rig's uncertainties are as exact with them.
    moved_by_noise : ndarray, shape (outputs * blocks, draws), optional
        Effect of drive noise on the residuals, if computed for another balance [dimensionless].
    """
    model, theta = problem.model, point.theta
    errors, all_slopes = problem.linearised(theta)
    effects = np.einsum("ij,ij->j", all_slopes, all_slopes)
    felt = np.flatnonzero(effects > np.where(prior_precision(problem) > 0.0, 0.0, LEAST_EFFECT**2))
    whole, rig, late = np.diag(np.full(len(theta), np.inf)), dict[str, Array](), dict[str, tuple[float, float, float]]()
    play, teeth, offset, by_noise = NO_PLAY, dict[int, ShownRipple](), NO_OFFSET, NO_SHIFTS
    if len(felt) and np.count_nonzero(errors) > len(theta):
        known_of = information(problem, theta, errors, all_slopes, felt, warned=asked.warned)
        told = asked.disturbed and asked.beside
        here, moved = residuals_and_changes(problem, theta, errors) if told else (None, [])
        covariance = covariance_of(
            problem, point, known_of, least=least, disturbed=asked.disturbed, undisturbed=here, moved=moved_by_noise
        )
        teeth, offset, opened = _ripple_and_offset(problem, theta, known_of, asked)
        whole[np.ix_(felt, felt)] = covariance + np.diag(opened)
        if told:
            by_noise = noise_shift(problem, theta, known_of)
            rig = dict(responses_to_rig(with_steps(problem, steps), theta, known_of))
            late, play = late_and_play(problem, known_of, moved, effects[felt] > LEAST_EFFECT**2)
    # infinite for unknowns that this log does not determine
    noise = np.where(effects > LEAST_EFFECT**2, np.sqrt(np.diag(whole)), np.inf)
    # fitted ripple is not small, and in a slow log the course of the motor looks like ripple
    asked_of_teeth = {} if problem.log.teeth or problem.log.course is not None else teeth
    sizes, values = dict(model.linear), model.values(theta)
    unit = np.array([sizes.get(name, values[name]) for name in model.unknowns])
    slopes_si = {name: dict(zip(model.unknowns, map(float, unit * one), strict=True)) for name, one in rig.items()}
    chi_square, autocorrelation, seen = _statistics(errors)
    return GreyBoxFit(
        model=model,
        theta=theta,
        values=values,
        std=dict(zip(model.unknowns, map(float, unit * noise), strict=True)),
        rig_slopes=slopes_si,
        late=late,
        play=play,
        slopes=all_slopes,
        teeth=teeth,
        speed_offset=offset,
        small_teeth=small_pump_ripple(asked_of_teeth, [model.unknowns[place] for place in felt]),
        noise_shift=by_noise,
        covariance=whole,
        cost=point.cost,
        chi_square=chi_square,
        autocorrelation=autocorrelation,
        seen=seen,
        steps=steps,
    )


def _ripple_and_offset(
    problem: Problem, theta: Array, known_of: Information, asked: Asked
) -> tuple[Mapping[int, ShownRipple], ShownOffset, Array]:
    """Return what residuals show of ripple and of an offset of speed, and the variance that correcting either adds."""
    corrected, shifted = [one.count for one in problem.log.teeth], problem.log.speed_offset != 0.0
    counts, opened = problem.log.counts if asked.beside else corrected, np.zeros(len(known_of.felt))
    if not ((asked.disturbed and counts) or shifted):
        return {}, NO_OFFSET, opened
    known = known_of.left_over, known_of.fitted_bread, known_of.fitted_slopes
    teeth, offset = shown_ripple(problem, theta, *known, counts)
    opened = sum((teeth[count].opened for count in corrected if count in teeth), opened)
    return teeth, offset, opened + offset.opened if shifted and not corrected else opened


def _statistics(errors: Array) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """Return mean square and autocorrelation of each output's residuals, and the number of residuals of the first."""
    squares, seen = np.einsum("ij,ij->i", errors, errors), np.maximum(np.count_nonzero(errors, axis=1), 1)
    autocorrelation = np.einsum("ij,ij->i", errors[:, 1:], errors[:, :-1]) / np.maximum(squares, np.finfo(float).tiny)
    return tuple(map(float, squares / seen)), tuple(map(float, autocorrelation)), float(seen[0])
