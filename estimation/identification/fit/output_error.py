"""Output-error identification: the transfer function whose *simulated* output is closest to the measured."""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.fitted import CovarianceKind, Task
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure, predict, sensitivities
from estimation.identification.search.descent import descend
from estimation.identification.search.experiments import Experiments, Signals
from estimation.identification.search.starts import starting_values

SCREENING_SAMPLES = 50_000
"""A longer record is screened on its liveliest section of about this length, and fitted whole afterwards."""

TOLERANCE = 1e-11
"""Share of the cost that a further step may promise at the end; a standard deviation is worth 1 / n."""

FINAL_STEPS = 200
"""Most evaluations given to a finalist."""

FINALISTS = 4
"""Starts that are iterated to convergence, after a few steps from each."""

SAME_MINIMUM = 1e-7
"""Starts whose costs agree to this share after the first steps have found the same minimum."""

SCREENING_STEPS = 12
"""Evaluations given to each start before the finalists are chosen."""

SCREENING_TOLERANCE = 1e-8
"""Likewise as TOLERANCE, while starts are screened."""

STARTS_TIMES_SAMPLES = 160_000
"""Starts that are screened, times samples: what a tenth of a second allows."""

STARTS = (5, 30)
"""Fewest and most starts that are screened."""

CANCELLED_POLES = (0.5, 0.9, 0.99)
"""Poles that are added, each with its zero, to the minimum of one order less."""


def fit_output_error(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    delay: int = 0,
    estimate_initial_state: bool = True,
    covariance: CovarianceKind = "white",
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``y = B/F u + e`` by minimising the sum of squared ``e`` (section 4 of the EHA paper; Table 6).

    Table 6 has ``n_numerator=3, n_denominator=2, delay=0``; a strictly proper second-order model
    ``n_numerator=2, n_denominator=2, delay=1``. Missing output samples (NaN) are left out of the sum. Means
    are not removed: see `estimation.identification.signals.preprocess.detrend`.

    Parameters
    ----------
    u : array_like, shape (n,), or a list of them
        Input, in the unit that its name says; no gaps. Several experiments share coefficients, and have an initial
        state each.
    y : array_like, shape (n,), or a list of them
        Output, in the unit that its name says; NaN where missing.
    sample_time : float
        Seconds between samples [s].
    n_numerator, n_denominator : int
        Free coefficients of ``B`` and ``F``, at least 1 each.
    delay : int
        Dead time [samples].
    estimate_initial_state : bool
        Whether the state at the first sample is estimated along; otherwise the data begin at rest.
    covariance : {"white", "coloured", "auto"}
        Which one standard deviations are taken from; the model carries both. ``"white"``: ``s^2 (J'J)^-1``, right if
        the residual is white. ``"coloured"``: the sandwich
        ``(J'J)^-1 J'RJ (J'J)^-1`` with the residual's autocovariance ``R``, needed for filtered data, whose
        nominal 95 % intervals cover about 35 %. ``"auto"``: the latter where the residual is not white.
    input_name, output_name : str
        Channel names for the result and the messages.

    Returns
    -------
    LinearModel
        The model, with covariance, fit and the initial state.

    Raises
    ------
    HydrostateError
        If the arrays do not match or hold unusable values, the record is too short, or the input does not
        excite as many coefficients as are wanted.

    Examples
    --------
    >>> u = np.sign(np.sin(0.05 * np.arange(400) ** 1.3))
    >>> y = LinearModel([0.2, 0.1], [1.0, -0.7], 0.01, "u", "y").simulate(u)
    >>> fit_output_error(u, y, 0.01, n_numerator=2, n_denominator=1).denominator.round(6).tolist()
    [1.0, -0.7]
    """
    structure = Structure(n_numerator, n_denominator, delay, estimate_initial_state)
    task = Task(structure, sample_time, covariance, (input_name, output_name))
    data = task.experiments(u, y)
    theta = minimise(structure, data)
    return task.model(theta, *jacobian_and_residual(structure, theta, data), data, "output-error")


def minimise(structure: Structure, data: Experiments) -> Array:
    """Return the values of the lowest minimum found from all starts.

    Parameters
    ----------
    data : Experiments
        Input and output of order one.

    Returns
    -------
    ndarray, shape (n_numerator + n_denominator + experiments * n_initial,)
        Numerator, denominator behind its 1, and the initial state of each experiment.
    """
    carried = None if liveliest_section(data) is data else structure.n_main
    finalists = screened(structure, data)
    finished = [descend_from(structure, theta[:carried], data, FINAL_STEPS, TOLERANCE) for _, theta in finalists]
    return min(finished, key=lambda found: found[0])[1]


def screened(structure: Structure, data: Experiments) -> list[tuple[float, Array]]:
    """Return the best starts after a few steps from each, on the liveliest section of a long record.

    Parameters
    ----------
    data : Experiments
        Input and output of order one.

    Returns
    -------
    list of tuple of float and ndarray, shape (p,)
        Sums of squared residuals, and values as `minimise` returns them, the lowest first.
    """
    part = liveliest_section(data)
    count = int(np.clip(STARTS_TIMES_SAMPLES // part.u.size, *STARTS))
    screened = [
        descend_from(structure, start, part, SCREENING_STEPS, SCREENING_TOLERANCE)
        for start in [*starting_values(structure, part, count), *_one_order_less(structure, part)]
    ]
    finalists: list[tuple[float, Array]] = []
    for cost, theta in sorted(screened, key=lambda found: found[0]):
        is_new = all(cost - other > SAME_MINIMUM * cost for other, _ in finalists)
        if is_new and len(finalists) < FINALISTS:
            finalists.append((cost, theta))
    return finalists


def _one_order_less(structure: Structure, data: Experiments) -> list[Array]:
    """Return starts that hold the minimum of one order less, and a pole that a zero cancels.

    They are only for several experiments: the spectra of short experiments do not separate a slow pole from drift, and
    all starts from such spectra hold one.
    """
    n_b, n_f = structure.n_numerator - 1, structure.n_denominator - 1
    if data.count == 1 or min(n_b, n_f) < 1:
        return []
    fewer = replace(structure, n_numerator=n_b, n_denominator=n_f)
    theta = minimise(fewer, data)
    b, f = theta[:n_b], np.concatenate([[1.0], theta[n_b : n_b + n_f]])
    # the response to an initial state is a polynomial over F, so that polynomial is multiplied too
    states = theta[n_b + n_f :].reshape(data.count, fewer.n_initial)
    starts: list[Array] = []
    for pole in CANCELLED_POLES:
        extra = np.array([1.0, -pole])
        longer = [np.convolve(state, extra) for state in states if state.size]
        starts.append(np.concatenate([np.convolve(b, extra), np.convolve(f, extra)[1:], *longer]))
    return starts


def descend_from(
    structure: Structure, start: Array, data: Experiments, steps: int, tolerance: float = TOLERANCE
) -> tuple[float, Array]:
    """Return cost and values of the minimum that a descent from one start reaches.

    Parameters
    ----------
    start : ndarray, shape (n_numerator + n_denominator,) or longer
        Numerator and denominator behind its 1, with or without initial states.
    steps : int
        Evaluations at most.
    tolerance : float
        Share of the cost that a further step may still promise at the end [dimensionless].

    Returns
    -------
    cost : float
        Sum of squared residuals.
    theta : ndarray
        All values.
    """
    whole = np.zeros(structure.n_main + structure.n_initial * data.count)
    whole[: start.size] = start
    weight = data.used.astype(np.float64)
    return descend(whole, structure.sizes, data.u, data.y, weight, data.bounds, steps, tolerance)[:2]


def jacobian_and_residual(structure: Structure, theta: Array, data: Experiments) -> tuple[Array, Array]:
    """Return sensitivities and residual, zero where the output is missing.

    Parameters
    ----------
    theta : ndarray, shape (p,)
        All values, as `minimise` returns them.

    Returns
    -------
    jacobian : ndarray, shape (n, theta.size)
        Derivative of the model's output.
    residual : ndarray, shape (n,)
        Measured less simulated.
    """
    n_main, n_s = structure.n_main, structure.n_initial
    jacobian = np.zeros((data.u.size, theta.size), order="F")
    residual = np.zeros(data.u.size)
    for index, part in enumerate(data.slices):
        own = slice(n_main + index * n_s, n_main + (index + 1) * n_s)
        values = np.concatenate([theta[:n_main], theta[own]])
        columns = sensitivities(structure, values, data.u[part])
        jacobian[part, :n_main], jacobian[part, own] = columns[:, :n_main], columns[:, n_main:]
        residual[part] = data.y[part] - predict(structure, values, data.u[part])
    jacobian[~data.used] = 0.0
    residual[~data.used] = 0.0
    return jacobian, residual


def liveliest_section(data: Experiments) -> Experiments:
    """Return the section of about SCREENING_SAMPLES samples in which the input varies most; short records whole.

    Parameters
    ----------
    data : Experiments
        One record or several; several are kept whole.
    """
    n_sections = max(1, data.u.size // SCREENING_SAMPLES)
    if n_sections == 1 or data.count > 1:
        return data
    length = data.u.size // n_sections
    moves = [
        float(np.var(data.u[k : k + length]) * data.used[k : k + length].mean())
        for k in range(0, n_sections * length, length)
    ]
    begin = int(np.argmax(moves)) * length
    part = slice(begin, begin + length)
    return Experiments(data.u[part], data.y[part], data.used[part], np.array([0, length]))
